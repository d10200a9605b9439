"""Inverse kinematics of one hand: labelled points in, pose out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import FloatArray
from core.hand.skeleton import N_DOFS, N_JOINTS, N_ROOT_DOFS, Skeleton
from core.kinematics import kernels
from core.kinematics.forward import rest_offsets
from core.markers.layout import MarkerLayout

DIP_PER_PIP = 2.0 / 3.0
"""Flexion of a finger's last joint per flexion of its middle one (Rijpkema & Girard 1991, section 3)."""

COUPLING_M2_PER_RAD2 = 0.004**2
"""An end joint one radian off its coupling weighs as much as a point 4 mm off."""

REST_M2_PER_RAD2 = 0.0006**2
"""What no marker sees drifts to the rest pose; too weak to bend what one sees."""

SCALE_M2 = 0.01**2
"""A hand larger by a factor e weighs as much as a point 10 mm off: points decide, not this."""


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


class HandSolver:
    """Levenberg-Marquardt on 26 parameters within the joint limits, for one skeleton and layout."""

    def __init__(self, skeleton: Skeleton, layout: MarkerLayout) -> None:
        self.skeleton = skeleton
        self.layout = layout
        self._offsets = rest_offsets(skeleton)
        self._axes = np.ascontiguousarray(skeleton.axes)
        self._limits = np.ascontiguousarray(skeleton.limits_rad)
        self._locals = np.ascontiguousarray(layout.positions_m - skeleton.joint_positions_m[layout.joints])
        self._joints = np.ascontiguousarray(layout.joints)
        self._rest = np.zeros(N_DOFS - N_ROOT_DOFS)
        self._stiffness = np.full(N_DOFS - N_ROOT_DOFS, REST_M2_PER_RAD2)

    def solve(
        self,
        pose: HandPose,
        targets_m: FloatArray,
        weights: FloatArray,
        *,
        free_scale: bool = False,
        iterations: int = 10,
        tolerance: float = 1e-4,
    ) -> None:
        """Move `pose` to explain the points.

        targets_m: (m, 3) float64 [m], a point for each marker of the layout. weights: (m,) float64, 0 where a
        marker has no point. The present pose is the start; with `free_scale` the hand's size is solved too.
        """
        pose.scale, pose.rms_m, _ = kernels.solve(
            pose.theta_rad, pose.scale, free_scale, targets_m, weights, self._offsets, self._axes, self._limits,
            self._joints, self._locals, self._rest, self._stiffness, DIP_PER_PIP, COUPLING_M2_PER_RAD2,
            1.0, SCALE_M2, iterations, tolerance, pose.joints_world, pose.markers_world_m,
        )  # fmt: skip

    def markers_by_digit(self, pose: HandPose, digit: int, angles_rad: FloatArray) -> FloatArray:
        """(n, m, 3) float64 [m]: where the markers were if `digit` (0..4) took each of the shapes (n, 4) [rad]."""
        out = np.empty((len(angles_rad), len(self._joints), 3))
        kernels.markers_by_digit(
            pose.theta_rad, pose.scale, self._offsets, self._axes, self._joints, self._locals, digit, angles_rad, out
        )
        return out

    def place(self, pose: HandPose) -> None:
        """Write the joints and markers of `pose` from its parameters alone."""
        self.solve(pose, pose.markers_world_m, np.zeros(len(self._joints)), iterations=0)
