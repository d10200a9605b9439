"""Dresses true marker trajectories as an optical system would send them.

Points arrive unlabelled and in no order; a marker keeps its device id only while it is seen and gets a new one
after every gap; some points are ghosts, some belong to other bodies. What every point truly is comes with it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from core.errors import PhalanxError
from core.frames import BoolArray, FloatArray, IntArray, MarkerFrame, RigidBody, Times
from core.props.prop import Prop
from core.recording import Recording

GHOST = -1
"""Truth of a point that no marker caused."""

MEDIAN_GAP_S = 0.18
GAP_SPREAD = float(np.log(2.0) / 1.2816)  # log-normal: one gap in ten is longer than 0.36 s
GHOST_LIFE_S = 0.05
MAX_HIDDEN = 0.9
_FIRST_ID = 1


class Trajectories(Protocol):
    """Labelled markers over time: a Performer or a RecordingMotion."""

    labels: tuple[str, ...]

    def positions(self, rate_hz: float) -> Iterator[tuple[float, FloatArray]]:
        """Motion time [s] and (len(labels), 3) float64 [m], NaN where a marker is not seen. Where the time goes
        backwards the motion begins again, with no continuity."""
        ...


@runtime_checkable
class Handling(Protocol):
    """Trajectories of one who handles things: a Performer."""

    def props_world(self, time_s: float) -> dict[str, FloatArray]:
        """(4, 4) float64 [m] of every thing, by name, at a motion time [s]."""
        ...


class RecordingMotion:
    """A labelled recording as a source of trajectories, with its own gaps, once or over and over.

    Raises PhalanxError for an unlabelled recording: only Recording.frames knows the ids of its points.
    """

    def __init__(self, recording: Recording, repeat: bool = False) -> None:
        self.recording = recording
        self.repeat = repeat
        self.labels = recording.labels
        if not self.labels:
            raise PhalanxError(
                f"{recording.name} has no labels; hidden markers, ghosts and noise are only added to labelled motion.",
                "Play it as it is, or choose a labelled recording.",
            )

    def positions(self, rate_hz: float) -> Iterator[tuple[float, FloatArray]]:
        """At the recording's own rate its very samples; at another, linear between neighbouring samples."""
        points, own_hz = self.recording.points_m, self.recording.rate_hz
        last = self.recording.n_frames - 1
        if last < 0:
            return
        i = 0
        while True:
            place = i * own_hz / rate_hz
            if place > last + 1e-6:
                if not self.repeat:
                    return
                i, place = 0, 0.0
            before = min(int(place + 1e-6), last)
            share = place - before
            sample = points[before]
            if share > 1e-6:
                sample = sample * (1.0 - share) + points[min(before + 1, last)] * share
            yield place / own_hz, sample
            i += 1


@dataclass(frozen=True, slots=True)
class LabelledFrame:
    """A frame as sent, and the truth. truth: (n,) int64, index into the stream's labels, GHOST for none."""

    frame: MarkerFrame
    truth: IntArray


