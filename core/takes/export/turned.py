"""Frames turned to Z up: x, y, z of a file are x, -z, y of the world."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Generic, TypeVar, overload

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import FloatArray, HandFrame, MarkerFrame, PropFrame, TrackedFrame

TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""(3, 3) rotation from Y up to Z up: 90 degrees about X."""

_TURN = np.eye(4)
_TURN[:3, :3] = TO_Z_UP
_ORDER = (0, 2, 1)  # of the world's axes along those of the file

T = TypeVar("T")


class Turned(Sequence[T], Generic[T]):
    """Frames, each turned when it is asked for; nothing is kept."""

    def __init__(self, frames: Sequence[T], turn: Callable[[T], T]) -> None:
        self._frames, self._turn = frames, turn

    def __len__(self) -> int:
        return len(self._frames)

    @overload
    def __getitem__(self, index: int) -> T: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[T]: ...

    def __getitem__(self, index: int | slice) -> T | Sequence[T]:
        if isinstance(index, slice):
            return Turned(self._frames[index], self._turn)
        return self._turn(self._frames[index])


def points_to_z_up(points_m: FloatArray) -> FloatArray:
    """(..., 3) float64, Y up, to the same with Z up: exact, for it only changes places and a sign."""
    turned: FloatArray = points_m[..., _ORDER] * (1.0, -1.0, 1.0)
    return turned


def solved_to_z_up(frame: TrackedFrame) -> TrackedFrame:
    """Every position and orientation in the world; angles of joints stay as they are."""
    return replace(frame, hands=tuple(map(_hand, frame.hands)), props=tuple(map(_prop, frame.props)))


def raw_to_z_up(frame: MarkerFrame) -> MarkerFrame:
    """Its points; rigid bodies are left out."""
    return replace(frame, points_m=points_to_z_up(frame.points_m), rigid_bodies=())


def _hand(hand: HandFrame) -> HandFrame:
    theta_rad, theta_std = hand.theta_rad.copy(), hand.theta_std.copy()
    theta_rad[:3] = points_to_z_up(theta_rad[:3])
    theta_rad[3:6] = (Rotation.from_matrix(TO_Z_UP) * Rotation.from_rotvec(theta_rad[3:6])).as_rotvec()
    for first in (0, 3):  # errors of position and of turning, along and about the world's axes
        theta_std[first : first + 3] = hand.theta_std[first : first + 3][list(_ORDER)]
    return replace(
        hand,
        theta_rad=theta_rad,
        theta_std=theta_std,
        joints_world=_TURN @ hand.joints_world,
        markers_world_m=points_to_z_up(hand.markers_world_m),
    )


def _prop(prop: PropFrame) -> PropFrame:
    return replace(
        prop,
        transform_world=_TURN @ prop.transform_world,
        markers_world_m=points_to_z_up(prop.markers_world_m),
    )
