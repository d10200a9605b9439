"""What Phalanx makes of a subject: by the layout alone, and calibrated; each as it is, and after a neutral trial."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.angle_bench.certainty import stated, stated_fixed
from app.angle_bench.figures import Tracked
from app.angle_bench.motion import held_rows, moving_rows
from app.angle_bench.subjects import SIDE, Setting, Subject, Worn, names, seen
from core.calibration.hand import calibrate_hand
from core.frames import BoolArray, FloatArray, HandState, IntArray, TrackedFrame
from core.hand.skeleton import N_ROOT_DOFS
from core.markers.layout import MarkerLayout
from core.profile import Profile
from core.takes.reprocess import solve

WAYS = ("layout alone", "layout, neutral", "calibrated", "calibrated, neutral")
TRUE_HAND = "true hand"
"""As if calibrated without an error; of people only. What it is off, the posture prior and the noise do."""


@dataclass(frozen=True)
class Solved:
    """One recording solved. all: every frame, of a frame that is not tracked NaN. neutral_rad: (20,) float64 [rad],
    mean of tracked less true angles while the hand was held flat. lost: share of the frames after it."""

    all: Tracked
    neutral_rad: FloatArray
    lost: float
    rate_hz: float

    @property
    def moving(self) -> Tracked:
        """The tracked frames after the hand was held flat."""
        return kept(self.all, np.arange(len(self.all.true))[moving_rows(self.rate_hz)])

    @property
    def neutral(self) -> Tracked:
        """The same, less what the tracked angles were off while the hand was held flat."""
        return self.moving.less(self.neutral_rad)


def kept(run: Tracked, rows: IntArray) -> Tracked:
    """These rows, as far as they were tracked."""
    rows = rows[~np.isnan(run.tracked[rows, 0])]
    return Tracked(run.tracked[rows], run.true[rows], run.std[rows], run.std_fixed[rows])


def generic(layout: MarkerLayout) -> Profile:
    """The layout alone: a hand of the template's proportions, whose size is found from the motion."""
    return Profile("", layout, (SIDE,))


def calibrated(subject: Subject, worn: Worn, layout: MarkerLayout, setting: Setting, seed: int) -> Profile:
    """As `phalanx calibrate hand` makes it, from the subject's other stretch, its points named. Raises PhalanxError."""
    frames = seen(worn.moved(subject.calibration.motion), layout, setting, seed)
    return calibrate_hand(frames, generic(layout), labels=names(layout)).profile


def measured(subject: Subject, worn: Worn, profile: Profile, setting: Setting, seed: int) -> Solved:
    """The subject's measured stretch, solved with a profile, its points named."""
    known = subject.measured
    frames = seen(worn.moved(known.motion), profile.layout, setting, seed)
    run = collected(solve(frames, profile, labels=names(profile.layout)), profile, known.angles_rad)
    lost: BoolArray = np.isnan(run.tracked[:, 0])
    held = kept(run, np.arange(len(run.true))[held_rows(setting.rate_hz)])
    neutral = (held.tracked - held.true).mean(axis=0) if len(held.true) else np.full(run.true.shape[1], np.nan)
    return Solved(run, neutral, float(lost[moving_rows(setting.rate_hz)].mean()), setting.rate_hz)


def collected(frames: Sequence[TrackedFrame], profile: Profile, true_rad: FloatArray) -> Tracked:
    """The hand's angles in every frame, NaN where it is not tracked, beside true ones (n, 20) [rad]."""
    tracked, std, fixed = (np.full_like(true_rad, np.nan) for _ in range(3))
    rows = [i for i, frame in enumerate(frames) if frame.hands[0].state is HandState.TRACKED]
    hands = [frames[i].hands[0] for i in rows]
    if rows:
        tracked[rows] = np.array([hand.theta_rad for hand in hands])[:, N_ROOT_DOFS:]
        std[rows], fixed[rows] = stated(hands), stated_fixed(profile, hands)
    return Tracked(tracked, true_rad, std, fixed)
