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
from core.calibration.neutral import NeutralHand
from core.calibration.neutral_trial import LEAST_FRAMES, held_hand, neutral_of
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
    """One recording solved. all: every frame, of a frame that is not tracked NaN. trial: of the frames in which the
    hand was held flat, as neutral_trial makes it. counted: as `all`, angles counted from the trial; all NaN where there
    is none. lost: share of the frames after it.
    """

    all: Tracked
    trial: NeutralHand | None
    counted: Tracked
    lost: float
    rate_hz: float

    @property
    def moving(self) -> Tracked:
        """The tracked frames after the hand was held flat."""
        return kept(self.all, np.arange(len(self.all.true))[moving_rows(self.rate_hz)])

    @property
    def neutral(self) -> Tracked:
        """The same frames, their angles counted from the trial."""
        return kept(self.counted, np.arange(len(self.counted.true))[moving_rows(self.rate_hz)])


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
    solved = solve(frames, profile, labels=names(profile.layout))
    run = collected(solved, profile, known.angles_rad)
    lost: BoolArray = np.isnan(run.tracked[:, 0])
    trial = neutral_trial(solved, profile, known.angles_rad, setting.rate_hz)
    if trial is None:
        nothing = np.full_like(run.true, np.nan)
        counted = Tracked(nothing, run.true, nothing, nothing)
    else:
        counted = collected(solved, profile, known.angles_rad, trial)
    return Solved(run, trial, counted, float(lost[moving_rows(setting.rate_hz)].mean()), setting.rate_hz)


def neutral_trial(
    solved: Sequence[TrackedFrame], profile: Profile, true_rad: FloatArray, rate_hz: float
) -> NeutralHand | None:
    """What `phalanx calibrate neutral` makes of the frames in which the hand was held flat, its true angles (n, 20)
    [rad] given; also where skin that slides makes the hand seem to move by more than that command takes. None where it
    is tracked in too few."""
    rows = np.arange(len(solved))[held_rows(rate_hz)]
    rows = np.array([row for row in rows if solved[row].hands[0].state is HandState.TRACKED], dtype=np.int64)
    if len(rows) < LEAST_FRAMES:
        return None
    held = held_hand([solved[row].hands[0] for row in rows], rows / rate_hz, profile)
    times = (rows[0] / rate_hz, rows[-1] / rate_hz)
    return neutral_of({SIDE: held}, {SIDE: true_rad[rows].mean(axis=0)}, None, "made", *times, "").hands[SIDE]


def collected(
    frames: Sequence[TrackedFrame], profile: Profile, true_rad: FloatArray, trial: NeutralHand | None = None
) -> Tracked:
    """The hand's angles in every frame, NaN where it is not tracked, beside true ones (n, 20) [rad]. trial: what they
    are counted from."""
    tracked, std, fixed = (np.full_like(true_rad, np.nan) for _ in range(3))
    rows = [i for i, frame in enumerate(frames) if frame.hands[0].state is HandState.TRACKED]
    hands = [frames[i].hands[0] for i in rows]
    if rows:
        tracked[rows] = np.array([hand.theta_rad for hand in hands])[:, N_ROOT_DOFS:]
        std[rows], fixed[rows] = stated(hands), stated_fixed(profile, hands, trial)
    if trial is not None:
        tracked, std = tracked - trial.zero_rad, np.hypot(std, trial.std_rad)
    return Tracked(tracked, true_rad, std, fixed)
