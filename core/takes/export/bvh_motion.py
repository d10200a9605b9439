"""A BVH file read back and evaluated, as an importing program would: nothing in it is taken for granted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.frames import FloatArray
from core.takes.export.compare import mismatch

_AXES = {"X": 0, "Y": 1, "Z": 2}


@dataclass(frozen=True)
class BvhMotion:
    """Joints in the order of the file, end sites among them (named after their parent).

    offsets: (j, 3) float64. channels: of each joint, such as "Xposition". values: (t, c) float64, degrees.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: FloatArray
    channels: tuple[tuple[str, ...], ...]
    frame_time_s: float
    values: FloatArray

    def positions(self) -> FloatArray:
        """(t, j, 3) float64 in the file's unit, each joint in the world."""
        t = len(self.values)
        positions = np.zeros((t, len(self.names), 3))
        world = np.zeros((t, len(self.names), 3, 3))
        column = 0
        for joint, parent in enumerate(self.parents):
            moved = np.tile(self.offsets[joint], (t, 1))
            local = np.tile(np.eye(3), (t, 1, 1))
            for channel in self.channels[joint]:
                axis, values = _AXES[channel[0]], self.values[:, column]
                column += 1
                if channel[1:] == "position":
                    moved[:, axis] += values
                else:
                    local = local @ _rotations(axis, np.radians(values))
            if parent < 0:
                positions[:, joint], world[:, joint] = moved, local
            else:
                turned = np.einsum("tab,tb->ta", world[:, parent], moved)
                positions[:, joint] = positions[:, parent] + turned
                world[:, joint] = world[:, parent] @ local
        return positions


def read_bvh(path: Path) -> BvhMotion:
    """Raises ExportError where the file is not sound."""
    with path.open(encoding="utf-8") as stream:
        head, _, motion = stream.read().partition("MOTION")
    try:
        names, parents, offsets, channels = _hierarchy(head.split())
        frames, frame_time, rows = motion.strip().split("\n", 2)
        n_frames = int(frames.removeprefix("Frames:"))
        values = np.array(rows.split(), dtype=np.float64).reshape(n_frames, sum(map(len, channels)))
        frame_time_s = float(frame_time.removeprefix("Frame Time:"))
    except (ValueError, IndexError) as error:
        raise mismatch(path, f"it is not sound ({error})") from error
    return BvhMotion(tuple(names), tuple(parents), np.array(offsets), tuple(map(tuple, channels)), frame_time_s, values)


def _hierarchy(words: list[str]) -> tuple[list[str], list[int], list[list[float]], list[list[str]]]:
    names: list[str] = []
    parents: list[int] = []
    offsets: list[list[float]] = []
    channels: list[list[str]] = []
    open_joints: list[int] = []
    at = 1  # after HIERARCHY
    while at < len(words):
        word = words[at]
        if word in ("ROOT", "JOINT", "End"):
            parents.append(open_joints[-1] if open_joints else -1)
            names.append(f"{names[parents[-1]]} end" if word == "End" else words[at + 1])
            channels.append([])
            open_joints.append(len(names) - 1)
            at += 3  # the name or "Site", and the brace
        elif word == "OFFSET":
            offsets.append([float(value) for value in words[at + 1 : at + 4]])
            at += 4
        elif word == "CHANNELS":
            count = int(words[at + 1])
            channels[open_joints[-1]] = words[at + 2 : at + 2 + count]
            at += 2 + count
        elif word == "}":
            open_joints.pop()
            at += 1
        else:
            raise ValueError(f"unknown word {word!r}")
    if open_joints:
        raise ValueError("a brace is not closed")
    return names, parents, offsets, channels


def _rotations(axis: int, angles: FloatArray) -> FloatArray:
    """(t, 3, 3) about one axis."""
    cosine, sine = np.cos(angles), np.sin(angles)
    rotations = np.zeros((len(angles), 3, 3))
    rotations[:, axis, axis] = 1.0
    one, two = (axis + 1) % 3, (axis + 2) % 3
    rotations[:, one, one] = rotations[:, two, two] = cosine
    rotations[:, one, two], rotations[:, two, one] = -sine, sine
    return rotations
