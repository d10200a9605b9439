"""Performances as a studio's cameras would send them, with what every point truly is.

Who performs has a hand of the human range and markers a little beside where the layout says. What the engine is told of
them is a calibrated profile, its markers again a little off, or the layout alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from app.people import shape_of
from app.tracking_bench.gaps import TABLE_3, hidden_as_in
from app.tracking_bench.score import Truth, wanted_of
from app.tracking_bench.sight import in_the_way, sightings, studio
from core.frames import BoolArray, FloatArray
from core.markers.layout import load_layout
from core.motion.performer import PERIOD_S, Performer
from core.motion.stream import GHOST, LabelledFrame, MarkerStream
from core.profile import Profile, load_profile

RATE_HZ = 120.0
NOISE_M, SKIN_M = 0.00005, 0.0006
"""White noise per axis; RMS of skin and glove against the bone. Real recordings have 0.005 to 0.1 and 0.5 to 0.8 mm."""

PLACED_M = 0.0015
"""How far a marker is put beside its place on the glove, one standard deviation per axis."""

CALIBRATED_M = 0.0006
"""How far it is from where a calibration finds it: 1 mm over the three axes."""

DECOY_M = 0.004


@dataclass(frozen=True)
class Kind:
    """A kind of sequence. activity: of the performer. points: markers on what is held, that the profile does not know,
    as shares of its length along its axis. ring: the thing has a ring, as controllers have. ghosts: mean per frame."""

    activity: str
    ghosts: float
    points: tuple[float, ...] = ()
    ring: bool = False


KINDS = {
    "single hand": Kind("free", 0.004),
    "hand-hand": Kind("hands", 4.3),
    "hand-pen": Kind("pen", 1.0, (-0.5, 0.45)),
    "hand-controller": Kind("controller", 1.8, ring=True),
}
"""Of Table 5. Ghosts per frame follow the ghost ratios of Table 4: 0.01, 10.63, 7.55 and 4.50 % of all points; with the
pen, two of them are its own markers, at the tip and near the other end. Everywhere both hands wear 19 markers: the
181,720 labels of Han's single hand are 38 in each of its 4,785 frames."""


def person(seed: int, layout: str = "han19", size: float | None = None) -> Profile:
    """Somebody, and where their markers truly are. size: of the hand to the template's; None: of an adult, drawn. Seeds
    below 5000: others belong to training."""
    random = np.random.default_rng([seed, 1])
    shape = shape_of(random, size)
    worn = load_layout(layout)
    placed = worn.positions_m + random.normal(0.0, PLACED_M, worn.positions_m.shape)
    return Profile(f"performer {seed}", replace(worn, positions_m=placed), shape=shape, scale=1.0)


def as_calibrated(true: Profile, seed: int) -> Profile:
    """The profile that a good calibration makes of a performer."""
    random = np.random.default_rng([seed, 2])
    found = true.layout.positions_m + random.normal(0.0, CALIBRATED_M, true.layout.positions_m.shape)
    return replace(true, layout=replace(true.layout, positions_m=found))


def as_generic(true: Profile) -> Profile:
    """What is known of somebody who was not calibrated: which glove it is."""
    return load_profile(true.layout.name)


@dataclass(frozen=True)
class Curtained:
    """Trajectories (f, n, 3) [m] of which some are hidden (f, n), as a source of a MarkerStream."""

    labels: tuple[str, ...]
    points_m: FloatArray
    hidden: BoolArray

    def positions(self, rate_hz: float) -> Iterator[tuple[float, FloatArray]]:
        """Every sample once, NaN where hidden. rate_hz: the samples'."""
        for f, (points, hidden) in enumerate(zip(self.points_m, self.hidden, strict=True)):
            yield f / rate_hz, np.where(hidden[:, None], np.nan, points)


@dataclass(frozen=True)
class Performed:
    """truth: with the true profile. hidden: (f, m) bool, markers of the hands. decoy: (f,) bool, frames in which a
    point that is no marker's lies within DECOY_M of where a hidden one is: nobody could tell it by its place."""

    truth: Truth
    hidden: BoolArray
    decoy: BoolArray


def performed(
    kind: str, seed: int, seconds: float, cameras: int | None = None, size: float | None = None,
    rate_hz: float = RATE_HZ,
) -> Performed:  # fmt: skip
    """A sequence of a kind.

    cameras: None for gaps as in Table 3; else a marker is hidden while fewer than two of so many see it. size: as of
    `person`. rate_hz: a multiple of RATE_HZ.
    """
    what, true = KINDS[kind], person(seed, size=size)
    performer = Performer(true, seed, what.activity)
    every = round(rate_hz / RATE_HZ)
    n = round(min(seconds, PERIOD_S) * RATE_HZ) * every
    times_s = np.arange(n) / rate_hz
    points = np.stack([row for _, row in islice(performer.positions(rate_hz), n)])
    m = points.shape[1]
    points = np.concatenate([points, _upon_things(performer, what, times_s)], axis=1)
    way = in_the_way(performer, times_s[::every], what.ring)
    if cameras is None:
        counts = sightings(points[::every, :m], way, studio())
        hidden = hidden_as_in(TABLE_3[kind], counts, np.random.default_rng([seed, 3]))
        hidden = np.concatenate([hidden, np.zeros((len(hidden), points.shape[1] - m), dtype=np.bool_)], axis=1)
    else:
        hidden = sightings(points[::every], way, studio(cameras)) < 2
    begins = np.random.default_rng([seed, 5]).integers(0, every, hidden.shape[1])  # not all between the same frames
    hidden = np.stack(
        [np.roll(np.repeat(own, every), late) for own, late in zip(hidden.T, begins, strict=True)], axis=1
    )
    labels = performer.labels + tuple(f"thing{k}" for k in range(points.shape[1] - m))
    stream = MarkerStream(
        Curtained(labels, points, hidden), rate_hz, seed, ghosts=what.ghosts, noise_m=NOISE_M, skin_m=SKIN_M
    )
    sent = list(stream.labelled())
    wanted = wanted_of([one.truth for one in sent], len(true.sides), m // len(true.sides))
    decoy = [_decoy(one, points[f, :m][hidden[f, :m]], m) for f, one in enumerate(sent)]
    truth = Truth(f"{kind}, seed {seed}", (true,), [one.frame for one in sent], wanted)
    return Performed(truth, hidden[:, :m], np.array(decoy))


def _decoy(sent: LabelledFrame, hidden_m: FloatArray, markers: int) -> bool:
    """Whether a point of no marker is at a hidden marker's place (k, 3) [m]."""
    others = sent.frame.points_m[(sent.truth == GHOST) | (sent.truth >= markers)]
    return bool((np.linalg.norm(others[:, None] - hidden_m, axis=2) < DECOY_M).any())


def _upon_things(performer: Performer, kind: Kind, times_s: FloatArray) -> FloatArray:
    """(f, k, 3) [m], world: the markers on the things."""
    placed: list[FloatArray] = []
    for name, prop in performer.props.items() if kind.points else ():
        world = np.stack([performer.props_world(time_s)[name] for time_s in times_s])
        along = np.outer(np.asarray(kind.points), np.array([0.0, 0.0, prop.size_m[-1]]))
        placed.append(np.einsum("fab,kb->fka", world[:, :3, :3], along) + world[:, None, :3, 3])
    return np.concatenate([np.empty((len(times_s), 0, 3)), *placed], axis=1)
