"""What files must hold, taken from the solved frames themselves and from nothing that writes files."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from core.frames import NO_POINT, BoolArray, FloatArray, HandFrame, HandKey, HandState, TrackedFrame
from core.hand.mirror import mirror_points, skin_hand
from core.hand.skeleton import JOINT_NAMES, JOINT_PARENTS
from tests.acceptance.takes import N_FRAMES, RATE_HZ, Taken

N_JOINTS = len(JOINT_NAMES)
LAST = [joint for joint in range(N_JOINTS) if joint not in JOINT_PARENTS]
"""Of each digit, thumb to pinky."""


@dataclass(frozen=True)
class Markers:
    """On the even grid of C3D and TRC. points_m: (t, m, 3), NaN where there is none. measured: (t, m)."""

    labels: tuple[str, ...]
    points_m: FloatArray
    measured: BoolArray


def subject(taken: Taken, performer: int) -> str:
    """What stands before the names of a performer's joints and markers."""
    if len(taken.kind.worn) == 1:
        return ""
    return taken.kind.worn[performer].performer.replace(" ", "_") or str(performer + 1)


def hands(taken: Taken) -> list[HandKey]:
    """Every hand that profiles have."""
    return [HandKey(k, side) for k, worn in enumerate(taken.kind.worn) for side in worn.sides]


def tracked_hands(taken: Taken) -> list[HandKey]:
    """Those that are tracked in any frame."""
    return [key for key in hands(taken) if any(one is not None for one in _each(taken, key))]


def prefix(taken: Taken, key: HandKey) -> str:
    """Before the name of a marker or joint."""
    name = subject(taken, key.performer)
    return (f"{name}:" if name else "") + f"{key.side[0].upper()}_"


def _each(taken: Taken, key: HandKey) -> list[HandFrame | None]:
    """One hand in every solved frame; None where it is not tracked."""
    return [_hand(frame, key) for frame in taken.solution.solved]


def _hand(frame: TrackedFrame, key: HandKey) -> HandFrame | None:
    return next((h for h in frame.hands if h.key == key and h.state is HandState.TRACKED), None)


def _held(taken: Taken, key: HandKey) -> list[HandFrame]:
    """One hand in every solved frame, the last pose held where it is not tracked, before the first the first."""
    frames = _each(taken, key)
    held: list[HandFrame] = []
    for one in frames:
        held.append(one or (held[-1] if held else next(first for first in frames if first is not None)))
    return held


def markers(taken: Taken, joints: bool = False) -> Markers:
    """Markers of hands, of props, and the joint centres if asked for."""
    labels: list[str] = []
    columns: list[FloatArray] = []
    measured: list[BoolArray] = []

    def add(names: Iterable[str], n: int, frames: Iterable[tuple[FloatArray, BoolArray] | None]) -> None:
        points, seen = np.full((N_FRAMES, n, 3), np.nan), np.zeros((N_FRAMES, n), dtype=bool)
        for i, one in zip(taken.kind.there, frames, strict=True):
            if one is not None:
                points[i], seen[i] = one
        labels.extend(names)
        columns.append(points)
        measured.append(seen)

    for key in hands(taken):
        layout = taken.kind.worn[key.performer].layout
        add(
            [prefix(taken, key) + name for name in layout.marker_names],
            len(layout.marker_names),
            [None if h is None else (h.markers_world_m, h.point != NO_POINT) for h in _each(taken, key)],
        )
    for prop in taken.kind.worn[0].props:
        found = [next((p for p in f.props if p.name == prop.name and p.tracked), None) for f in taken.solution.solved]
        add(
            prop.marker_names,
            len(prop.markers_m),
            [None if p is None else (p.markers_world_m, p.point != NO_POINT) for p in found],
        )
    if joints:
        for key in hands(taken):
            add(
                [f"{prefix(taken, key)}{name}_joint" for name in JOINT_NAMES],
                N_JOINTS,
                [
                    None if h is None else (h.joints_world[:, :3, 3], np.zeros(N_JOINTS, dtype=bool))
                    for h in _each(taken, key)
                ],
            )
    return Markers(tuple(labels), np.concatenate(columns, axis=1), np.concatenate(measured, axis=1))


