"""What the hand itself says of the points in doubt: solved without them, where would each marker be?

The names that are beyond doubt give the poses, once forward and once backward in time. So every marker without one has
a place in every frame, and an expected error, from what was before and from what comes after. A tracklet in doubt is
measured against each marker whose place is free: how far off it is, in units of the lesser error of the two, beside the
chance that any reflection lies there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import gammaln

from core.cast import Cast
from core.frames import NO_ID, BoolArray, FloatArray, HandFrame, HandState, IntArray, MarkerFrame, TrackedFrame
from core.hand.mirror import mirror_points, mirror_theta
from core.kinematics.solver import HandPose
from core.relabel.cloud import Cloud
from core.relabel.names import NOBODY, Naming
from core.track import tracking_solver

LEAST_ERROR_M = 0.002
"""What skin slides and a layout is off, on top of the expected error."""

REACH_M = 0.060
"""A point further off than this is not this marker, whatever the expected error."""

MOST_MISFIT = 100.0
"""Squared distance over squared error that counts at most: one frame alone does not decide."""

GHOSTS_PER_M3 = 1000.0
"""Reflections near a hand: one or two where its markers are."""

FREEDOM = 4.0
"""Degrees of freedom of the errors' distribution."""

_PEAK = float(gammaln(0.5 * FREEDOM + 1.5) - gammaln(0.5 * FREEDOM) - 1.5 * np.log(FREEDOM * np.pi))
_OTHER_IDS = 1 << 40


def with_names(frame: MarkerFrame, names: IntArray) -> MarkerFrame:
    """The frame with names for ids. Points without one keep theirs, out of the way: props are followed by ids."""
    ids = np.where(frame.ids == NO_ID, NO_ID, frame.ids + _OTHER_IDS)
    return replace(frame, ids=np.where(names == NOBODY, ids, names))


class Witness:
    """Adds up over the frames what speaks for each name of each tracklet."""

    def __init__(self, cloud: Cloud, naming: Naming, cast: Cast, name: IntArray, doubted: BoolArray) -> None:
        """name: (n_tracklets,) those that are solved with. doubted: (n_tracklets,) those to be measured."""
        self._cloud, self._naming, self._name = cloud, naming, name
        self._solvers = [tracking_solver(profile) for profile in cast]
        self._poses = [HandPose.at_rest(len(profile.layout.marker_names)) for profile in cast]
        self._off_m2, self._off_frames = np.zeros(len(name)), np.zeros(len(name), dtype=np.int64)
        self._slot = np.where(doubted, np.cumsum(doubted) - 1, -1)
        self._doubted = np.flatnonzero(doubted)
        self._sums = [_Sums(len(self._doubted), naming.n_names) for _ in range(2)]

    def see(self, i: int, points_m: FloatArray, solved: TrackedFrame, back: bool) -> None:
        """Frame i as it was solved, in the pass that goes back in time or the other."""
        tracklets = self._cloud.tracklet[self._cloud.rows(i)].astype(np.int64)
        for hand in solved.hands:
            if hand.state is HandState.TRACKED and hand.observed.any():
                self._own(tracklets, points_m, hand)
        slots = self._slot[tracklets]
        rows = np.flatnonzero(slots >= 0)
        if len(rows) == 0:
            return
        slots, points = slots[rows], points_m[rows]
        for hand in solved.hands:
            if hand.state is HandState.TRACKED:
                self._sums[back].measure(slots, points, hand, self._naming.first[hand.key])

    def evidence(self) -> FloatArray:
        """(n_tracklets, n_names) float64, log of the odds, NaN where nothing is known."""
        (misfit, log_error), (misfit_back, log_error_back) = (sums.means() for sums in self._sums)
        nearer = log_error_back < log_error
        misfit, log_error = np.where(nearer, misfit_back, misfit), np.minimum(log_error, log_error_back)
        # A point of a marker against one anywhere. error_m is the root of the variance over three axes; Student's
        # distribution, for an expected error is itself an estimate.
        scale = log_error + 0.5 * np.log(1.0 / 3.0)
        log_odds = _PEAK - 3.0 * scale - 0.5 * (FREEDOM + 3.0) * np.log1p(3.0 * misfit / FREEDOM)
        log_odds -= np.log(GHOSTS_PER_M3)
        gain = np.full((len(self._name), self._naming.n_names), np.nan)
        gain[self._doubted] = np.where(np.isfinite(log_error), log_odds, np.nan)
        return gain

    def off_m(self) -> FloatArray:
        """(n_tracklets,) float64 [m], root mean square distance from its marker where solved with, else NaN."""
        with np.errstate(invalid="ignore"):
            off_m: FloatArray = np.sqrt(self._off_m2 / self._off_frames)
        return off_m

    def _own(self, tracklets: IntArray, points_m: FloatArray, hand: HandFrame) -> None:
        left, seen = hand.side == "left", hand.observed
        pose = self._poses[hand.performer]
        pose.theta_rad[:] = mirror_theta(hand.theta_rad) if left else hand.theta_rad
        pose.scale = hand.scale
        self._solvers[hand.performer].place(pose)
        there = mirror_points(pose.markers_world_m) if left else pose.markers_world_m
        point = hand.point[seen]
        self._off_m2[tracklets[point]] += np.square(points_m[point] - there[seen]).sum(axis=1)
        self._off_frames[tracklets[point]] += 1


class _Sums:
    """Of one pass: how many frames measured each tracklet in doubt by each marker, and what they found."""

    def __init__(self, n_doubted: int, n_names: int) -> None:
        self._frames = np.zeros((n_doubted, n_names), dtype=np.int32)
        self._misfit = np.zeros((n_doubted, n_names))
        self._log_error = np.zeros((n_doubted, n_names))

    def measure(self, slots: IntArray, points_m: FloatArray, hand: HandFrame, first: int) -> None:
        """Points (n, 3) [m] of the tracklets in doubt `slots` (n,) against the hidden markers of a hand."""
        free = np.flatnonzero(~hand.observed & np.isfinite(hand.marker_std_m))
        if len(free) == 0:
            return
        difference = points_m[:, None] - hand.markers_world_m[free][None]
        squared = np.einsum("pka,pka->pk", difference, difference)
        error_m = np.hypot(hand.marker_std_m[free], max(LEAST_ERROR_M, np.nan_to_num(hand.rms_m)))
        misfit = np.where(squared < REACH_M**2, squared / error_m**2, MOST_MISFIT)
        cells = (slots[:, None], first + free[None])
        self._frames[cells] += 1
        self._misfit[cells] += np.minimum(misfit, MOST_MISFIT)
        self._log_error[cells] += np.log(error_m)

    def means(self) -> tuple[FloatArray, FloatArray]:
        """Mean misfit and log of the expected error, (n_doubted, n_names) each; infinite error where none measured."""
        count = np.maximum(self._frames, 1)
        return self._misfit / count, np.where(self._frames > 0, self._log_error / count, np.inf)
