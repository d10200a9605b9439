"""Figures of tracked angles against true ones, per joint angle and per kind of joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from core.frames import FloatArray
from core.hand.skeleton import DIGIT_DOF_NAMES

SIGMAS = 2.0

KINDS = {
    "MCP flexion": [5, 9, 13, 17],
    "MCP abduction": [4, 8, 12, 16],
    "PIP flexion": [6, 10, 14, 18],
    "DIP flexion": [7, 11, 15, 19],
    "thumb CMC flexion": [0],
    "thumb CMC abduction": [1],
    "thumb MCP flexion": [2],
    "thumb IP flexion": [3],
}
"""Digit angles (core.hand.skeleton.DIGIT_DOF_NAMES) by kind."""


@dataclass(frozen=True)
class Tracked:
    """One stretch. tracked, true, std, std_fixed: (n, 20) float64 [rad]; std_fixed is NaN where it is not said."""

    tracked: FloatArray
    true: FloatArray
    std: FloatArray
    std_fixed: FloatArray


@dataclass(frozen=True)
class Figures:
    """Of some angles in some recordings, in degrees.

    bias: mean of tracked minus true; most_bias: the largest of one angle in one recording, by size; rmse; rmse_centred:
    with the mean error of each angle of each recording taken off; r, slope: of tracked over true, the mean of them;
    within_2, within_2_fixed: share of errors within two standard deviations, as stated for the frame, and with what the
    calibration adds (NaN where that is not said).
    """

    frames: int
    bias: float
    most_bias: float
    rmse: float
    rmse_centred: float
    r: float
    slope: float
    within_2: float
    within_2_fixed: float


def figures(runs: Sequence[Tracked], angles: Sequence[int]) -> Figures:
    """Over all runs and these of the 20 angles; every run counts alike, whatever its length."""
    rows = np.array([_row(run, angle) for run in runs for angle in angles if len(run.true)])
    if not len(rows):
        return Figures(0, *(8 * [float("nan")]))
    bias, square, variance, r, slope, within, fixed = rows.T
    return Figures(
        sum(len(run.true) for run in runs),
        float(np.degrees(bias.mean())),
        float(np.degrees(bias[np.argmax(np.abs(bias))])),
        float(np.degrees(np.sqrt(square.mean()))),
        float(np.degrees(np.sqrt(variance.mean()))),
        float(r.mean()),
        float(slope.mean()),
        float(within.mean()),
        float(fixed.mean()),
    )


def by_joint(runs: Sequence[Tracked]) -> dict[str, dict[str, float]]:
    """Of each of the 20 angles, by name."""
    return {name: asdict(figures(runs, [angle])) for angle, name in enumerate(DIGIT_DOF_NAMES)}


def by_kind(runs: Sequence[Tracked]) -> dict[str, dict[str, float]]:
    """Of each kind of joint, and of all."""
    found = {kind: asdict(figures(runs, angles)) for kind, angles in KINDS.items()}
    return found | {"all": asdict(figures(runs, range(len(DIGIT_DOF_NAMES))))}


def _row(run: Tracked, angle: int) -> tuple[float, ...]:
    tracked, true = run.tracked[:, angle], run.true[:, angle]
    error, size = tracked - true, np.abs(tracked - true)
    r, slope = correlated(tracked, true)
    std, both = run.std[:, angle], np.hypot(run.std[:, angle], run.std_fixed[:, angle])
    fixed = float(np.mean(size < SIGMAS * both)) if np.isfinite(both).all() else float("nan")
    return (
        float(error.mean()), float(np.mean(error**2)), float(error.var()), r, slope,
        float(np.mean(size < SIGMAS * std)), fixed,
    )  # fmt: skip


def correlated(tracked: FloatArray, true: FloatArray) -> tuple[float, float]:
    """Pearson's r, and the slope of the line of tracked over true; NaN where either stands still."""
    t, p = true - true.mean(), tracked - tracked.mean()
    if not t.any() or not p.any():
        return float("nan"), float("nan")
    return float(t @ p / np.sqrt((t @ t) * (p @ p))), float(t @ p / (t @ t))
