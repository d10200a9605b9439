"""What files must hold, taken from the solved frames themselves and from nothing that writes files."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from core.frames import NO_POINT, BoolArray, FloatArray, HandFrame, HandKey, HandState, TrackedFrame
from core.hand.mirror import mirror_points, skin_hand
from core.hand.skeleton import JOINT_NAMES, JOINT_PARENTS, TIP_NAMES
from core.takes.export.options import DEFAULT, ExportOptions
from tests.acceptance.takes import N_FRAMES, RATE_HZ, Taken

LAST = [joint for joint in range(len(JOINT_NAMES)) if joint not in JOINT_PARENTS]
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
    every = [HandKey(k, side) for k, worn in enumerate(taken.kind.worn) for side in worn.sides]
    assert every, "a take without hands: nothing would be compared"
    return every


def tracked_hands(taken: Taken) -> list[HandKey]:
    """Those that are tracked in any frame."""
    tracked = [key for key in hands(taken) if any(one is not None for one in each(taken, key))]
    assert tracked, "a take in which no hand is tracked: nothing would be compared"
    return tracked


def prefix(taken: Taken, key: HandKey) -> str:
    """Before the name of a marker or joint."""
    name = subject(taken, key.performer)
    return (f"{name}:" if name else "") + f"{key.side[0].upper()}_"


def each(taken: Taken, key: HandKey) -> list[HandFrame | None]:
    """One hand in every solved frame; None where it is not tracked."""
    return [_hand(frame, key) for frame in taken.solution.solved]


def _hand(frame: TrackedFrame, key: HandKey) -> HandFrame | None:
    return next((h for h in frame.hands if h.key == key and h.state is HandState.TRACKED), None)


def _held(taken: Taken, key: HandKey) -> list[HandFrame]:
    """One hand in every solved frame, the last pose held where it is not tracked, before the first the first."""
    frames = each(taken, key)
    held: list[HandFrame] = []
    for one in frames:
        held.append(one or (held[-1] if held else next(first for first in frames if first is not None)))
    return held


def markers(taken: Taken, options: ExportOptions = DEFAULT) -> Markers:
    """Markers of hands, of props, and the joint centres and fingertips, as far as the options ask for them."""
    labels: list[str] = []
    columns: list[FloatArray] = []
    measured: list[BoolArray] = []

    def add(names: Sequence[str], frames: Iterable[tuple[FloatArray, BoolArray] | None]) -> None:
        points, seen = np.full((N_FRAMES, len(names), 3), np.nan), np.zeros((N_FRAMES, len(names)), dtype=bool)
        for i, one in zip(taken.kind.there, frames, strict=True):
            if one is not None:
                points[i], seen[i] = one
        if options.measured and not names[0].endswith("_joint"):
            points[~seen] = np.nan
        labels.extend(names)
        columns.append(points)
        measured.append(seen)

    for key in hands(taken):
        names = [prefix(taken, key) + name for name in taken.kind.worn[key.performer].layout.marker_names]
        add(names, [None if h is None else (h.markers_world_m, h.point != NO_POINT) for h in each(taken, key)])
    for prop in taken.kind.worn[0].props:
        found = [next((p for p in f.props if p.name == prop.name and p.tracked), None) for f in taken.solution.solved]
        add(prop.marker_names, [None if p is None else (p.markers_world_m, p.point != NO_POINT) for p in found])
    for key in hands(taken) if options.joints else ():
        names = [f"{prefix(taken, key)}{name}_joint" for name in (*JOINT_NAMES, *TIP_NAMES)]
        seen = np.zeros(len(names), dtype=bool)
        add(names, [None if h is None else (with_ends(taken, h), seen) for h in each(taken, key)])
    every = 1 if options.rate_hz is None else round(RATE_HZ / options.rate_hz)
    points_m = np.concatenate(columns, axis=1)[::every]
    return Markers(tuple(labels), turned(points_m, options), np.concatenate(measured, axis=1)[::every])


def turned(points_m: FloatArray, options: ExportOptions) -> FloatArray:
    """(..., 3) of the world, Y up, in the axes of a file."""
    x, y, z = np.moveaxis(points_m, -1, 0)
    return points_m if options.up == "y" else np.stack([x, -z, y], axis=-1)


def _ends(taken: Taken, hand: HandFrame) -> FloatArray:
    """(5, 3) [m], the fingertips of a tracked hand."""
    rest = taken.kind.worn[hand.performer].hand.skeleton
    bones = rest.tip_positions_m - rest.joint_positions_m[LAST]
    if hand.side == "left":
        bones = mirror_points(bones)
    last = hand.joints_world[LAST]
    ends: FloatArray = last[:, :3, 3] + hand.scale * np.einsum("dab,db->da", last[:, :3, :3], bones)
    return ends


def with_ends(taken: Taken, hand: HandFrame) -> FloatArray:
    """(21, 3) [m], the joints of a tracked hand and then its fingertips."""
    return np.concatenate([hand.joints_world[:, :3, 3], _ends(taken, hand)])


@dataclass(frozen=True)
class Skeleton:
    """A hand in every solved frame, Y up, the last pose held where it is not tracked, before the first the first.

    joints_m: (t, 16, 3), turns: (t, 16, 3, 3), as they were solved. ends_m: (t, 5, 3), of the digits. sizes: (t,), in
    parts of the last.
    """

    prefix: str
    joints_m: FloatArray
    turns: FloatArray
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
        """Joints and fingertips by name, (t, 3) [m], as they were solved."""
        points = np.concatenate([self.joints_m, self.ends_m], axis=1)
        return {self.prefix + name: points[:, j] for j, name in enumerate((*JOINT_NAMES, *TIP_NAMES))}


def skeleton(taken: Taken, key: HandKey) -> Skeleton:
    """Of a hand that is tracked in any frame."""
    held = _held(taken, key)
    scales = np.array([one.scale for one in held])
    joints = np.array([one.joints_world for one in held])
    ends_m = np.array([_ends(taken, one) for one in held])
    return Skeleton(prefix(taken, key), joints[:, :, :3, 3], joints[:, :, :3, :3], ends_m, scales / held[-1].scale)


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
    """A joint as BVH has it, where colons part the names of three.js."""
    return name.replace(":", "_")


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


def held(taken: Taken, key: HandKey) -> list[tuple[int, int, str]]:
    """From which frame up to which other, on the even grid from 0, a hand's pose is held, and why."""
    tracked = {i: one is not None for i, one in zip(taken.kind.there, each(taken, key), strict=True)}
    first = min(i for i, there in tracked.items() if there)
    spans: list[tuple[int, int, str]] = []
    for i in range(N_FRAMES):
        why = "" if tracked.get(i) else "no frames" if i not in tracked else "not found yet" if i < first else "lost"
        if spans and spans[-1][1:] == (i, why):
            spans[-1] = (spans[-1][0], i + 1, why)
        elif why:
            spans.append((i, i + 1, why))
    return spans


def hand_words(taken: Taken, key: HandKey) -> str:
    """ "left hand", "Anna Lena left hand"."""
    if len(taken.kind.worn) == 1:
        return f"{key.side} hand"
    return f"{taken.kind.worn[key.performer].performer or key.performer + 1} {key.side} hand"
