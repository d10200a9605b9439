"""Our hand in Pinocchio: a free flyer and 20 revolute joints, a frame per marker; kinematics and Jacobians are its."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.peers.quaternion import quaternion, rotation_vector
from core.frames import FloatArray
from core.hand.skeleton import DOF_JOINTS, DOF_NAMES, JOINT_PARENTS, Skeleton
from core.markers.layout import MarkerLayout


class PinocchioHand:
    """What app.peers.lm asks of a hand. Raises ImportError."""

    def __init__(self, skeleton: Skeleton, layout: MarkerLayout) -> None:
        import pinocchio

        self._lib: Any = pinocchio
        model = self._model = pinocchio.Model()
        rest = skeleton.joint_positions_m
        carriers = {0: model.addJoint(0, pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity(), "wrist")}
        for d, j in enumerate(DOF_JOINTS):
            outer = j in carriers  # the second angle of a joint turns with the first
            offset = np.zeros(3) if outer else rest[j] - rest[JOINT_PARENTS[j]]
            carriers[j] = model.addJoint(
                carriers[j] if outer else carriers[JOINT_PARENTS[j]],
                pinocchio.JointModelRevoluteUnaligned(skeleton.axes[d]),
                pinocchio.SE3(np.eye(3), offset),
                DOF_NAMES[6 + d],
            )
        self._frames = [
            model.addFrame(
                pinocchio.Frame(
                    name,
                    carriers[int(j)],
                    0,
                    pinocchio.SE3(np.eye(3), position - rest[j]),
                    pinocchio.FrameType.OP_FRAME,
                )
            )
            for name, j, position in zip(layout.marker_names, layout.joints, layout.positions_m, strict=True)
        ]
        self._data = model.createData()
        self._kept = self._now = pinocchio.neutral(model)
        self._velocity = np.empty(26)
        self._order = np.r_[6:26, 0:6]

    def put(self, theta: FloatArray) -> None:
        """Take up a pose."""
        w, x, y, z = quaternion(theta[3:6])
        self._kept = np.concatenate([theta[:3], (x, y, z, w), theta[6:]])

    def moved(self, step: FloatArray) -> FloatArray:
        """The markers of the pose a step away from the one kept."""
        self._velocity[6:], self._velocity[:6] = step[:20], step[20:]
        self._now = self._lib.integrate(self._model, self._kept, self._velocity)
        self._lib.framesForwardKinematics(self._model, self._data, self._now)
        placements = self._data.oMf
        return np.array([placements[frame].translation for frame in self._frames])

    def keep(self) -> None:
        """Keep the pose last taken up."""
        self._kept = self._now

    def jacobian(self) -> FloatArray:
        """(3 m, 26) at the pose last taken up."""
        lib, model, data = self._lib, self._model, self._data
        lib.computeJointJacobians(model, data, self._now)
        aligned = lib.ReferenceFrame.LOCAL_WORLD_ALIGNED
        rows = [lib.getFrameJacobian(model, data, frame, aligned)[:3] for frame in self._frames]
        return np.concatenate(rows)[:, self._order]

    def theta(self) -> FloatArray:
        """(26,), the pose kept."""
        x, y, z, w = self._kept[3:7].tolist()
        return np.concatenate([self._kept[:3], rotation_vector(w, x, y, z), self._kept[7:]])
