"""The mapping's own error: what no tracking could do better, for our axes are not those of the other hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.angle_bench.figures import Tracked, by_joint, by_kind
from app.angle_bench.mapping import mapped, zeros_rad
from app.angle_bench.motion import moving_rows
from app.angle_bench.subjects import WebXR
from core.hand.skeleton import DIGIT_DOF_NAMES


def own_error(subject: WebXR) -> dict[str, Any]:
    """The best angles of ours beside the hand's own, which are what is true, in the frames that are measured.

    off_mm: how far our model at its best is from the true centres. zeros_deg: ours at the hand's bind pose.
    """
    known, rows = subject.measured, moving_rows(subject.setting.rate_hz)
    best = mapped(subject.hand.skeleton, known.motion)
    unknown = np.full_like(known.angles_rad[rows], np.nan)
    beside = Tracked(best.angles_rad[rows], known.angles_rad[rows], unknown, unknown)
    off_m = best.off_m[rows]
    return {
        "off_mm": {"rms": float(1e3 * np.sqrt(np.mean(off_m**2))), "most": float(1e3 * off_m.max())},
        "zeros_deg": dict(zip(DIGIT_DOF_NAMES, np.degrees(zeros_rad(subject.hand.skeleton)).tolist(), strict=True)),
        "kinds": by_kind([beside]),
        "joints": by_joint([beside]),
    }