class MarkerStream:
    """Marker frames made from trajectories; the same arguments give the same frames.

    source: where the markers truly are. rate_hz: frames per second.
    hidden: share of the time a marker is hidden, besides the source's own gaps, 0 to 0.9.
    ghosts: mean number of ghost points per frame. noise_m: white noise per axis [m].
    skin_m: slow movement of each marker against the bone, RMS over all three axes [m].
    bodies: other rigid bodies in the volume, of four markers each.
    props: to send the markers of, each by the name of a thing that the source, a performer, handles.
    labels: the source's, then those of the bodies and props.
    Raises PhalanxError for a value out of range.
    """

    def __init__(
        self,
        source: Trajectories,
        rate_hz: float,
        seed: int = 0,
        *,
        hidden: float = 0.0,
        ghosts: float = 0.0,
        noise_m: float = 0.00003,
        skin_m: float = 0.0,
        bodies: int = 0,
        props: tuple[Prop, ...] = (),
    ) -> None:
        for name, value, high in (
            ("frame rate", rate_hz, 10_000.0),
            ("hidden share", hidden, MAX_HIDDEN),
            ("number of ghosts", ghosts, 1000.0),
            ("noise [m]", noise_m, 0.1),
            ("skin movement [m]", skin_m, 0.1),
            ("number of bodies", bodies, 50),
        ):
            if not 0.0 <= value <= high:
                raise PhalanxError(f"The {name} is {value}.", f"Give a number from 0 to {high:g}.")
        if rate_hz == 0.0:
            raise PhalanxError("The frame rate is 0.", "Give frames per second, for example 120.")
        self.source, self.rate_hz, self.seed = source, float(rate_hz), seed
        self.hidden, self.ghosts, self.noise_m, self.skin_m = hidden, ghosts, noise_m, skin_m
        names = [f"body{b + 1}_{m + 1}" for b in range(bodies) for m in range(4)]
        names += [name for prop in props for name in prop.marker_names]
        self.labels = source.labels + tuple(names)
        self.n_bodies, self.props = bodies, props
        handled: Mapping[str, object] = getattr(source, "props", {})
        for prop in props:
            if prop.name not in handled:
                raise PhalanxError(
                    f"Nobody handles a {prop.name!r} in this motion.",
                    "It has: " + ", ".join(handled) + "." if handled else "It has no props.",
                )

    def frames(self) -> Iterator[MarkerFrame]:
        """The frames alone, from the first on."""
        return (labelled.frame for labelled in self.labelled())

    def labelled(self) -> Iterator[LabelledFrame]:
        """The frames with what each point truly is, from the first on."""
        seeds = np.random.SeedSequence(self.seed).spawn(5)
        random = np.random.default_rng(seeds[0])
        n = len(self.labels)
        curtain = _Curtain(n, self.hidden, seeds[1])
        ghosts = _Ghosts(self.ghosts, np.random.default_rng(seeds[2]))
        bodies = [_Body(b, np.random.default_rng(s)) for b, s in enumerate(seeds[3].spawn(self.n_bodies))]
        skin = _Skin(len(self.source.labels), self.skin_m, np.random.default_rng(seeds[4]))
        ids = np.zeros(n, dtype=np.int64)
        was_seen = np.zeros(n, dtype=np.bool_)
        next_id, motion_before_s = _FIRST_ID, -np.inf
        for i, (motion_s, source_m) in enumerate(self.source.positions(self.rate_hz)):
            time_s = i / self.rate_hz
            points = np.concatenate(
                [source_m + skin.at(time_s), *(body.markers_m(time_s) for body in bodies), *self._props_m(motion_s)]
            )
            seen = ~np.isnan(points).any(axis=1) & ~curtain.hidden_at(time_s)
            if motion_s < motion_before_s:
                was_seen[:] = False
            motion_before_s = motion_s
            fresh = np.flatnonzero(seen & ~was_seen)
            ids[fresh] = next_id + np.arange(len(fresh))
            next_id += len(fresh)
            was_seen = seen
            ghost_m, ghost_ids, next_id = ghosts.at(time_s, points[seen], next_id)

            shown = np.flatnonzero(seen)
            truth = np.concatenate([shown, np.full(len(ghost_m), GHOST, dtype=np.int64)])
            sent_m = np.concatenate([points[seen], ghost_m])
            sent_m += random.normal(0.0, 1.0, sent_m.shape) * self.noise_m
            order = random.permutation(len(truth))
            residuals = np.abs(random.normal(self.noise_m, 0.3 * self.noise_m, len(truth)))
            residuals[truth == GHOST] += 0.0008
            frame = MarkerFrame(
                sequence=i,
                times=Times(time_s, time_s, time_s),
                points_m=sent_m[order],
                ids=np.concatenate([ids[seen], ghost_ids])[order],
                residuals_m=residuals[order],
                rigid_bodies=tuple(
                    body.record(time_s, seen[len(self.source.labels) + 4 * b :][:4]) for b, body in enumerate(bodies)
                ),
            )
            yield LabelledFrame(frame, truth[order])

    def _props_m(self, motion_s: float) -> list[FloatArray]:
        """(m, 3) float64 [m] of every prop."""
        if not self.props or not isinstance(self.source, Handling):
            return []
        placed = self.source.props_world(motion_s)
        return [prop.placed_m(placed[prop.name]) for prop in self.props]


class _Curtain:
    """When each marker is hidden: gaps with log-normal lengths, exponential times between them."""

    def __init__(self, n: int, hidden: float, seed: np.random.SeedSequence) -> None:
        mean_gap_s = MEDIAN_GAP_S * float(np.exp(GAP_SPREAD**2 / 2.0))
        self._mean_seen_s = mean_gap_s * (1.0 - hidden) / hidden if hidden > 0.0 else np.inf
        self._random = [np.random.default_rng(child) for child in seed.spawn(n)]  # a marker's gaps are its own
        self._hidden = np.zeros(n, dtype=np.bool_)
        self._until_s = np.full(n, np.inf)
        if np.isfinite(self._mean_seen_s):
            self._until_s = np.array([random.exponential(self._mean_seen_s) for random in self._random])

    def hidden_at(self, time_s: float) -> BoolArray:
        """(n,) bool; time must not go backwards."""
        for m in np.flatnonzero(self._until_s <= time_s):
            while self._until_s[m] <= time_s:
                self._hidden[m] = not self._hidden[m]
                self._until_s[m] += (
                    MEDIAN_GAP_S * np.exp(self._random[m].normal(0.0, GAP_SPREAD))
                    if self._hidden[m]
                    else self._random[m].exponential(self._mean_seen_s)
                )
        return self._hidden.copy()


