"""From a frame as the server sends it to the record the engine takes: metres, Y up, every point once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.frames import NO_ID, FloatArray, IntArray, MarkerFrame, RigidBody, Times
from devices.natnet.records import FrameOfData, MarkerFlag

SAME_POINT_M = 1e-4
"""Two points closer than this are one, listed twice [m]; cameras do not part markers closer than some millimetres."""

MOST_IMAGES = 120
"""Of a second of SMPTE timecode."""

_ALL = "all"
_UNLABELLED = "unlabelled"
POINT_CHOICES = (_ALL, _UNLABELLED)

_NOT_SEEN = int(MarkerFlag.OCCLUDED)
_SOLVED = int(MarkerFlag.POINT_CLOUD_SOLVED | MarkerFlag.MODEL_SOLVED)
_MODEL_ONLY = int(MarkerFlag.MODEL_SOLVED)


class UpAxis(IntEnum):
    """The server's vertical axis, as it answers UpAxis."""

    X = 0
    Y = 1
    Z = 2


# Rows: our x, y, z in terms of the server's. Proper rotations, a third of a turn at most.
_TO_Y_UP: dict[UpAxis, tuple[tuple[int, int, int], tuple[float, float, float]]] = {
    UpAxis.X: ((1, 0, 2), (-1.0, 1.0, 1.0)),
    UpAxis.Z: ((0, 2, 1), (1.0, 1.0, -1.0)),
}


@dataclass(frozen=True)
class Conversion:
    """How a server's frames become ours.

    scale_m: metres per unit of the server. points: "all", or "unlabelled" for those of no rigid body.
    """

    up_axis: UpAxis = UpAxis.Y
    scale_m: float = 1.0
    points: str = _ALL

    def frame(self, frame: FrameOfData, times: Times, names: Mapping[int, str]) -> MarkerFrame:
        """The frame in metres, Y up. names: of rigid bodies, by id."""
        positions, ids, residuals = self._points(frame)
        bodies = self._bodies(frame, names)
        return MarkerFrame(frame.number, times, positions, ids, residuals, bodies, _timecode(frame))

    def _points(self, frame: FrameOfData) -> tuple[FloatArray, IntArray, FloatArray]:
        """What the cameras saw.

        From 3.0 on the labelled markers are all points of the frame, each with an id; the legacy list repeats
        some of them and is used only where the operator has switched labelled markers off. Before, the two lists
        complete one another and may overlap.
        """
        labelled = frame.labelled
        old = not frame.transmit_ticks
        params = labelled["params"]
        seen = ((params & _NOT_SEEN) == 0) & ((params & _SOLVED) != _MODEL_ONLY)
        if self.points == _UNLABELLED:
            seen &= (params & int(MarkerFlag.UNLABELLED | MarkerFlag.HAS_MODEL)) != int(MarkerFlag.HAS_MODEL)
        positions = labelled["position"]
        loose = frame.unlabelled
        if len(labelled) and len(loose):
            loose = loose[_apart(loose, positions, SAME_POINT_M / self.scale_m)] if old else loose[:0]
        kept = labelled[seen]
        with np.errstate(invalid="ignore"):  # what is no number is left out below
            xyz = np.concatenate((kept["position"], loose)).astype(np.float64)
        ids = np.concatenate((kept["id"].astype(np.int64), np.full(len(loose), NO_ID, np.int64)))
        residuals = np.concatenate((kept["residual"].astype(np.float64), np.full(len(loose), np.nan)))
        finite = np.isfinite(xyz).all(axis=1)
        if not finite.all():
            xyz, ids, residuals = xyz[finite], ids[finite], residuals[finite]
        return self._turn(xyz * self.scale_m), ids, residuals * self.scale_m

    def _turn(self, vectors: FloatArray) -> FloatArray:
        if self.up_axis is UpAxis.Y:
            return vectors
        axes, signs = _TO_Y_UP[self.up_axis]
        turned: FloatArray = vectors[..., axes] * np.array(signs)
        return turned

    def _bodies(self, frame: FrameOfData, names: Mapping[int, str]) -> tuple[RigidBody, ...]:
        return tuple(self._body(pose, names) for pose in frame.rigid_bodies.poses)

    def _body(self, pose: Any, names: Mapping[int, str]) -> RigidBody:
        """A body at rest in the server's axes stays at rest in ours: its own axes turn along with the world's."""
        identity = int(pose["id"])
        position = np.array(pose["position"], np.float64)
        quaternion = np.array(pose["orientation_xyzw"], np.float64)
        norm = float(np.linalg.norm(quaternion))
        valid = bool(np.isfinite(position).all() and np.isfinite(norm) and norm > 0.5)
        wxyz = np.array([1.0, 0.0, 0.0, 0.0])
        if valid:
            wxyz[0] = quaternion[3]
            wxyz[1:] = self._turn(quaternion[:3])
            wxyz /= norm
        else:
            position = np.zeros(3)
        return RigidBody(
            id=identity,
            name=names.get(identity, f"Rigid body {identity}"),
            position_m=self._turn(position * self.scale_m),
            quaternion_wxyz=wxyz,
            tracked=valid and bool(pose["params"] & 1),
            mean_error_m=float(pose["error"]) * self.scale_m,
        )


def _timecode(frame: FrameOfData) -> str:
    """SMPTE, "hh:mm:ss:ff"; "" where the server has none: it says 0 then, or what is no time."""
    hours, minutes, seconds, images = frame.timecode.to_bytes(4, "big")
    if not frame.timecode or hours >= 24 or minutes >= 60 or seconds >= 60 or images >= MOST_IMAGES:
        return ""
    return f"{hours:02}:{minutes:02}:{seconds:02}:{images:02}"


def _apart(points: NDArray[Any], others: NDArray[Any], distance: float) -> NDArray[np.bool_]:
    """(n,) bool: which of points (n, 3) are farther than `distance` from all others (m, 3)."""
    near: NDArray[np.bool_] = (np.abs(points[:, None] - others[None]) < distance).all(axis=2).any(axis=1)
    return ~near
