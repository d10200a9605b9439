"""What an error of the hand's measures and marker places makes of the angles that are solved with them.

A pose minimises sum w |x - t|^2 + (a - mean)^T P (a - mean). Where it does, an error df of what all frames share moves
it, to first order, by

    d theta = G df,    G = -(J^T W J + P)^-1 J^T W (d markers / d f)

(implicit differentiation of the gradient; the Gauss-Newton part of it, as the solver's). With the covariance C of f
the pose's is G C G^T. It is the same error in every frame of one posture: no mean over frames takes it away.
"""

from __future__ import annotations

import numpy as np

from core.calibration.geometry import Estimate, WornHand
from core.calibration.priors import fixed_covariance
from core.frames import FloatArray
from core.guesses import POINT_NOISE_M
from core.hand.model import template
from core.hand.shape import N_SHAPE
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS
from core.kinematics.kernels import FAR_M, SCALE_M2
from core.kinematics.prior import posture_prior
from core.profile import Profile


class Carrier:
    """Of one performer, as the hand is tracked (core.track.tracking_solver: its prior and its weights).

    covariance: (n, n) float64, of what all frames share, n = 23 + 3 m, in the order and the units of FixedCovariance.
    """

    def __init__(self, profile: Profile) -> None:
        self.covariance = fixed_covariance(profile)
        self._log_ratios = np.log(profile.shape.ratios)
        self._hand = WornHand(template().skeleton, profile.layout.joints, profile.layout.positions_m)
        self._prior_m2 = np.zeros((N_DOFS + 1, N_DOFS + 1))
        angles = slice(N_ROOT_DOFS, N_DOFS)
        self._prior_m2[angles, angles] = posture_prior(profile.subspace, noise_m=POINT_NOISE_M).precision_m2
        # So that the equations can be solved where hardly a marker is seen; anywhere else it is nothing.
        root = np.arange(N_ROOT_DOFS)
        self._prior_m2[root, root] = (POINT_NOISE_M / FAR_M) ** 2
        self._prior_m2[N_DOFS, N_DOFS] = SCALE_M2

    def carried(
        self, thetas_rad: FloatArray, scales: FloatArray, weights: FloatArray, *, free_scale: bool = False
    ) -> FloatArray:
        """G (f, 26, n) float64: by how much the parameters of each solved pose change [m, rad] per change of what all
        frames share [1, m]; of the wrist's rotation, about the world's axes.

        thetas_rad: (f, 26), right hands (or mirrored ones). scales: (f,). weights: (f, m), of the markers, 0 where one
        has no point. free_scale: the size is solved with each pose; (f, 27, n), last the logarithm of the scale.
        """
        f, m = weights.shape
        at = Estimate.of_poses(thetas_rad, self._log_ratios, m)
        placed = self._hand.place(at)
        by_pose, by_shared = self._hand.jacobians(at, placed)
        # All but the root's place grows with the size.
        by_pose[..., 3:] *= scales[:, None, None, None]
        by_shared *= scales[:, None, None, None]
        if free_scale:
            grown = scales[:, None, None] * (placed.markers_m - at.roots_m[:, None])
            by_pose = np.concatenate([by_pose, grown[..., None]], axis=3)
        count = by_pose.shape[-1]
        by_pose, by_shared = by_pose.reshape(f, 3 * m, count), by_shared.reshape(f, 3 * m, -1)
        weighted = (np.repeat(weights, 3, axis=1)[..., None] * by_pose).swapaxes(1, 2)
        normal = weighted @ by_pose + self._prior_m2[:count, :count]
        return np.asarray(-np.linalg.solve(normal, weighted @ by_shared), dtype=np.float64)

    def sized(self, carried: FloatArray) -> FloatArray:
        """`covariance` where the size is found from the motion and then is the same in all frames.

        carried: (f, 27, n), as with a free scale, of frames that it was found in. A wrong measure is then partly taken
        up by the size: what is left of it is (1 + u h^T) df, u being one for each ratio, h the mean way of the size.
        """
        left = np.eye(self._hand.n_shared)
        left[:N_SHAPE] += carried[:, N_DOFS].mean(axis=0)
        known: FloatArray = left @ self.covariance @ left.T
        return known


def fixed_std(carried: FloatArray, covariance: FloatArray) -> FloatArray:
    """(f, p) float64 [m, rad], one standard deviation of each parameter. carried: (f, p, n), covariance (n, n)."""
    variance = np.einsum("fpn,fpn->fp", carried @ covariance, carried)
    std: FloatArray = np.sqrt(np.maximum(variance, 0.0))
    return std
