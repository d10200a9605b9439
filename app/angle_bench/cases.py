"""One subject in one layout, put on so far off: tracked in every way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from app.angle_bench import gaps, tracked
from app.angle_bench.figures import Tracked
from app.angle_bench.subjects import Person, Setting, Subject, WebXR
from core.markers.layout import load_layout

SUBJECTS = ("people", "webxr")
MOTIONS = ("own", "performed", "waves")


@dataclass(frozen=True)
class Case:
    """kind: of SUBJECTS. size: of a person's hand to the template's. folder: of the WebXR hand. gaps_s: durations of
    gaps that are tried as well, none where empty."""

    kind: str
    seed: int
    size: float
    motion: str
    folder: Path | None
    layout: str
    off_m: float
    setting: Setting
    gaps_s: tuple[float, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """runs, lost: by way (app.angle_bench.tracked: WAYS, TRUE_HAND of people). gaps: by duration [s], then
    app.gap_angles.SHOWN."""

    runs: dict[str, Tracked]
    lost: dict[str, float]
    gaps: dict[float, dict[str, gaps.Errors]] = field(default_factory=dict)


def subject_of(case: Case) -> Subject:
    """Who it is; the same one for the cases of one process."""
    return _subject(case.kind, case.seed, case.size, case.motion, case.folder, case.setting)


@lru_cache(maxsize=4)
def _subject(kind: str, seed: int, size: float, motion: str, folder: Path | None, setting: Setting) -> Subject:
    if kind == "webxr":
        assert folder is not None
        return WebXR(folder, seed, setting, waves=motion != "performed")
    return Person(seed, size, setting, waves=motion == "waves")


def outcome(case: Case, progress: Callable[[float, str], bool | None]) -> Outcome:
    """Tracks it by the layout alone and calibrated. Raises PhalanxError where there is too little to calibrate from."""
    subject, layout, setting = subject_of(case), load_layout(case.layout), case.setting
    put_on = [case.seed, 5, round(1e6 * case.off_m)]
    worn = subject.wear(layout, case.off_m, np.random.default_rng(put_on))
    alone = tracked.measured(subject, worn, tracked.generic(layout), setting, case.seed)
    progress(0.1, "")
    profile = tracked.calibrated(subject, worn, layout, setting, case.seed + 1)
    progress(0.8, "")
    after = tracked.measured(subject, worn, profile, setting, case.seed)
    ways = (alone.moving, alone.neutral, after.moving, after.neutral)
    runs = dict(zip(tracked.WAYS, ways, strict=True))
    lost = dict(zip(tracked.WAYS, (alone.lost, alone.lost, after.lost, after.lost), strict=True))
    true = subject.true(layout, case.off_m, np.random.default_rng(put_on))
    if true is not None:
        best = tracked.measured(subject, worn, true, setting, case.seed)
        # Nothing about it is unknown, so no calibration's deviation belongs to it.
        runs[tracked.TRUE_HAND] = replace(best.moving, std_fixed=np.full_like(best.moving.std, np.nan))
        lost[tracked.TRUE_HAND] = best.lost
    found = {
        duration: gaps.errors(subject, worn, profile, setting, case.seed, duration, after.trial)
        for duration in case.gaps_s
    }
    return Outcome(runs, lost, found)
