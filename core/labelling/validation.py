"""Is a solved hand a hand, and are its labels right? (Han 2018, 4.4.)

A pose whose points lie more than 8 mm from the model is none. Before it is given up, single points too far off are
unlabelled; and where a hand fits worse than it did, leaves points and markers unexplained side by side, or has names
that another point could bear, other names are proposed, with the network's among them. Every hand is also shown to the
network now and then, in turn: what it thinks of the labels is their confidence, beside what the hand's shape says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from core.frames import NO_POINT, BoolArray, FloatArray, HandKey, IntArray
from core.labelling.mending import rival_m

if TYPE_CHECKING:
    from core.labelling.mending import Mender
    from core.labelling.network import NamedHand
    from core.track import HandTrack

MAX_RMS_M = 0.008
"""Han 2018, 4.4."""

LEAST_POINTS = 4
DOUBT_RMS_M = 0.0015
DOUBT_RATIO = 1.5
"""A hand that fits so much worse than it used to, and worse than skin slides, has wrong labels."""

LONGEST_PAUSE = 8
"""Frames between two looks at what stays unexplained, such as a ghost beside a hidden marker."""

WORSE_PAUSE = 2
"""The same for a hand that fits worse than it did."""

SHOWN_EVERY = 24
"""Frames from one look of the network at a hand to the next, and from one that counts to the next: what it says of
frames so far apart adds up."""

NEAR_M = 0.090
"""A thumb that opens wide is so far from where a hand without its markers is thought to have it."""

FIRM_M = 0.004
"""A name given where the marker's place was surer than this, per axis, needs no proof,"""

FAR_M, FAR = 0.005, 3.5
"""if it was given to a point that is not so far from there: in any case, and in standard deviations per axis."""

PROVISIONAL_FRAMES = 12
"""Ghosts live shorter."""

SHAPE_NATS, FRESH_NATS, TOLD_NATS = 6.0, 2.0, 4.0
"""How sure the shape of the hand is of a name at most, how much less of one that was given in this frame, and how sure
the network is allowed to be."""


@dataclass
class _Doubts:
    """What is in doubt about one hand."""

    unexplained: int = 0
    wait: int = 0
    pause: int = 0
    since_shown: int = 0
    ages: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))  # frames since each name was given
    told: FloatArray = field(default_factory=lambda: np.empty(0))  # nats for each name, by the network
    since_counted: int = 0
    against: FloatArray = field(default_factory=lambda: np.empty(0))  # nats against each name, by earlier looks

    def due(self, unexplained: int, newcomer: bool) -> bool:
        """Is it time to look at other names? At once if more is unexplained than before, or something new is; else
        after a growing pause."""
        self.wait = max(self.wait - 1, 0)
        return newcomer or unexplained > self.unexplained or self.wait == 0

    def skip(self, frames: int) -> None:
        """So many frames went by unseen."""
        self.wait = max(self.wait - frames, 0)
        self.since_shown += frames
        self.since_counted += frames
        self.ages += frames

    def settle(self, unexplained: int, mended: bool, longest: int) -> None:
        """Take note of what came of it. longest: pause in frames that may follow."""
        self.unexplained = unexplained
        self.pause = 0 if mended else min(max(1, 2 * self.pause), longest)
        self.wait = self.pause


