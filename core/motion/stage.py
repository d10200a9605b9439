"""Where a performance is put together: both hands' scores, what they hold, and how this person takes each posture."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import FloatArray
from core.hand.mirror import mirror_transforms
from core.hand.model import template
from core.hand.poses import pose
from core.hand.skeleton import DIGITS, N_DOFS, N_ROOT_DOFS, Skeleton
from core.motion.capsules import Flesh, Posed, between, own_touches, prop_touches, pushed
from core.motion.library import LIBRARY, LibraryPose, Prop
from core.motion.person import Person
from core.motion.score import HandScore, min_jerk

LEFT, RIGHT = 0, 1
START_WRIST = np.array([0.17, 1.05, -0.30, 0.05, 0.15, -0.25])
"""Right wrist at the start: position [m] and rotation vector [rad]."""

_SMALL_RAD = 0.3
"""So small a change needs no thought of the way."""

_CLEAR_M = 0.005
"""Flesh no deeper in flesh is a touch."""

_WAY_SAMPLES = 15
_ONWARD = 0.85  # the next part of a way begins when so much of the one before is done

_BONES = {"proximal": 0, "metacarpal": 0, "middle": 1, "distal": 2, "tip": 2, "pad": 2}


@dataclass(frozen=True)
class Hold:
    """From begin_s on, prop number `prop` is at `transform` (4, 4) in the hand `holder` (0 left, 1 right), in that
    hand's right-handed terms; holder None: at rest in the world."""

    begin_s: float
    prop: int
    holder: int | None
    transform: FloatArray


@dataclass(frozen=True)
class Thing:
    """A prop of a performance. home: (4, 4), where it rests in the world. posture: how it is held, by name; wrist (6,):
    where that hand takes it, in its right-handed terms; back_m (3,): where the hand comes from and goes to, in its own
    frame against the grasp."""

    name: str
    prop: Prop
    home: FloatArray
    posture: str
    wrist: FloatArray
    back_m: FloatArray


Act = Callable[["Stage", float, float], float]
"""Plays from a time [s], not beyond another, and returns when it has ended; raises OverTime where it cannot."""


class OverTime(Exception):  # noqa: N818
    """An act needs more time than is left."""