@dataclass(frozen=True)
class Skeleton:
    """A hand in every solved frame, the last pose held where it is not tracked, before the first the first.

    joints_m: (t, 16, 3), as they were solved. ends_m: (t, 5, 3), of the digits. sizes: (t,), in parts of the last.
    """

    prefix: str
    joints_m: FloatArray
    ends_m: FloatArray
    sizes: FloatArray

    @property
    def rigid(self) -> dict[str, FloatArray]:
        """Joints and ends of the digits by name, (t, 3) [m], as of a skeleton whose bones keep the size found last."""
        wrist = self.joints_m[:, :1]
        points = wrist + (np.concatenate([self.joints_m, self.ends_m], axis=1) - wrist) / self.sizes[:, None, None]
        names = [*JOINT_NAMES, *(f"{JOINT_NAMES[joint]} end" for joint in LAST)]
        return {self.prefix + name: points[:, j] for j, name in enumerate(names)}

    @property
    def solved(self) -> dict[str, FloatArray]:
        """Joints by name, (t, 3) [m], as they were solved."""
        return {self.prefix + name: self.joints_m[:, j] for j, name in enumerate(JOINT_NAMES)}


def skeleton(taken: Taken, key: HandKey) -> Skeleton:
    """Of a hand that is tracked in any frame."""
    held = _held(taken, key)
    joints_m = np.array([one.joints_world[:, :3, 3] for one in held])
    turns = np.array([one.joints_world[:, :3, :3] for one in held])
    rest = taken.kind.worn[key.performer].hand.skeleton
    bones = rest.tip_positions_m - rest.joint_positions_m[LAST]
    if key.side == "left":
        bones = mirror_points(bones)
    scales = np.array([one.scale for one in held])
    ends_m = joints_m[:, LAST] + scales[:, None, None] * np.einsum("tdab,db->tda", turns[:, LAST], bones)
    return Skeleton(prefix(taken, key), joints_m, ends_m, scales / held[-1].scale)


def on_the_grid(taken: Taken, values: FloatArray) -> FloatArray:
    """Values of solved frames (t, ...), held over places of the grid that no frame has."""
    there = np.array(taken.kind.there)
    at = np.searchsorted(there, np.arange(there[-1] + 1), side="right") - 1
    return values[at]


def at_keys(taken: Taken, values: FloatArray, times_s: FloatArray) -> FloatArray:
    """Values of solved frames (t, ...) at times [s] of keys; between two frames far apart the earlier is held."""
    own_s = np.array(taken.kind.there) / RATE_HZ
    at = np.searchsorted(own_s, times_s + 1e-4, side="right") - 1
    return values[at]


def bvh_name(name: str) -> str:
    """A joint as BVH has it."""
    return name


def surface_name(taken: Taken, key: HandKey) -> str:
    """Of a hand's mesh: "left surface", "Anna Lena left surface"."""
    if len(taken.kind.worn) == 1:
        return f"{key.side} surface"
    return f"{taken.kind.worn[key.performer].performer or key.performer + 1} {key.side} surface"


def surface(taken: Taken, key: HandKey, times_s: FloatArray) -> FloatArray:
    """(t, v, 3) [m], the hand's surface in the world at these times [s], the pose held where it is not tracked."""
    hand = taken.kind.worn[key.performer].hand
    held = _held(taken, key)
    index = np.arange(len(held))
    return np.array(
        [
            skin_hand(hand.scaled(held[i].scale), key.side, held[i].joints_world)
            for i in at_keys(taken, index, times_s).tolist()
        ]
    )
