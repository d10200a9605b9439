"""One digit's markers hidden in motions with known angles: whether filled angles are as sure as they say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from app.angle_bench.figures import SIGMAS, Tracked
from app.angle_bench.motion import moving_rows
from app.angle_bench.subjects import Setting, Subject, Worn, names, seen
from app.angle_bench.tracked import collected
from app.gap_angles import without
from core.calibration.neutral import NeutralHand
from core.frames import FloatArray, MarkerFrame
from core.gap_filling import filled
from core.hand.skeleton import DIGITS
from core.markers.layout import MarkerLayout
from core.profile import Profile
from core.takes.reprocess import solve

BETWEEN_S = 0.7
"""Between two gaps all markers are seen."""


@dataclass(frozen=True)
class Hidden:
    """The markers of a digit (0..4) are hidden in frames first..last."""

    digit: int
    first: int
    last: int


@dataclass(frozen=True)
class Errors:
    """(k,) float64 [rad] each: error, std and std_fixed of the hidden digits' angles in the frames of the gaps."""

    error: FloatArray
    std: FloatArray
    std_fixed: FloatArray


@dataclass(frozen=True)
class GapFigures:
    """In degrees. stated, true: root mean squares; within_2, within_2_fixed: shares as in app.angle_bench.figures."""

    values: int
    stated: float
    true: float
    within_2: float
    within_2_fixed: float


def gaps(n: int, duration_s: float, rate_hz: float, start: int) -> list[Hidden]:
    """One after the other while the hand moves, digit after digit from `start` on."""
    length, between = round(duration_s * rate_hz), round(BETWEEN_S * rate_hz)
    first = moving_rows(rate_hz).start + between
    found: list[Hidden] = []
    while first + length + between <= n:
        found.append(Hidden((start + len(found)) % len(DIGITS), first, first + length - 1))
        first += length + between
    return found


def errors(
    subject: Subject, worn: Worn, profile: Profile, setting: Setting, seed: int, duration_s: float,
    trial: NeutralHand | None,
) -> dict[str, Errors]:  # fmt: skip
    """As each of app.gap_angles.SHOWN. trial: what angles are counted from: what the calibration is off is
    not what a gap costs."""
    known, layout = subject.measured, profile.layout
    frames = seen(worn.moved(known.motion), layout, setting, seed)
    hidden = gaps(len(frames), duration_s, setting.rate_hz, seed)
    solved = solve(with_gaps(frames, layout, hidden), profile, labels=names(layout))
    shown = {"live": solved, "filled": list(filled(solved, profile))}
    return {name: within(collected(one, profile, known.angles_rad, trial), hidden) for name, one in shown.items()}


def with_gaps(frames: Sequence[MarkerFrame], layout: MarkerLayout, hidden: Sequence[Hidden]) -> list[MarkerFrame]:
    """The frames without the points of hidden digits."""
    digits, left = (layout.joints - 1) // 3, list(frames)  # the palm's is -1
    for gap in hidden:
        own = np.flatnonzero(digits == gap.digit)
        for i in range(gap.first, gap.last + 1):
            left[i] = without(left[i], own)
    return left


def within(run: Tracked, hidden: Sequence[Hidden]) -> Errors:
    """Of the hidden digits' four angles, in the frames of the gaps that are tracked."""
    parts = []
    for gap in hidden:
        at = np.ix_(np.arange(gap.first, gap.last + 1), np.arange(4 * gap.digit, 4 * gap.digit + 4))
        parts.append(np.stack([run.tracked[at] - run.true[at], run.std[at], run.std_fixed[at]]).reshape(3, -1))
    error, std, fixed = np.concatenate([np.empty((3, 0)), *parts], axis=1)
    tracked = ~np.isnan(error)
    return Errors(error[tracked], std[tracked], fixed[tracked])


def figures(parts: Sequence[Errors]) -> dict[str, float]:
    """Of all of them together."""
    columns = zip(*((part.error, part.std, part.std_fixed) for part in parts), strict=True)
    error, std, fixed = (np.concatenate(column) for column in columns)
    if not len(error):
        return asdict(GapFigures(0, *(4 * [float("nan")])))
    both = np.hypot(std, fixed)
    return asdict(
        GapFigures(
            len(error),
            float(np.degrees(np.sqrt(np.mean(std**2)))),
            float(np.degrees(np.sqrt(np.mean(error**2)))),
            float(np.mean(np.abs(error) < SIGMAS * std)),
            float(np.mean(np.abs(error) < SIGMAS * both)) if np.isfinite(both).all() else float("nan"),
        )
    )
