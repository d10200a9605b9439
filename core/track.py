"""What the engine remembers of one hand from frame to frame.

Everything here is a right hand: the engine mirrors a left hand's points before and its poses after.
"""

from __future__ import annotations

import numpy as np

from core.doubt import SPEED_LASTS_S, Doubt
from core.frames import NO_ID, NO_POINT, BoolArray, FloatArray, HandKey, HandState, IntArray, Side
from core.guesses import POINT_NOISE_M, Guesses
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS
from core.kinematics import kernels
from core.kinematics.prior import MotionPrior, posture_prior
from core.kinematics.solver import HandPose, HandSolver, spread_m
from core.markers.layout import MarkerLayout
from core.profile import Profile

MAX_STEP_S = 0.1
"""A longer pause between frames is no ground to extrapolate over."""

VELOCITY_BLEND = 0.6
"""Share of the newest step in the velocity: sensor noise against a hand that turns."""

STRAY_RAD = 1.5
"""How far from the way it was going a digit that is not seen may be after a second; with time it grows as t^1.5, as
under accelerations at random. At first its motion speaks for it, later only what postures are usual beside the digits
that are seen."""

LEAST_STRAY_S = 0.004
"""Even at the highest frame rates a prediction is not certain."""

LEAST_STRAY_RAD, STRAY_TAIL = 0.05, 4.0
"""The same where names are weighed: digits that were just seen start and stop; degrees of freedom of Student's t."""

OFFSET_BLEND = 0.03
"""Share of the newest frame in a marker's offset from the model: skin and glove move slowly."""

MAX_OFFSET_M = 0.012

TYPICAL_BLEND = 0.02
"""Share of the newest frame in how well the hand usually fits."""

OUTLIER_RATIO = 5.0
OUTLIER_RANGE_M = (0.006, 0.020)
"""A point so many times further off than the hand usually fits is not this marker: at least what skin and glove
slide (2 mm at the 99th percentile, with a margin), at most about the distance of two markers."""

LEAST_STD_M = 0.0008
"""Standard deviation per axis of a marker about the model at best: skin slides."""

SPREAD, SPREAD_RANGE, SPREAD_BLEND, SPREAD_MOST = 1.0, (0.2, 3.0), 0.05, 4.0
"""Before any has come back; a hand and glove that are not as the profile says do so far off, and others do not."""

ARC_SHARE = 0.25
"""Of how far off a marker may be, what is alike in all directions: a digit bends along an arc, of which the standard
deviations of its angles know the tangent only."""

STRAYED, STRAYED_S = 6.0, 0.3
"""A hidden digit that goes its own way is so many standard deviations off at most, and after so long."""

LEAST_REACH_M, REACH = 0.018, 3.0
"""A free point that is looked at again lies so near to a hidden marker: in any case, and in standard deviations."""

UNSEEN_FRAMES = 1_000_000
"""Of a marker that was never seen."""

LEAVING_MPS = 0.2
"""A hand that vanishes at this speed has left where it could be seen."""

OTHER_SIZE = 0.0015
"""Share by which one frame may find the hand's size to be another than the average over earlier ones."""

SCALE_FRAMES = 120
"""Frames over which the hand's size is averaged after it was first found."""


def outlier_m(rms_m: float) -> float:
    """How far from its marker no point of a hand lies that usually fits so well [m]."""
    return float(np.clip(OUTLIER_RATIO * rms_m, *OUTLIER_RANGE_M))


def tracking_solver(profile: Profile) -> HandSolver:
    """The solver of a hand that is tracked: where markers do not tell, this performer's usual postures do."""
    prior = posture_prior(profile.subspace, noise_m=POINT_NOISE_M)
    return HandSolver(profile.hand.skeleton, profile.worn, prior)