class Validation:
    """Judges each solved hand, and mends wrong labels where it can."""

    def __init__(self, mender: Mender) -> None:
        self._mender = mender
        self.reset()

    def reset(self) -> None:
        """Forget what was doubted before."""
        self._doubts: dict[HandKey, _Doubts] = {}

    def skip(self, frames: int) -> None:
        """So many frames went by unseen: a name that is still carried has grown older, and a ghost's has not lasted."""
        for doubts in self._doubts.values():
            doubts.skip(frames)

    def keep(self, hands: Mapping[HandKey, HandKey]) -> None:
        """Go on with what is doubted of these hands."""
        self._doubts = {hands[key]: doubts for key, doubts in self._doubts.items() if key in hands}

    def accept(self, track: HandTrack, points_m: FloatArray, free: BoolArray) -> bool:
        """True if the pose stands; its labels may have been mended."""
        doubts = self._doubts_of(track)
        track.young &= doubts.ages < PROVISIONAL_FRAMES  # frames that nobody saw have proven names as well
        track.provisional &= track.young
        if track.observed.sum() >= LEAST_POINTS:
            own = track.point[track.observed]
            self._drop_outliers(track, points_m)
            free = free.copy()
            free[np.setdiff1d(own, track.point)] = True  # what lost its name may be another marker
            self._disown(doubts, track)
        rows = self._near(track, points_m, free)
        enough = len(rows) >= LEAST_POINTS
        unexplained, newcomer = self._unexplained(track, points_m, rows)
        worse = enough and self._worse(track)
        doubts.since_shown += 1
        doubts.since_counted += 1
        name, before = None, track.point.copy()
        if enough and (unexplained or worse) and doubts.due(unexplained, newcomer) and self._mender.ready:
            name = self._mender.ask(track, points_m, rows)
            mended = self._mender.improve(track, points_m, rows, name, doubts.against, worse)
            longest = WORSE_PAUSE if self._worse(track) else LONGEST_PAUSE
            doubts.settle(self._unexplained(track, points_m, rows)[0], mended, longest)
        elif enough and doubts.since_shown >= SHOWN_EVERY and self._mender.ready:
            name = self._mender.ask(track, points_m, rows)
            if name is not None and (name.point != track.point).any():
                self._mender.improve(track, points_m, rows, name, doubts.against, crossed=True)
        doubts.against[track.point != before] = 0.0  # what was said was said of another name
        self._disown(doubts, track)
        if not (unexplained or worse):
            doubts.settle(0, mended=True, longest=0)
        few = track.observed.sum() < LEAST_POINTS
        fits = bool(not few and track.pose.rms_m <= MAX_RMS_M)
        if fits:
            self._take_note(doubts, track, points_m, name)
        track.why = self._why(track, rows, few, fits)
        return fits

    def _doubts_of(self, track: HandTrack) -> _Doubts:
        """Those of this hand; none where it was just found."""
        doubts = self._doubts.get(track.key)
        if doubts is None or len(doubts.ages) != len(track.point) or track.new:
            m, k = len(track.point), len(self._doubts)
            doubts = _Doubts(ages=np.full(m, PROVISIONAL_FRAMES), told=np.zeros(m), against=np.zeros(m))
            doubts.since_shown = (SHOWN_EVERY * k) // 4 % SHOWN_EVERY  # not all hands in one frame
            self._doubts[track.key] = doubts
        return doubts

    @staticmethod
    def _drop_outliers(track: HandTrack, points_m: FloatArray) -> None:
        """Unlabel points that lie further off than the hand usually fits, or than their markers could be."""
        errors = track.errors_m(points_m)
        seen = track.observed
        limit = np.full(len(seen), track.outlier_m)
        if np.nanmax(errors) <= limit[0]:
            return
        wrong = seen & (errors > np.maximum(limit, 3.0 * float(np.median(errors[seen]))))
        if wrong.any() and (seen & ~wrong).sum() >= LEAST_POINTS:
            track.point[wrong] = NO_POINT
            track.solve(points_m)

    @staticmethod
    def _disown(doubts: _Doubts, track: HandTrack) -> None:
        """A name that is taken back was wrong from when it was given: so long has its marker not been seen."""
        disowned = track.carried & ~track.observed
        track.hidden_frames[disowned] = doubts.ages[disowned]

    @staticmethod
    def _worse(track: HandTrack) -> bool:
        """Does the hand fit worse than it did, or not at all?"""
        limit = max(DOUBT_RMS_M, DOUBT_RATIO * track.typical_rms_m)
        return bool(track.observed.sum() < LEAST_POINTS or track.pose.rms_m > limit)

    @staticmethod
    def _unexplained(track: HandTrack, points_m: FloatArray, rows: IntArray) -> tuple[int, bool]:
        """Points without a marker that could be one of those without a point, or one whose point is in doubt: as many
        labels may be missing or wrong. And whether one of these points is new."""
        spare = np.setdiff1d(rows, track.point[track.observed], assume_unique=True)
        hidden, doubted = np.flatnonzero(~track.observed), np.flatnonzero(track.young & track.observed)
        if len(spare) == 0 or len(hidden) + len(doubted) == 0:
            return 0, False
        gaps_m = np.linalg.norm(points_m[spare][:, None] - track.expected_m()[hidden][None], axis=2)
        lost = (gaps_m < track.reach_m()[hidden]).any(axis=1)
        gaps_m = np.linalg.norm(points_m[spare][:, None] - points_m[track.point[doubted]][None], axis=2)
        rivals = (gaps_m < rival_m(track)[doubted]).any(axis=1)
        count = max(min(len(hidden), int(lost.sum())), int(rivals.sum()))
        return count, bool(track.newcomer[spare[lost | rivals]].any())

    @staticmethod
    def _near(track: HandTrack, points_m: FloatArray, free: BoolArray) -> IntArray:
        """Sorted rows of the hand's own points and of the free ones around it."""
        near = np.zeros(len(points_m), dtype=np.bool_)
        spare = np.flatnonzero(free)
        gaps = np.linalg.norm(points_m[spare][:, None] - track.pose.markers_world_m[None], axis=2)
        near[spare] = gaps.min(axis=1) < NEAR_M
        near[track.point[track.observed]] = True
        return np.flatnonzero(near)

    @staticmethod
    def _take_note(doubts: _Doubts, track: HandTrack, points_m: FloatArray, name: NamedHand | None) -> None:
        """How old each name is, what the network says of it, and so how far it can be trusted."""
        seen = track.observed
        kept = track.carried & seen
        doubts.ages = np.where(kept, doubts.ages + 1, 0)
        proven = (doubts.ages >= PROVISIONAL_FRAMES) & np.isfinite(track.off_m[:, 0])
        track.returned(proven)
        far = np.linalg.norm(np.nan_to_num(track.off_m), axis=1) > np.maximum(FAR_M, FAR * track.std_m)
        track.provisional[seen & ~kept] = (far | (track.std_m > FIRM_M))[seen & ~kept]
        track.young = seen & (doubts.ages < PROVISIONAL_FRAMES)
        track.provisional &= track.young
        doubts.against[~kept] = 0.0
        if name is None:
            doubts.told[~kept] = 0.0
        else:
            doubts.since_shown = 0
            odds = np.log(np.clip(name.confidence, 1e-3, 1.0 - 1e-3) / np.clip(1.0 - name.confidence, 1e-3, 1.0))
            doubts.told = np.clip(np.where(name.point == track.point, odds, -odds), -TOLD_NATS, TOLD_NATS)
            if doubts.since_counted >= SHOWN_EVERY:
                doubts.since_counted = 0
                doubts.against = np.maximum(doubts.against - doubts.told, -TOLD_NATS)
        off = track.errors_m(points_m) / max(track.outlier_m / 3.0, 1e-9)
        shape = np.where(seen, SHAPE_NATS - 0.5 * np.square(off) - FRESH_NATS * track.provisional, SHAPE_NATS)
        sure = shape + doubts.told
        track.sure_nats[seen] = sure[seen]
        track.label_confidence[:] = 1.0 / (1.0 + np.exp(-sure))

    @staticmethod
    def _why(track: HandTrack, rows: IntArray, few: bool, fits: bool) -> str:
        """One of WHY_LOST."""
        if fits:
            return "searching" if Validation._worse(track) else ""
        if not few:
            return "out of shape"
        if len(rows) == 0 and track.was_leaving:
            return "left the volume"
        return "too few markers" if len(rows) else "no points"