class _Ghosts:
    """Points that flicker next to real ones, each with an id of its own."""

    def __init__(self, mean: float, random: np.random.Generator) -> None:
        self._births_per_s = mean / GHOST_LIFE_S
        self._random = random
        self._next_s = random.exponential(1.0 / self._births_per_s) if mean > 0.0 else np.inf
        self._alive: list[tuple[float, int, FloatArray]] = []  # until [s], id, position [m]

    def at(self, time_s: float, near_m: FloatArray, next_id: int) -> tuple[FloatArray, IntArray, int]:
        """Positions (g, 3), ids (g,) and the next free id. near_m: points that ghosts may be reflections of."""
        self._alive = [ghost for ghost in self._alive if ghost[0] > time_s]
        while self._next_s <= time_s:
            until_s = self._next_s + self._random.exponential(GHOST_LIFE_S)
            self._next_s += self._random.exponential(1.0 / self._births_per_s)
            offset = self._random.normal(0.0, 1.0, 3)
            offset *= self._random.uniform(0.008, 0.08) / np.linalg.norm(offset)
            pick = self._random.random()
            if until_s > time_s and len(near_m):
                self._alive.append((until_s, next_id, near_m[int(pick * len(near_m))] + offset))
                next_id += 1
        positions = np.array([ghost[2] for ghost in self._alive]).reshape(-1, 3)
        return positions, np.array([ghost[1] for ghost in self._alive], dtype=np.int64), next_id


class _Skin:
    """Markers ride on skin: two slow waves per marker and axis."""

    def __init__(self, n: int, rms_m: float, random: np.random.Generator) -> None:
        self._amplitude_m = rms_m / np.sqrt(3.0)  # two unit waves have RMS one per axis
        self._frequency = 2.0 * np.pi * random.uniform(0.3, 2.5, (2, n, 3))
        self._phase = random.uniform(0.0, 2.0 * np.pi, (2, n, 3))

    def at(self, time_s: float) -> FloatArray:
        """(n, 3) float64 [m]."""
        shift: FloatArray = self._amplitude_m * np.sin(self._frequency * time_s + self._phase).sum(axis=0)
        return shift


class _Body:
    """Another rigid body in the volume, four markers, drifting in front of the performer and turning slowly."""

    def __init__(self, number: int, random: np.random.Generator) -> None:
        self._number = number
        side = -1.0 if number % 2 else 1.0
        self._centre_m = np.array(
            [side * random.uniform(0.35, 0.5), random.uniform(0.9, 1.3), random.uniform(-0.6, 0.0)]
        )
        self._markers_m = random.uniform(-0.05, 0.05, (4, 3))
        self._markers_m -= self._markers_m.mean(axis=0)
        self._frequency = 2.0 * np.pi * random.uniform(0.05, 0.4, 3)
        self._phase = random.uniform(0.0, 2.0 * np.pi, 3)
        self._spin_radps = random.uniform(-0.8, 0.8)
        self._reported = self._pose(0.0)

    def _pose(self, time_s: float) -> tuple[FloatArray, float]:
        position = self._centre_m + 0.06 * np.sin(self._frequency * time_s + self._phase)
        return position, self._spin_radps * time_s

    def markers_m(self, time_s: float) -> FloatArray:
        """(4, 3) float64 [m], world."""
        position, angle = self._pose(time_s)
        c, s = np.cos(angle), np.sin(angle)
        world: FloatArray = self._markers_m @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]) + position
        return world

    def record(self, time_s: float, seen: BoolArray) -> RigidBody:
        """As the device reports it: tracked while three of its markers are seen, else the last pose held."""
        tracked = bool(seen.sum() >= 3)
        if tracked:
            self._reported = self._pose(time_s)
        position, angle = self._reported
        quaternion = np.array([np.cos(angle / 2.0), 0.0, np.sin(angle / 2.0), 0.0])
        return RigidBody(self._number + 1, f"body{self._number + 1}", position, quaternion, tracked, 0.0001)
