"""Our hand in MuJoCo: a free body and 20 hinges, a site per marker; kinematics and Jacobians are MuJoCo's."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np

from app.peers.quaternion import quaternion, rotation_vector
from core.frames import FloatArray
from core.hand.skeleton import DOF_JOINTS, DOF_NAMES, JOINT_NAMES, JOINT_PARENTS, Skeleton
from core.markers.layout import MarkerLayout


def mjcf(skeleton: Skeleton, layout: MarkerLayout) -> str:
    """The hand as MuJoCo's XML: joint 0 free, then the angles in the order of DOF_NAMES, then markers as sites."""
    root = ElementTree.Element("mujoco")
    ElementTree.SubElement(root, "compiler", angle="radian")
    bodies = {-1: ElementTree.SubElement(root, "worldbody")}
    rest = skeleton.joint_positions_m
    for j, (name, parent) in enumerate(zip(JOINT_NAMES, JOINT_PARENTS, strict=True)):
        offset = rest[j] - rest[parent] if j else rest[j]
        body = bodies[j] = ElementTree.SubElement(bodies[parent], "body", name=name, pos=_numbers(offset))
        if j == 0:
            ElementTree.SubElement(body, "freejoint")
        for d in np.flatnonzero(np.asarray(DOF_JOINTS) == j):
            ElementTree.SubElement(body, "joint", name=DOF_NAMES[6 + d], axis=_numbers(skeleton.axes[d]))
        ElementTree.SubElement(body, "inertial", pos="0 0 0", mass="1", diaginertia="1 1 1")
    for name, j, position in zip(layout.marker_names, layout.joints, layout.positions_m, strict=True):
        ElementTree.SubElement(bodies[int(j)], "site", name=name, pos=_numbers(position - rest[j]))
    return ElementTree.tostring(root, encoding="unicode")


class MujocoHand:
    """What app.peers.lm asks of a hand. Raises ImportError."""

    def __init__(self, skeleton: Skeleton, layout: MarkerLayout) -> None:
        import mujoco

        self._lib: Any = mujoco
        self._model = mujoco.MjModel.from_xml_string(mjcf(skeleton, layout))
        self._data = mujoco.MjData(self._model)
        site = mujoco.mjtObj.mjOBJ_SITE
        self._sites = [mujoco.mj_name2id(self._model, site, name) for name in layout.marker_names]
        self._kept = self._data.qpos.copy()
        self._velocity = np.empty(26)
        self._full = np.empty((3 * len(self._sites), 26))
        self._rows = [self._full[3 * i : 3 * i + 3] for i in range(len(self._sites))]
        self._order = np.r_[6:26, 0:6]

    def put(self, theta: FloatArray) -> None:
        """Take up a pose."""
        self._kept[:3], self._kept[7:] = theta[:3], theta[6:]
        self._kept[3:7] = quaternion(theta[3:6])

    def moved(self, step: FloatArray) -> FloatArray:
        """The markers of the pose a step away from the one kept."""
        self._velocity[6:], self._velocity[:6] = step[:20], step[20:]
        qpos = self._data.qpos
        qpos[:] = self._kept
        self._lib.mj_integratePos(self._model, qpos, self._velocity, 1.0)
        self._lib.mj_kinematics(self._model, self._data)
        return self._data.site_xpos[self._sites]

    def keep(self) -> None:
        """Keep the pose last taken up."""
        self._kept[:] = self._data.qpos

    def jacobian(self) -> FloatArray:
        """(3 m, 26) at the pose last taken up."""
        jacobian, model, data = self._lib.mj_jacSite, self._model, self._data
        self._lib.mj_comPos(model, data)
        for site, rows in zip(self._sites, self._rows, strict=True):
            jacobian(model, data, rows, None, site)
        return self._full[:, self._order]

    def theta(self) -> FloatArray:
        """(26,), the pose kept."""
        kept = self._kept
        return np.concatenate([kept[:3], rotation_vector(*kept[3:7].tolist()), kept[7:]])


def _numbers(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)
