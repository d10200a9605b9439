"""Inverse kinematics: labelled points in, poses out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypedDict, Unpack

import numpy as np
import numpy.typing as npt

from core.errors import PhalanxError
from core.frames import FloatArray
from core.hand.skeleton import N_DOFS, N_JOINTS, Skeleton
from core.kinematics import kernels
from core.kinematics.forward import rest_offsets
from core.kinematics.prior import REST_PRIOR, MotionPrior, PosturePrior, subspace_stiffness_m2
from core.markers.layout import MAX_MARKERS, MarkerLayout
from core.motion.subspace import Subspace

Records = npt.NDArray[np.void]

WHOLE: Records = np.zeros(1, kernels.SPACE)
"""No subspace: the angles themselves."""


class How(TypedDict, total=False):
    """How a pose is solved.

    free_scale: the hand's size is solved too (False). free_root: else the wrist stays (True). iterations: at most so
    many (10), of each layer. tolerance: it ends when a step gains less than this share of the energy (1e-4).
    """

    free_scale: bool
    free_root: bool
    iterations: int
    tolerance: float


@dataclass
class HandPose:
    """A right hand as the solver leaves it; one buffer, written anew at every solve.

    theta_rad (26,), joints_world (16, 4, 4), markers_world_m (m, 3) float64; rms_m over the seen markers [m].
    """

    theta_rad: FloatArray
    joints_world: FloatArray
    markers_world_m: FloatArray
    scale: float = 1.0
    rms_m: float = float("nan")

    @classmethod
    def at_rest(cls, n_markers: int) -> HandPose:
        """All zeros; not yet solved."""
        return cls(np.zeros(N_DOFS), np.zeros((N_JOINTS, 4, 4)), np.zeros((n_markers, 3)))

    def copy(self) -> HandPose:
        """An independent pose."""
        return HandPose(
            self.theta_rad.copy(), self.joints_world.copy(), self.markers_world_m.copy(), self.scale, self.rms_m
        )


@dataclass(frozen=True)
class Appraisal:
    """How far a pose can be trusted under a noise, and what in it speaks for another noise (HandSolver.appraise).

    theta_std (26,): as of HandSolver.uncertainty. marker_cov_m2 (m, 3, 3) float64 [m^2], covariance of each marker's
    place: where it was observed, of the observation, elsewhere of its prediction. missed (26,) float64 [m, rad]: the
    step from the pose to where markers and priors of this noise balance; of the wrist's rotation about the world's
    axes. told: how many of the 26 parameters the markers tell; postural: of how many angles more is known than what
    postures are usual (both between none and all). unusual_m2: (a - mean)^T precision (a - mean) of the
    posture prior [m^2].
    """

    theta_std: FloatArray
    marker_cov_m2: FloatArray
    missed: FloatArray
    told: float
    postural: float
    unusual_m2: float

    @property
    def marker_std_m(self) -> FloatArray:
        """(m,) float64 [m], as of HandSolver.uncertainty."""
        return spread_m(self.marker_cov_m2)


def spread_m(cov_m2: FloatArray) -> FloatArray:
    """(...,) [m], the root of the variance summed over the axes, of covariances (..., 3, 3) [m^2]."""
    spread: FloatArray = np.sqrt(np.trace(cov_m2, axis1=-2, axis2=-1))
    return spread


class HandSolver:
    """Levenberg-Marquardt on 26 parameters within the joint limits, for one skeleton, layout and posture prior.

    Works in buffers of its own: one thread at a time.
    """

    def __init__(self, skeleton: Skeleton, layout: MarkerLayout, prior: PosturePrior = REST_PRIOR) -> None:
        self.skeleton = skeleton
        self.layout = layout
        self.prior = prior
        self.hand = _hand(skeleton, layout, prior)
        self._desk = _Desk(self.hand)
        self._space_of: Subspace | None = None
        self._space = WHOLE

    def solve(
        self,
        pose: HandPose,
        targets_m: FloatArray,
        weights: FloatArray,
        *,
        motion: MotionPrior | None = None,
        **how: Unpack[How],
    ) -> None:
        """Move `pose` to explain the points.

        targets_m: (m, 3) float64 [m], a point for each marker of the layout. weights: (m,) float64, 0 where a
        marker has no point. The present pose is the start. motion: what is expected of this frame. how: see How.
        """
        self._solve(WHOLE, False, pose, targets_m, weights, motion, how)

    def solve_subspace(
        self,
        pose: HandPose,
        targets_m: FloatArray,
        weights: FloatArray,
        subspace: Subspace,
        *,
        motion: MotionPrior | None = None,
        **how: Unpack[How],
    ) -> None:
        """As `solve`, with only the root and the coordinates of a subspace as unknowns (Schröder 2017, eq. 3-4).

        The subspace's own variances, against markers that it cannot reach wholly, stand in for the posture prior
        (core.kinematics.prior.subspace_stiffness_m2). Angles that the subspace would lead beyond a limit stay at it.
        """
        self._solve(self._space_for(subspace), False, pose, targets_m, weights, motion, how)

    def solve_layered(
        self,
        pose: HandPose,
        targets_m: FloatArray,
        weights: FloatArray,
        subspace: Subspace,
        *,
        motion: MotionPrior | None = None,
        **how: Unpack[How],
    ) -> None:
        """`solve_subspace`, then all parameters, damped towards what the subspace found: what no marker speaks of
        stays there, the rest follows its markers (Schröder 2017, "Subspace prior")."""
        self._solve(self._space_for(subspace), True, pose, targets_m, weights, motion, how)

    def uncertainty(
        self, pose: HandPose, weights: FloatArray, noise_m: float, motion: MotionPrior | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """What the markers with a weight, the priors and the joint limits leave open about `pose`.

        noise_m: standard deviation of a marker coordinate of weight 1 about the model. Returns theta_std (26,) float64
        [m, rad], one standard deviation of each parameter (of the wrist's rotation: about the world's axes), and
        marker_std_m (m,) float64 [m], the root of the variance summed over the axes: where a marker was observed, of
        the observation, elsewhere of its prediction. Large but finite where nothing is seen. Raises PhalanxError.
        """
        found = self.appraise(pose, pose.markers_world_m, weights, noise_m, motion)
        return found.theta_std, found.marker_std_m

    def appraise(
        self,
        pose: HandPose,
        targets_m: FloatArray,
        weights: FloatArray,
        noise_m: float,
        motion: MotionPrior | None = None,
    ) -> Appraisal:
        """`uncertainty`, and how the pose stands to its points targets_m (m, 3) float64 [m]. Raises PhalanxError."""
        if not 0.0 < noise_m < np.inf:
            raise PhalanxError(f"Noise of markers {noise_m!r} m.", "It must be more than 0 and finite.")
        self._desk.put(0, pose, targets_m, weights, motion)
        return self._desk.appraise(noise_m)

    def markers_by_digit(self, pose: HandPose, digit: int, angles_rad: FloatArray) -> FloatArray:
        """(n, m, 3) float64 [m]: where the markers were if `digit` (0..4) took each of the shapes (n, 4) [rad]."""
        out = np.empty((len(angles_rad), len(self.layout.joints), 3))
        self._desk.markers_by_digit(pose, digit, angles_rad, out)
        return out

    def place(self, pose: HandPose) -> None:
        """Write the joints and markers of `pose` from its parameters alone."""
        self.solve(pose, pose.markers_world_m, _UNSEEN[: len(self.layout.joints)], iterations=0)

    def _solve(
        self,
        space: Records,
        layered: bool,
        pose: HandPose,
        targets_m: FloatArray,
        weights: FloatArray,
        motion: MotionPrior | None,
        how: How,
    ) -> None:
        self._desk.put(0, pose, targets_m, weights, motion)
        self._desk.solve(space, layered, **how)
        self._desk.take(0, pose)

    def _space_for(self, subspace: Subspace) -> Records:
        if subspace is not self._space_of:
            self._space_of, self._space = subspace, _space(subspace)
        return self._space


def solve_hands(
    solvers: Sequence[HandSolver],
    poses: Sequence[HandPose],
    targets_m: Sequence[FloatArray],
    weights: Sequence[FloatArray],
    *,
    motions: Sequence[MotionPrior | None] | None = None,
    **how: Unpack[How],
) -> None:
    """`solve` for several hands in one compiled call, to the same bits.

    solvers: one per hand, which may be the same; poses, targets_m, weights and motions as there, one per hand.
    """
    desk = _desk_for(tuple(solvers))
    for i, pose in enumerate(poses):
        desk.put(i, pose, targets_m[i], weights[i], motions[i] if motions is not None else None)
    desk.solve(_wholes(len(solvers)), False, **how)
    for i, pose in enumerate(poses):
        desk.take(i, pose)


class _Desk:
    """Buffers for the hands of one compiled call, allocated once."""

    def __init__(self, hands: Records) -> None:
        self._hands = hands
        self._counts = [int(n) for n in hands["n_markers"]]
        self._tasks: Records = np.zeros(len(hands), kernels.TASK)
        self._tasks["joints_world"][..., 3, 3] = 1.0
        self._works: Records = np.zeros(len(hands), kernels.WORK)
        self._works["width"] = kernels.RIGHT + 1
        self._views = [_views(task, count) for task, count in zip(self._tasks, self._counts, strict=True)]
        self._scales, self._rms = self._tasks["scale"], self._tasks["rms_m"]

    def put(
        self, i: int, pose: HandPose, targets_m: FloatArray, weights: FloatArray, motion: MotionPrior | None
    ) -> None:
        view = self._views[i]
        view.theta[:] = pose.theta_rad
        self._scales[i] = pose.scale
        view.targets_m[:] = targets_m
        view.weights[:] = weights
        if motion is None:
            view.stiffness_m2[:] = 0.0
        else:
            view.expected_rad[:] = motion.expected_rad
            view.stiffness_m2[:] = motion.stiffness_m2

    def solve(
        self,
        spaces: Records,
        layered: bool,
        free_scale: bool = False,
        free_root: bool = True,
        iterations: int = 10,
        tolerance: float = 1e-4,
    ) -> None:
        kernels.solve(
            self._hands, WHOLE, spaces, self._tasks, self._works, layered, free_scale, free_root, iterations, tolerance
        )

    def take(self, i: int, pose: HandPose) -> None:
        view = self._views[i]
        pose.theta_rad[:] = view.theta
        pose.joints_world[:] = view.joints_world
        pose.markers_world_m[:] = view.markers_world_m
        pose.scale = float(self._scales[i])
        pose.rms_m = float(self._rms[i])

    def appraise(self, noise_m: float) -> Appraisal:
        kernels.uncertainty(self._hands, WHOLE, self._tasks, self._works, noise_m)
        view, task = self._views[0], self._tasks[0]
        return Appraisal(
            view.theta_std.copy(),
            view.marker_cov_m2.copy(),
            task["missed"].copy(),
            float(task["told"]),
            float(task["postural"]),
            float(task["unusual_m2"]),
        )

    def markers_by_digit(self, pose: HandPose, digit: int, angles_rad: FloatArray, out: FloatArray) -> None:
        kernels.markers_by_digit(self._hands, self._works, pose.theta_rad, pose.scale, digit, angles_rad, out)


@dataclass(frozen=True)
class _Views:
    """The arrays of one task, as far as its hand has markers."""

    theta: FloatArray
    targets_m: FloatArray
    weights: FloatArray
    expected_rad: FloatArray
    stiffness_m2: FloatArray
    joints_world: FloatArray
    markers_world_m: FloatArray
    theta_std: FloatArray
    marker_cov_m2: FloatArray


def _views(task: Any, count: int) -> _Views:
    return _Views(
        task["theta"], task["targets_m"][:count], task["weights"][:count], task["expected_rad"], task["stiffness_m2"],
        task["joints_world"], task["markers_world_m"][:count], task["theta_std"], task["marker_cov_m2"][:count],
    )  # fmt: skip


def _hand(skeleton: Skeleton, layout: MarkerLayout, prior: PosturePrior) -> Records:
    hands: Records = np.zeros(1, kernels.HAND)
    hand = hands[0]
    count = len(layout.joints)
    hand["offsets_m"] = rest_offsets(skeleton)
    hand["axes"] = skeleton.axes
    hand["limits_rad"] = skeleton.limits_rad
    hand["mean_rad"] = prior.mean_rad
    hand["precision_m2"] = prior.precision_m2
    hand["n_markers"] = count
    hand["marker_joints"][:count] = layout.joints
    hand["marker_locals_m"][:count] = layout.positions_m - skeleton.joint_positions_m[layout.joints]
    return hands


def _space(subspace: Subspace) -> Records:
    spaces: Records = np.zeros(1, kernels.SPACE)
    space, count = spaces[0], subspace.dimensions
    space["dimensions"] = count
    space["mean_rad"] = subspace.mean_rad
    space["basis"][:, :count] = subspace.basis
    space["stiffness_m2"][:count] = subspace_stiffness_m2(subspace)
    return spaces


_UNSEEN = np.zeros(MAX_MARKERS)


@lru_cache(maxsize=8)
def _desk_for(solvers: tuple[HandSolver, ...]) -> _Desk:
    return _Desk(np.concatenate([solver.hand for solver in solvers]))


@lru_cache(maxsize=8)
def _wholes(count: int) -> Records:
    return np.zeros(count, kernels.SPACE)