class HandTrack:
    """One hand: its pose, how it moves, and which point was which marker.

    point (m,) int64: index of each marker's point in the present frame, NO_POINT if hidden.
    label_confidence (m,) float64: probability that each marker's label, or its being hidden, is right; NaN if unknown.
    why: one of core.frames.WHY_LOST.
    cov_m2 (m, 3, 3) float64: how uncertain a marker's place was when its point was named, as covariance [m^2].
    predicted: the pose of the present frame before any of its points was looked at.
    spread: how much further markers come back from where they were expected than their standard deviation says.
    nameless (n,) int64: frames for which each point of this frame has been there without being any marker.
    newcomer (n,) bool: points whose device id was not there in the frame before.
    hidden_frames (m,) int64: as hidden_s, in frames.
    sure_nats (m,) float64: how sure each name was when its marker was last seen, as logarithm of the odds.
    strayed_m2 (m, 3, 3) float64: the same had its digit gone its own way.
    off_m (m, 3) float64: where it was found less where it was expected [m], NaN once the name is beyond doubt.
    provisional (m,) bool: names that could still turn out to be a ghost's; nothing is learnt of motion from them.
    young (m,) bool: names given so few frames ago that another point nearby has as good a claim to them.
    ids (m,) int64: device id under which each marker was last seen. hidden_s (m,) float64: since when it is not.
    offsets_m (m, 3) float64: where a marker is seen, less where the model has it, in the frame of its joint.
    """

    def __init__(
        self,
        performer: int,
        side: Side,
        layout: MarkerLayout,
        solver: HandSolver,
        scale: float | None,
        placed_m: float = 0.0,
    ) -> None:
        m = len(layout.marker_names)
        self.performer = performer
        self.side = side
        self.layout = layout
        self.state = HandState.SEARCHING
        self.solver = solver
        self.pose = HandPose.at_rest(m)
        self.point = np.full(m, NO_POINT, dtype=np.int64)
        self.ids = np.full(m, NO_ID, dtype=np.int64)
        self.carried = np.zeros(m, dtype=np.bool_)
        self.label_confidence = np.full(m, np.nan)
        self.predicted = self.pose
        self.cov_m2 = np.zeros((m, 3, 3))
        self.strayed_m2 = np.zeros((m, 3, 3))
        self.off_m = np.full((m, 3), np.nan)
        self.provisional = np.zeros(m, dtype=np.bool_)
        self.young = np.zeros(m, dtype=np.bool_)
        self.nameless = np.zeros(0, dtype=np.int64)
        self.newcomer = np.zeros(0, dtype=np.bool_)
        self.hidden_frames = np.zeros(m, dtype=np.int64)
        self._away = np.zeros(m, dtype=np.int64)
        self._new = False
        self.sure_nats = np.full(m, np.inf)
        self.spread = SPREAD
        self.why = "searching"
        self.hidden_s = np.zeros(m)
        self.offsets_m = np.zeros((m, 3))
        self.frames = 0  # that were tracked
        self.typical_rms_m = 0.0
        self._joints = layout.joints
        self._scale = scale
        self._doubt = Doubt(solver, placed_m)
        self._log_scale_sum = 0.0
        self._guesses = Guesses(solver)
        self._firm_guesses = Guesses(solver)
        self._guessed = np.zeros(N_DOFS - N_ROOT_DOFS, dtype=np.bool_)
        self._unseen_s = np.zeros(N_DOFS - N_ROOT_DOFS)
        self._motion = MotionPrior(np.zeros(N_DOFS - N_ROOT_DOFS), np.zeros(N_DOFS - N_ROOT_DOFS))
        self._velocity = np.zeros(N_DOFS)
        self._last_theta = np.zeros(N_DOFS)
        self._step = np.zeros(N_DOFS)
        self._targets = np.zeros((m, 3))

    @property
    def key(self) -> HandKey:
        """Which hand this is."""
        return HandKey(self.performer, self.side)

    @property
    def tracked(self) -> bool:
        """A pose is known for the present frame."""
        return self.state is HandState.TRACKED

    @property
    def observed(self) -> BoolArray:
        """(m,) bool."""
        seen: BoolArray = self.point != NO_POINT
        return seen

    @property
    def known_scale(self) -> float | None:
        """The hand's size, None while it is not known."""
        if self._scale is None and self.frames < SCALE_FRAMES:
            return None
        return self.pose.scale if self._scale is None else self._scale

    @property
    def free_scale(self) -> bool:
        """Is the hand's size still being found?"""
        return self.known_scale is None

    @property
    def std_at_best_m(self) -> float:
        """How far per axis a point usually lies off its marker where the pose is known [m]."""
        return max(LEAST_STD_M, self.typical_rms_m)

    @property
    def std_m(self) -> FloatArray:
        """(m,) float64 [m]: how uncertain a marker's place was, per axis, when its point was named."""
        std_m: FloatArray = spread_m(self.cov_m2) / np.sqrt(3.0)
        return std_m

    @property
    def outlier_m(self) -> float:
        """How far from its marker no point of the hand lies [m]."""
        return outlier_m(self.typical_rms_m)

    @property
    def new(self) -> bool:
        """Was the hand found in the last frame?"""
        return self._new

    @property
    def was_leaving(self) -> bool:
        """Was the hand on its way when it was last seen?"""
        return bool(np.linalg.norm(self._velocity[:3]) > LEAVING_MPS)

    def begin(self, pose: HandPose, point: IntArray, ids: IntArray) -> None:
        """Take up a hand found in the present frame. ids: (n,) int64, of the frame's points."""
        self.pose = pose.copy()
        self.point = point.copy()
        self.ids = np.where(point == NO_POINT, NO_ID, ids[point])
        self.hidden_s[:] = 0.0
        self.hidden_frames = np.where(point == NO_POINT, UNSEEN_FRAMES, 0)
        self._away[:] = 0
        self.offsets_m[:] = 0.0
        self._velocity[:] = 0.0
        self._last_theta[:] = pose.theta_rad
        self._guesses.reset()
        self._doubt.begin()
        self._firm_guesses.reset()
        self.provisional[:] = False
        self.young[:] = False
        self.sure_nats[:] = np.inf
        self.off_m[:] = np.nan
        self._unseen_s[:] = np.inf  # how it moved before is not known
        self._new = True
        self._motion.stiffness_m2[:] = 0.0
        if self.free_scale:
            self.frames = 1
            self._log_scale_sum = float(np.log(pose.scale))
        self.typical_rms_m = pose.rms_m
        self.state = HandState.TRACKED
        self.why = ""

    def mend(self, pose: HandPose, point: IntArray) -> None:
        """Take up a better explanation of the present frame; what was learnt of motion and markers stays."""
        self.off_m[point != self.point] = np.nan
        self.pose = pose.copy()
        self.point = point.copy()

    def skip(self, frames: int) -> None:
        """So many frames went by unseen: what was hidden was so in them."""
        self.hidden_frames[self.hidden_frames > 0] += frames
        self._away += frames

    def pass_over(self, ids: frozenset[int]) -> None:
        """A frame went by of which only the ids of its points are looked at: what has kept its id is still there, and
        what has not is hidden from now on, whoever bears that id later."""
        self.skip(1)
        for marker, own in enumerate(self.ids.tolist()):
            if own in ids:
                self._away[marker] = 0
            elif own != NO_ID:
                self.ids[marker] = NO_ID
                self.hidden_frames[marker] = self._away[marker]

    def review_size(self, points_m: FloatArray) -> None:
        """Find the hand's size anew, from the present frame on, if the points of this frame alone, (n, 3) float64 [m],
        say that it is another; nothing happens where it is the profile's."""
        if self._scale is None:
            seen = self.observed
            self._targets[seen] = points_m[self.point[seen]]
            if abs(np.log(self._sized(seen).scale / self.pose.scale)) > OTHER_SIZE:
                self.frames, self._log_scale_sum = 0, 0.0

    def lose(self) -> None:
        """Give the hand up; its pose stays where it was, and `why` says the reason."""
        self.state = HandState.LOST
        self.label_confidence[:] = np.nan
        self.point[:] = NO_POINT
        self.ids[:] = NO_ID

    def predict(self, dt_s: float) -> None:
        """Move the pose on by its velocity, and say where each digit is expected should it not be seen."""
        self._doubt.learn()
        if dt_s > 0.0:  # NaN is not
            self._unseen_s += dt_s
        if 0.0 < dt_s <= MAX_STEP_S:
            if self._guessed.any():
                self._velocity[N_ROOT_DOFS:][self._guessed] *= np.exp(-dt_s / SPEED_LASTS_S)
            self._motion.expected_rad[:] += self._velocity[N_ROOT_DOFS:] * dt_s
            kernels.pose_moved(self.pose.theta_rad, self._velocity * dt_s)
        self.solver.place(self.pose)
        self.predicted = self.pose.copy()
        self._guesses.mark()

    def expected_m(self) -> FloatArray:
        """(m, 3) float64 [m]: where each marker should be seen, its own offset included."""
        return self.seen_at(self.pose)

    def seen_at(self, pose: HandPose) -> FloatArray:
        """`expected_m` were the hand in `pose`."""
        rotations = pose.joints_world[self._joints, :3, :3]
        expected: FloatArray = pose.markers_world_m + np.einsum("mab,mb->ma", rotations, self.offsets_m)
        return expected

    def reach_m(self) -> FloatArray:
        """(m,) float64 [m]: how far from where it is expected a marker without a point may be."""
        open_m = self.uncertainty()[1] / np.sqrt(3.0)
        reach_m: FloatArray = np.maximum(LEAST_REACH_M, REACH * self._straying() * open_m)
        return reach_m

    def _straying(self) -> FloatArray:
        """(m,) float64: how many times further than its standard deviation says each marker may be, should its digit
        have gone its own way."""
        times: FloatArray = np.maximum(STRAYED * np.minimum(self.hidden_s / STRAYED_S, 1.0), self.spread)
        return times

    def placed(self, points_m: FloatArray, point: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Where the markers that carry no label should be seen, given those that do: (m, 3) float64 [m]; how far off
        that may be, covariances (m, 3, 3) float64 [m^2]; and how far, should the digit have gone its own way, the same.

        points_m: (n, 3) [m]. point: (m,), labels; the pose follows them, the track's own labels stay.
        """
        own, self.point = self.point, point
        self.solve(points_m)
        open_m2 = self._doubted()[1]
        self.point = own
        # A digit that bends goes along an arc, which its first derivative does not know.
        round_m2 = np.square(spread_m(open_m2) / np.sqrt(3.0))[:, None, None] * np.eye(3)
        open_m2 = open_m2 + ARC_SHARE * (round_m2 - open_m2)
        best_m2 = np.square(self.spread * self.std_at_best_m) * np.eye(3)
        cov_m2 = self.spread**2 * open_m2 + best_m2
        return self.expected_m(), cov_m2, np.square(self._straying())[:, None, None] * open_m2 + best_m2

    def solve(self, points_m: FloatArray, iterations: int = 8) -> None:
        """Fit the pose to the points that carry labels. points_m: (n, 3) float64 [m].

        Angles that no marker speaks for are held where their motion leads, the less the longer they are not seen.
        """
        seen = self.observed
        self._targets[seen] = points_m[self.point[seen]]
        self._guessed = self._guesses.of(self.pose, seen)
        self._motion.stiffness_m2[:] = 0.0
        if self._guessed.any():
            stray_rad = STRAY_RAD * np.maximum(self._unseen_s[self._guessed], LEAST_STRAY_S) ** 1.5
            self._motion.stiffness_m2[self._guessed] = np.square(POINT_NOISE_M / stray_rad)
        self.solver.solve(self.pose, self._targets, seen.astype(np.float64), iterations=iterations, motion=self._motion)

    def solve_anew(self, points_m: FloatArray) -> None:
        """`solve`, as if the frame had not been solved before with other points."""
        self.pose = self.predicted.copy()
        self._guesses.take_back()
        self.solve(points_m)

    def uncertainty(self) -> tuple[FloatArray, FloatArray]:
        """theta_std (26,) float64 [m, rad] and marker_std_m (m,) float64 [m], as in a HandFrame, of the last solve."""
        theta_std, cov_m2 = self._doubted()
        return theta_std, spread_m(cov_m2)

    def _doubted(self) -> tuple[FloatArray, FloatArray]:
        """theta_std (26,) and covariances of markers (m, 3, 3) float64 [m^2] of the last solve."""
        speed_radps = self._velocity[N_ROOT_DOFS:]
        return self._doubt.of(
            self.pose, self._targets, self.observed, self._guessed, self._motion, self._unseen_s, speed_radps
        )

    def surprise(self, theta_rad: FloatArray) -> float:
        """How far a pose of the present frame has its digits from where their motion led, in nats above none at all.

        theta_rad: (26,) float64. Motion has heavy tails: a digit that starts at a stroke costs the logarithm of it.
        """
        stray_rad = np.hypot(STRAY_RAD * np.maximum(self._unseen_s, LEAST_STRAY_S) ** 1.5, LEAST_STRAY_RAD)
        off = (theta_rad[N_ROOT_DOFS:] - self._motion.expected_rad) / stray_rad
        return float(0.5 * (STRAY_TAIL + 1.0) * np.log1p(np.square(off) / STRAY_TAIL).sum())

    def errors_m(self, points_m: FloatArray) -> FloatArray:
        """(m,) float64 [m]: distance of each marker's point from where it was expected; NaN if hidden."""
        seen = self.observed
        errors = np.full(len(seen), np.nan)
        errors[seen] = np.linalg.norm(points_m[self.point[seen]] - self.expected_m()[seen], axis=1)
        return errors

    def returned(self, proven: BoolArray) -> None:
        """Learn from markers (m,) bool, whose names are beyond doubt by now, how far off they came back."""
        off_m = self.off_m[proven][..., None]
        squared = (off_m.mT @ np.linalg.solve(self.cov_m2[proven], off_m))[:, 0, 0]
        for ratio in np.sqrt(squared / 3.0):
            self.spread *= float(np.sqrt(1.0 + SPREAD_BLEND * (min(ratio, SPREAD_MOST) ** 2 - 1.0)))
        self.spread = float(np.clip(self.spread, *SPREAD_RANGE))
        self.off_m[proven] = np.nan

    def settle(self, points_m: FloatArray, ids: IntArray, dt_s: float) -> None:
        """Learn from a frame that was accepted: velocity, offsets, ids, size."""
        seen = self.observed
        self._targets[seen] = points_m[self.point[seen]]
        if self.free_scale:
            self._refine_scale()
        theta = self.pose.theta_rad
        if 0.0 < dt_s <= MAX_STEP_S:
            kernels.pose_step(self._last_theta, theta, self._step)
            self._step /= dt_s
            self._step -= self._velocity
            # A guess tells nothing of motion, nor does the step from one to the truth.
            self._step[N_ROOT_DOFS:][self._guessed | (self._unseen_s > 1.5 * dt_s)] = 0.0
            self._velocity += VELOCITY_BLEND * self._step
        else:
            self._velocity[:] = 0.0
        self._last_theta[:] = theta
        known = ~self._guessed
        if self.provisional.any():
            known &= ~self._firm_guesses.of(self.pose, seen & ~self.provisional)
        self._motion.expected_rad[known] = theta[N_ROOT_DOFS:][known]
        self._unseen_s[known] = 0.0
        difference = points_m[self.point[seen]] - self.pose.markers_world_m[seen]
        local = np.einsum("mba,mb->ma", self.pose.joints_world[self._joints[seen], :3, :3], difference)
        self.offsets_m[seen] += OFFSET_BLEND * (local - self.offsets_m[seen])
        self._doubt.placed(seen, OFFSET_BLEND)
        length = np.linalg.norm(self.offsets_m, axis=1, keepdims=True)
        self.offsets_m *= np.minimum(1.0, MAX_OFFSET_M / np.maximum(length, 1e-9))
        self.ids[seen] = ids[self.point[seen]]
        self.ids[~seen] = NO_ID
        # Of what is newly hidden nobody knows since when: it counts from when it was last known to be there.
        newly = np.where(self.hidden_frames == 0, self._away, 0)
        self.hidden_frames = np.where(seen, 0, self.hidden_frames + 1 + newly)
        self._away[:] = 0
        self.hidden_s[seen] = 0.0
        self.hidden_s[~seen] += max(dt_s, 0.0)
        if self.pose.rms_m < 2.0 * self.typical_rms_m:  # a bad stretch does not become the measure of itself
            self.typical_rms_m += TYPICAL_BLEND * (self.pose.rms_m - self.typical_rms_m)
        self.frames += 1
        self._new = False

    def _refine_scale(self) -> None:
        """Average the size that each frame alone would choose, then fit the frame again at the average."""
        seen = self.observed
        self._log_scale_sum += float(np.log(self._sized(seen).scale))
        self.pose.scale = float(np.exp(self._log_scale_sum / (self.frames + 1)))
        self.solver.solve(self.pose, self._targets, seen.astype(np.float64), iterations=4, motion=self._motion)

    def _sized(self, seen: BoolArray) -> HandPose:
        """The pose with the size that the present frame alone would choose."""
        sized = self.pose.copy()
        weights = seen.astype(np.float64)
        self.solver.solve(sized, self._targets, weights, free_scale=True, iterations=8, motion=self._motion)
        return sized
