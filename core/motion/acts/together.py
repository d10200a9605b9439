"""The two hands meet: palms or fingertips together, fingers interlaced, one hand on the other, a clap."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from core.frames import FloatArray
from core.motion.acts.free import apart
from core.motion.capsules import cross_touches
from core.motion.stage import LEFT, RIGHT, OverTime, Stage, wrist_at

_FURTHEST_M = 0.16
_CLEAR_M = 0.07  # from here they come together, and to here they part
Meeting = tuple[FloatArray, FloatArray, str, str, FloatArray, float]
"""Left and right wrist (6,) each in right-handed terms, the left and the right hand's posture, the direction (3,) in
the world in which the right hand comes, and how deep the flesh gives [m]."""


def _palms(random: np.random.Generator) -> Meeting:
    wrist = wrist_at(_place(random), yaw=random.uniform(0.0, 0.3), pitch=random.uniform(0.5, 1.1), roll=-np.pi / 2.0)
    return wrist, wrist, "flat", "flat", np.array([-1.0, 0.0, 0.0]), 0.001


def _steeple(random: np.random.Generator) -> Meeting:
    wrist = wrist_at(_place(random), yaw=random.uniform(0.5, 0.7), pitch=random.uniform(0.3, 0.9), roll=-np.pi / 2.0)
    return wrist, wrist, "relaxed", "relaxed", np.array([-1.0, 0.0, 0.0]), 0.002


def _interlaced(random: np.random.Generator) -> Meeting:
    left = wrist_at(_place(random), yaw=random.uniform(0.65, 0.8), pitch=random.uniform(0.2, 0.5), roll=-np.pi / 2.0)
    right = left.copy()
    right[1] += random.uniform(0.014, 0.017)  # half the distance of two spread fingers
    return left, right, "spread", "spread", np.array([-1.0, 0.0, 0.0]), 0.003


def _on_top(random: np.random.Generator) -> Meeting:
    """One hand lies on the back of the other."""
    place = _place(random) + (random.uniform(0.0, 0.03), 0.0, 0.0)
    under = wrist_at(place, yaw=random.uniform(0.4, 0.6), roll=random.uniform(-0.15, 0.1))
    over = wrist_at(place + (0.0, 0.0, random.uniform(-0.02, 0.02)), yaw=random.uniform(0.4, 0.7))
    if random.random() < 0.5:
        return under, over, "relaxed", "relaxed", np.array([0.0, -1.0, 0.0]), 0.001
    return over, under, "relaxed", "relaxed", np.array([0.0, 1.0, 0.0]), 0.001


def _over_fist(random: np.random.Generator) -> Meeting:
    """A fist in the palm of the other hand."""
    place = _place(random)
    fist = wrist_at(place + (0.04, 0.0, 0.0), yaw=random.uniform(0.8, 1.0), roll=random.uniform(-0.7, -0.3))
    palm = wrist_at(place + (0.0, 0.0, 0.02), yaw=0.2, pitch=random.uniform(0.4, 0.7), roll=-np.pi / 2.0)
    if random.random() < 0.5:
        return fist, palm, "fist", "cup", np.array([-1.0, 0.0, 0.0]), 0.001
    return palm, fist, "cup", "fist", np.array([-1.0, 0.0, 0.0]), 0.001


def _fingertips(random: np.random.Generator) -> Meeting:
    wrist = wrist_at(_place(random), yaw=random.uniform(0.9, 1.1), pitch=0.15, roll=random.uniform(-0.6, -0.2))
    return wrist, wrist, "point", "point", np.array([-1.0, 0.0, 0.0]), 0.002


MEETINGS: tuple[Callable[[np.random.Generator], Meeting], ...] = (
    _palms, _steeple, _interlaced, _on_top, _over_fist, _fingertips,
)  # fmt: skip


def meet(stage: Stage, begin_s: float, until_s: float) -> float:
    """The hands meet in one of MEETINGS, stay, perhaps move as one or part and meet again, and part."""
    random = stage.random
    meeting = MEETINGS[int(random.integers(len(MEETINGS)))](random)
    left, right, left_name, right_name, direction, _ = meeting
    angles = stage.posture(left_name, LEFT), stage.posture(right_name, RIGHT)
    away_m = _distance(stage, meeting, angles)
    if away_m is None:
        return begin_s
    shares = _shares(direction)
    touching = [_moved((left, right)[hand], -shares[hand] * away_m) for hand in (LEFT, RIGHT)]
    clear = [_moved(touching[hand], -shares[hand] * _CLEAR_M) for hand in (LEFT, RIGHT)]
    far = [_moved(clear[hand], -shares[hand] * _CLEAR_M) for hand in (LEFT, RIGHT)]

    time_s = stage.both(begin_s, far)
    for hand in (LEFT, RIGHT):
        time_s = max(time_s, stage.take(hand, begin_s, angles[hand]))
    time_s = stage.both(time_s - 0.1, clear)
    calm_from_s = time_s
    for _ in range(int(random.choice([1, 1, 1, 3]))):
        time_s = stage.both(time_s, touching, random.uniform(0.25, 0.5) * stage.person.tempo)
        time_s += random.uniform(0.3, 1.6)
        if random.random() < 0.5:
            time_s = _as_one(stage, time_s) + random.uniform(0.1, 0.5)
        now = [stage.scores[hand].now[:6] for hand in (LEFT, RIGHT)]
        back = [_moved(now[hand], -shares[hand] * _CLEAR_M) for hand in (LEFT, RIGHT)]
        time_s = stage.both(time_s, back, random.uniform(0.3, 0.5) * stage.person.tempo)
        touching = [_moved(back[hand], shares[hand] * _CLEAR_M) for hand in (LEFT, RIGHT)]
    for hand in (LEFT, RIGHT):
        stage.scores[hand].calm(calm_from_s, time_s)
    time_s = stage.both(time_s - 0.1, [_moved(back[hand], -shares[hand] * _CLEAR_M) for hand in (LEFT, RIGHT)])
    time_s = apart(stage, time_s)
    if time_s > until_s:
        raise OverTime
    return time_s


def _as_one(stage: Stage, time_s: float) -> float:
    """Both hands move together, without a change between them."""
    shift = stage.random.uniform(-0.05, 0.05, 3)
    duration_s = stage.random.uniform(0.5, 1.0) * stage.person.tempo
    targets = []
    for hand in (LEFT, RIGHT):
        target = stage.scores[hand].now[:6].copy()
        target[:3] += shift * ((-1.0, 1.0, 1.0) if hand == LEFT else (1.0, 1.0, 1.0))
        targets.append(target)
    return stage.both(time_s, targets, duration_s)


def _distance(stage: Stage, meeting: Meeting, angles: tuple[FloatArray, FloatArray]) -> float | None:
    """How far apart, along their direction, the hands touch [m]: no nearer place on the way in is deeper than the flesh
    gives. None where they never come free."""
    left, right, _, _, direction, depth_m = meeting
    distances = np.linspace(-0.06, _FURTHEST_M, 111)
    posed = [stage.posed(hand, (left, right)[hand], angles[hand]) for hand in (LEFT, RIGHT)]
    rows = np.zeros(len(distances), dtype=np.int64)
    right_posed = posed[RIGHT][rows].moved(-distances[:, None] * direction)
    gaps = cross_touches(right_posed, posed[LEFT][rows], stage.flesh.radii_m).gap_m.min(axis=1)
    deep = np.flatnonzero(gaps < -depth_m)
    if len(deep) == 0:
        return float(distances[0])
    return float(distances[deep[-1] + 1]) if deep[-1] + 1 < len(distances) else None


def _shares(direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of a way in the world, the left hand's part in its own terms and the right hand's: half each."""
    half = direction / 2.0
    return -half * (-1.0, 1.0, 1.0), half


def _moved(wrist: FloatArray, shift_m: FloatArray) -> FloatArray:
    return np.concatenate([wrist[:3] + shift_m, wrist[3:]])


def _place(random: np.random.Generator) -> FloatArray:
    """(3,) [m]: before the breastbone; x counts from the middle for both hands."""
    return np.array([0.0, random.uniform(1.0, 1.12), random.uniform(-0.34, -0.26)])
