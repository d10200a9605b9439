"""Forward kinematics of many poses of one hand at once, and its derivatives by pose, shape and marker places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import FloatArray, IntArray
from core.hand.shape import N_SHAPE, HandShape, bone_maps
from core.hand.skeleton import DOF_JOINTS, JOINT_PARENTS, N_DOFS, N_JOINTS, N_ROOT_DOFS, Skeleton

N_ANGLES = N_DOFS - N_ROOT_DOFS


@dataclass(frozen=True)
class Estimate:
    """Where the parameters stand.

    roots_m (f, 3), turns (f, 3, 3), angles_rad (f, 20): the pose of each shot. log_shape (23,). moved_m (m, 3): each
    marker's displacement on the template.
    """

    roots_m: FloatArray
    turns: FloatArray
    angles_rad: FloatArray
    log_shape: FloatArray
    moved_m: FloatArray

    @classmethod
    def of_poses(cls, thetas_rad: FloatArray, log_shape: FloatArray, n_markers: int) -> Estimate:
        """Markers where the layout has them. thetas_rad: (f, 26)."""
        turns = Rotation.from_rotvec(thetas_rad[:, 3:6]).as_matrix()
        return cls(thetas_rad[:, :3].copy(), turns, thetas_rad[:, 6:].copy(), log_shape, np.zeros((n_markers, 3)))

    @property
    def thetas_rad(self) -> FloatArray:
        """(f, 26) float64."""
        vectors = Rotation.from_matrix(self.turns).as_rotvec()
        return np.concatenate([self.roots_m, vectors, self.angles_rad], axis=1)

    @property
    def shape(self) -> HandShape:
        """The hand's."""
        return HandShape(np.exp(self.log_shape))


@dataclass(frozen=True)
class Placed:
    """The model at an estimate. markers_m (f, m, 3), rotations (f, 16, 3, 3), joints_m (f, 16, 3), axes (f, 20, 3)."""

    markers_m: FloatArray
    rotations: FloatArray
    joints_m: FloatArray
    axes: FloatArray


class WornHand:
    """How one performer's hand makes markers of a pose, of its measures and of where the markers sit.

    joints (m,) int64 and places_m (m, 3) [m]: the layout on the template `skeleton`. What all frames share, in this
    order: the 23 log ratios of the shape, then the displacement of every marker on the template [m].
    """

    def __init__(self, skeleton: Skeleton, joints: IntArray, places_m: FloatArray) -> None:
        self.skeleton, self.joints, self.places_m = skeleton, joints, places_m
        none = np.zeros(N_SHAPE)
        # The maps are linear in the ratios: what one ratio does is the map of that ratio alone.
        self._map_rates = np.stack([bone_maps(skeleton, HandShape(none + unit)) for unit in np.eye(N_SHAPE)])
        self._touches = [(i, int(j)) for i in range(N_SHAPE) for j in np.flatnonzero(self._map_rates[i].any((1, 2)))]
        self._offsets_m = skeleton.joint_positions_m.copy()
        self._offsets_m[1:] -= skeleton.joint_positions_m[list(JOINT_PARENTS[1:])]
        dof_joints = np.asarray(DOF_JOINTS)
        digits, joint_digits = (dof_joints - 1) // 3, (joints - 1) // 3
        self._turned = (joints > 0)[:, None] & (joint_digits[:, None] == digits) & (joints[:, None] >= dof_joints)

    @property
    def n_shared(self) -> int:
        """Shape and marker parameters."""
        return N_SHAPE + 3 * len(self.joints)

    def place(self, at: Estimate) -> Placed:
        """Forward kinematics of every shot."""
        maps, n = bone_maps(self.skeleton, at.shape), len(at.roots_m)
        rotations, joints_m = np.empty((n, N_JOINTS, 3, 3)), np.empty((n, N_JOINTS, 3))
        axes = np.empty((n, N_ANGLES, 3))
        rotations[:, 0], joints_m[:, 0] = at.turns, at.roots_m
        dof = 0
        for j in range(1, N_JOINTS):
            parent = JOINT_PARENTS[j]
            joints_m[:, j] = joints_m[:, parent] + rotations[:, parent] @ (maps[parent] @ self._offsets_m[j])
            turn = rotations[:, parent]
            while dof < N_ANGLES and DOF_JOINTS[dof] == j:
                axis = self.skeleton.axes[dof]
                axes[:, dof] = turn @ axis
                turn = turn @ Rotation.from_rotvec(at.angles_rad[:, dof, None] * axis).as_matrix()
                dof += 1
            rotations[:, j] = turn
        local = np.einsum("mab,mb->ma", maps[self.joints], self._arms_m(at))
        markers_m = joints_m[:, self.joints] + np.einsum("fmab,mb->fma", rotations[:, self.joints], local)
        return Placed(markers_m, rotations, joints_m, axes)

    def _arms_m(self, at: Estimate) -> FloatArray:
        """(m, 3) float64 [m], each marker from its joint on the template."""
        arms: FloatArray = self.places_m + at.moved_m - self.skeleton.joint_positions_m[self.joints]
        return arms

    def jacobians(self, at: Estimate, placed: Placed) -> tuple[FloatArray, FloatArray]:
        """Of the markers by the pose (f, m, 3, 26) and by what all shots share (f, m, 3, 23 + 3 m).

        The root turns by a small world rotation before the present one; the shape by the log ratios.
        """
        f, m = placed.markers_m.shape[:2]
        by_pose, by_shared = np.zeros((f, m, 3, N_DOFS)), np.zeros((f, m, 3, self.n_shared))
        by_pose[..., :3] = np.eye(3)
        away = placed.markers_m - at.roots_m[:, None]
        for a, (b, c) in enumerate(((1, 2), (2, 0), (0, 1))):  # unit vector a cross (x - root)
            by_pose[..., b, 3 + a], by_pose[..., c, 3 + a] = -away[..., c], away[..., b]
        markers, dofs = np.nonzero(self._turned)
        arms = placed.markers_m[:, markers] - placed.joints_m[:, np.asarray(DOF_JOINTS)[dofs]]
        by_pose[:, markers, :, N_ROOT_DOFS + dofs] = np.cross(placed.axes[:, dofs], arms).swapaxes(0, 1)

        ratios, chain_m = np.exp(at.log_shape), self._chain_m(at)
        for i, j in self._touches:
            reach = ratios[i] * chain_m[:, j] @ self._map_rates[i, j].T  # (m, 3), in the frame of bone j
            by_shared[..., i] += np.einsum("fab,mb->fma", placed.rotations[:, j], reach)
        own = placed.rotations[:, self.joints] @ bone_maps(self.skeleton, at.shape)[self.joints]
        for k in range(m):
            by_shared[:, k, :, N_SHAPE + 3 * k : N_SHAPE + 3 * k + 3] = own[:, k]
        return by_pose, by_shared

    def _chain_m(self, at: Estimate) -> FloatArray:
        """(m, 16, 3) float64 [m]: of each bone on the way from the wrist to a marker, its part of the way, template."""
        chain = np.zeros((len(self.joints), N_JOINTS, 3))
        chain[np.arange(len(self.joints)), self.joints] = self._arms_m(at)
        for k, joint in enumerate(self.joints):
            while joint > 0:
                parent = JOINT_PARENTS[joint]
                chain[k, parent] = self._offsets_m[joint]
                joint = parent
        return chain