class Stage:
    """skeleton: the right hand in its true size; size: over the template's.

    things: what lies about. holds: who has them, in the order of time.
    """

    def __init__(self, person: Person, random: np.random.Generator, skeleton: Skeleton, size: float) -> None:
        self.person, self.random, self.size = person, random, size
        self.flesh = Flesh(skeleton, size)
        self.scores = tuple(
            HandScore(person, random, np.concatenate([START_WRIST, person.posture(pose("relaxed"), hand)]))
            for hand in (LEFT, RIGHT)
        )
        self.things: list[Thing] = []
        self.holds: list[Hold] = []
        self._taken: dict[tuple[str, int], FloatArray] = {}

    def posture(self, name: str, hand: int) -> FloatArray:
        """(20,) [rad]: this person's way to take a named posture, touching what it touches."""
        key = (name, hand)
        if key not in self._taken:
            known = LIBRARY.get(name)
            angles = self.person.posture(pose(name) if known is None else known.angles_rad, hand)
            if known is not None and known.contacts:
                angles = self._touching(known, angles)
            self._taken[key] = angles
        return self._taken[key]

    def again(self, name: str, hand: int) -> FloatArray:
        """(20,) [rad]: the same, a little different every time; where digits touch, they touch exactly."""
        angles = self.posture(name, hand)
        if name in LIBRARY and LIBRARY[name].contacts:
            return angles
        varied = angles + self.random.normal(0.0, self.person.sloppiness_rad, 20) * _loose()
        return self.person.within(varied)

    def take(
        self, hand: int, time_s: float, target: FloatArray, duration_s: float | None = None,
        lag_s: FloatArray | None = None,
    ) -> float:  # fmt: skip
        """The digits of a hand go to (20,) [rad], around each other: at once where the way is clear, else the thumb
        moves out first and in last, or the hand opens in between. Returns the end [s]."""
        score = self.scores[hand]
        now = score.now[N_ROOT_DOFS:]
        change = target - now
        duration_s = score.usual_s(change) if duration_s is None else duration_s
        lag_s = score.usual_lags(change) if lag_s is None else lag_s
        if np.abs(change).max() < _SMALL_RAD or self._way_m(now, target, lag_s / duration_s) > -_CLEAR_M:
            return score.digits(time_s, target, duration_s, lag_s)
        wide = self.posture("rest_open", hand)
        out, over = now.copy(), target.copy()
        out[:4] = over[:4] = wide[:4]
        ways = ([target], [over, target], [out, target], [out, over, target], [0.4 * target + 0.6 * wide, target],
                [wide, target])  # fmt: skip
        depths = [
            min(self._way_m(a, b, np.zeros(5)) for a, b in zip([now, *way[:-1]], way, strict=True)) for way in ways
        ]
        clear = [way for way, depth in zip(ways, depths, strict=True) if depth > -_CLEAR_M]
        end_s = time_s
        for stop in clear[0] if clear else ways[int(np.argmax(depths))]:
            end_s = score.digits(time_s, stop, None, np.zeros(5))
            time_s += _ONWARD * (end_s - time_s)
        return end_s

    def both(self, time_s: float, targets: Sequence[FloatArray], duration_s: float | None = None) -> float:
        """Both wrists to their targets (6,) in one time, as if they were one body. Returns when they arrive [s]."""
        if duration_s is None:
            ways = [
                float(np.linalg.norm(target[:3] - score.now[:3]))
                for target, score in zip(targets, self.scores, strict=True)
            ]
            duration_s = self.person.tempo * (0.45 + 1.1 * max(ways)) * self.random.uniform(0.9, 1.2)
        shortest = [score.shortest_s(target) for target, score in zip(targets, self.scores, strict=True)]
        duration_s = max(duration_s, *shortest)
        for target, score in zip(targets, self.scores, strict=True):
            score.wrist(time_s, target, duration_s, exact=True)
        return time_s + duration_s

    @contextmanager
    def attempt(self) -> Iterator[None]:
        """What an act that ends in OverTime has added is taken back."""
        before = [score.mark() for score in self.scores]
        n_holds = len(self.holds)
        try:
            yield
        except OverTime:
            for score, mark in zip(self.scores, before, strict=True):
                score.back_to(mark)
            del self.holds[n_holds:]
            raise

    def posed(self, hand: int, wrist: FloatArray, angles_rad: FloatArray) -> Posed:
        """One hand as it is in the world."""
        posed = self.flesh.posed(np.concatenate([wrist, angles_rad])[None])
        return posed.mirrored() if hand == LEFT else posed

    def _way_m(self, begin: FloatArray, end: FloatArray, lags: FloatArray) -> float:
        """Smallest gap between the digits of a hand on its way between postures (20,) [m]. lags: (5,) in durations."""
        done = np.linspace(0.0, 1.0 + lags.max(), _WAY_SAMPLES)[:, None] - np.repeat(lags, 4)
        theta = np.zeros((_WAY_SAMPLES, N_DOFS))
        theta[:, N_ROOT_DOFS:] = begin + (end - begin) * min_jerk(np.clip(done, 0.0, 1.0))
        return float(own_touches(self.flesh.posed(theta), self.flesh.radii_m).gap_m.min())

    def _touching(self, known: LibraryPose, angles_rad: FloatArray) -> FloatArray:
        """Angles changed as little as may be so that what touches in the library's pose touches in this person's, by
        damped least squares on the gaps."""
        model = Flesh(template().skeleton, 1.0)
        wanted = self.size * self._gaps(model, known, known.prop, known.angles_rad)[0]
        prop = in_proportion(known.prop, self.size) if known.prop is not None else None
        for _ in range(12):
            gaps, slopes = self._gaps(self.flesh, known, prop, angles_rad)
            missed = wanted - gaps
            if np.abs(missed).max(initial=0.0) < 2e-4:
                break
            step = slopes.T @ np.linalg.solve(slopes @ slopes.T + 1e-5 * np.eye(len(gaps)), missed)
            angles_rad = self.person.within(angles_rad + np.clip(step, -0.2, 0.2))
        return angles_rad

    def _gaps(
        self, flesh: Flesh, known: LibraryPose, prop: Prop | None, angles_rad: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(k,) [m] of the pose's contacts, and their slopes (k, 20) [m/rad]."""
        posed = flesh.posed(np.concatenate([np.zeros(N_ROOT_DOFS), angles_rad])[None])
        gaps, slopes = [], []
        for places in known.contacts:
            bones = [_bone(place) for place in places]
            digits = [bone for bone in bones if bone is not None]
            if len(digits) == 2:
                a, b = digits
                touch = between(
                    posed.starts_m[:, a], posed.ends_m[:, a], flesh.radii_m[a],
                    posed.starts_m[:, b], posed.ends_m[:, b], flesh.radii_m[b],
                )  # fmt: skip
                gaps.append(touch.gap_m[0])
                slopes.append(
                    _slope(posed, a, touch.first_m, touch.normal) - _slope(posed, b, touch.second_m, touch.normal)
                )
            elif len(digits) == 1 and "prop" in places and prop is not None:
                touch = prop_touches(posed, flesh.radii_m, prop, prop.transform_hand[None])
                gaps.append(touch.gap_m[0, digits[0]])
                slopes.append(_slope(posed, digits[0], touch.first_m[:, digits[0]], touch.normal[:, digits[0]]))
        return np.array(gaps), np.array(slopes).reshape(-1, 20)


def in_proportion(prop: Prop, size: float) -> Prop:
    """A prop of the library for a hand of another size."""
    transform = prop.transform_hand.copy()
    transform[:3, 3] *= size
    return Prop(prop.shape, tuple(length * size for length in prop.size_m), transform)


def wrist_at(position_m: FloatArray, yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0) -> FloatArray:
    """(6,): a right wrist at (3,) [m], turned from palm down, fingers forward: rolled (negative: palm to the left),
    pitched (positive: fingers up), then yawed (positive: fingers to the left) [rad]."""
    turn = Rotation.from_euler("YXZ", [yaw, pitch, roll])
    return np.concatenate([position_m, turn.as_rotvec()])


def transform_of(wrist: FloatArray) -> FloatArray:
    """(4, 4) of a wrist's (6,) position and rotation vector."""
    transform = np.eye(4)
    transform[:3, :3] = Rotation.from_rotvec(wrist[3:]).as_matrix()
    transform[:3, 3] = wrist[:3]
    return transform


def wrist_of(transform: FloatArray) -> FloatArray:
    """(6,): the reverse of transform_of."""
    return np.concatenate([transform[:3, 3], Rotation.from_matrix(transform[:3, :3]).as_rotvec()])


def in_terms_of(hand: int, transform_world: FloatArray) -> FloatArray:
    """(4, 4) of the world in the right-handed terms of a hand, and back."""
    return mirror_transforms(transform_world) if hand == LEFT else transform_world


def names_of(*activities: str) -> tuple[str, ...]:
    """Names of the library's poses of these activities; without any, all of them but the extreme ones. A pose in which
    the capsules stand deep in each other, as where fingers cross, is left out: nothing could lead into it."""
    return tuple(
        name
        for name, known in LIBRARY.items()
        if (known.activity in activities if activities else known.activity != "extreme") and name not in _crossed()
    )


@cache
def _crossed() -> frozenset[str]:
    flesh = Flesh(template().skeleton, 1.0)
    theta = np.zeros((len(LIBRARY), N_DOFS))
    theta[:, N_ROOT_DOFS:] = [known.angles_rad for known in LIBRARY.values()]
    gaps = own_touches(flesh.posed(theta), flesh.radii_m).gap_m.min(axis=1)
    return frozenset(name for name, gap in zip(LIBRARY, gaps, strict=True) if gap < -_CLEAR_M)


def _bone(place: str) -> int | None:
    """Number of the capsule of a place such as "index pad"; None for one that is of no digit."""
    words = place.split()
    if words[0] not in DIGITS or len(words) < 2:
        return None
    return 3 * DIGITS.index(words[0]) + _BONES.get(words[1], 2)


def _slope(posed: Posed, bone: int, point_m: FloatArray, normal: FloatArray) -> FloatArray:
    return pushed(posed, np.zeros(1, dtype=np.int64), np.array([bone]), point_m, normal)[0, 3:]


def _loose() -> FloatArray:
    """(20,): abduction varies less than flexion."""
    loose = np.ones(20)
    loose[4::4] = 0.5
    return loose
