"""BVH: a skeleton and its motion, as inertial gloves and suits write it, and Phalanx when it exports.

A joint's channels turn it in the order in which the file lists them, each about the axes that the ones before have
turned: R = R1 R2 R3. Position channels stand in place of the joint's OFFSET and are not added to it: Perception Neuron
writes both, nearly equal, and Blender reads them so. Lengths are in a unit that no BVH file names.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import FloatArray
from core.takes.formats.assemble import check_size
from core.takes.formats.clock import FASTEST_HZ
from core.takes.formats.text import TextLines, decode_head, read_table
from core.takes.stream_text import MOST_BONES
from core.untrusted.files import open_file

START = "HIERARCHY"
_HEAD_BYTES = 1 << 10
_AXES = {"X": 0, "Y": 1, "Z": 2}
_CHANNELS = frozenset(f"{axis}{what}" for axis in _AXES for what in ("position", "rotation"))
_LONGEST_FRAME_S = 60.0
_DIGITS = re.compile("[0-9]{1,15}")


def recognises(text: str) -> bool:
    """Whether a file's start is that of a BVH file."""
    return text.lstrip()[: len(START)].upper() == START


def is_bvh(path: Path) -> bool:
    """Whether a file is one by how it begins. False where it cannot be read."""
    try:
        with open_file(path) as stream:
            return recognises(decode_head(stream.read(_HEAD_BYTES)))
    except OSError:
        return False


@dataclass(frozen=True)
class BvhMotion:
    """Joints in the order of the file, end sites among them (named after their parent).

    parents: of each joint, -1 of a root; always before their children. offsets: (j, 3) float64 in the file's unit.
    channels: of each joint, such as "Xposition"; () of an end site. values: (t, c) float64, all channels in that order,
    degrees and the file's unit. warnings: of the reader, in sentences.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: FloatArray
    channels: tuple[tuple[str, ...], ...]
    frame_time_s: float
    values: FloatArray
    warnings: tuple[str, ...] = ()

    def local(self, joint: int, frames: slice = slice(None)) -> tuple[Rotation, FloatArray]:
        """Of one joint in its parent's frame, a root's in the world: rotations (t), places (t, 3) float64 in the file's
        unit."""
        first = sum(map(len, self.channels[:joint]))
        columns = self.values[frames, first : first + len(self.channels[joint])]
        places = np.tile(self.offsets[joint], (len(columns), 1))
        turns, angles = "", []
        for channel, column in zip(self.channels[joint], columns.T, strict=True):
            if channel[1:] == "position":
                places[:, _AXES[channel[0]]] = column
            else:
                turns += channel[0]
                angles.append(column)
        if not turns:
            return Rotation.identity(len(columns)), places
        return Rotation.from_euler(turns, np.stack(angles, axis=1), degrees=True), places

    def positions(self) -> FloatArray:
        """(t, j, 3) float64 in the file's unit, each joint in the world."""
        positions = np.empty((len(self.values), len(self.names), 3))
        world: list[Rotation] = []
        for joint, parent in enumerate(self.parents):
            turned, moved = self.local(joint)
            if parent >= 0:
                turned, moved = world[parent] * turned, positions[:, parent] + world[parent].apply(moved)
            world.append(turned)
            positions[:, joint] = moved
        return positions


def read_bvh(path: Path) -> BvhMotion:
    """The whole file in memory. Raises FormatError."""
    lines = TextLines(path)
    rows = iter(lines)
    joints = _skeleton(lines, rows)
    width = sum(len(joint.channels) for joint in joints)
    if not width:
        raise lines.error("ends a skeleton of which no joint moves.")
    n_frames = _number(lines, _field(lines, rows, "Frames:"), "Frames")
    frame_time_s = _number(lines, _field(lines, rows, "Frame Time:"), "Frame Time")
    if not 1.0 / FASTEST_HZ <= frame_time_s <= _LONGEST_FRAME_S:
        raise lines.error(f"says that a frame takes {frame_time_s:g} s.")
    check_size(lines.name, int(min(n_frames, 1e15)), width // 3 + 1)
    table = read_table(lines, (row.split() for row in rows), width, promised=n_frames, lacking=width + 1)
    if not len(table.values):
        raise lines.ended("its first frame")
    channels = [(joint.name, channel) for joint in joints for channel in joint.channels]
    if not np.isfinite(table.values).all():
        frame, column = np.argwhere(~np.isfinite(table.values))[0].tolist()
        joint, channel = channels[column]
        raise lines.error(f"ends a file whose frame {frame + 1} has no number for {channel} of {joint}.")
    return BvhMotion(
        names=tuple(joint.name for joint in joints),
        parents=tuple(joint.parent for joint in joints),
        offsets=np.array([joint.offset for joint in joints], dtype=np.float64),
        channels=tuple(joint.channels for joint in joints),
        frame_time_s=frame_time_s,
        values=table.values,
        warnings=tuple(lines.warnings),
    )


@dataclass
class _Joint:
    name: str
    parent: int
    offset: list[float]
    channels: tuple[str, ...] = ()


def _skeleton(lines: TextLines, rows: Iterator[str]) -> list[_Joint]:
    """All joints, up to the word MOTION."""
    words = _Words(lines, rows)
    words.expect(START)
    joints: list[_Joint] = []
    open_joints: list[int] = []
    while True:
        match words.next().upper():
            case "ROOT" | "JOINT" | "END" as word:
                parent = open_joints[-1] if open_joints else -1
                if (word == "ROOT") != (parent < 0):
                    raise lines.error(f"has {word} {'within' if parent >= 0 else 'outside of'} another joint.")
                name = words.next()
                if len(joints) >= 2 * MOST_BONES:  # each with an end site
                    raise lines.error(f"has more than {2 * MOST_BONES:,} joints.")
                joints.append(_Joint(f"{joints[parent].name} end" if word == "END" else name, parent, []))
                open_joints.append(len(joints) - 1)
                words.expect("{")
            case "OFFSET" if open_joints and not joints[open_joints[-1]].offset:
                joints[open_joints[-1]].offset = [_number(lines, words.next(), "OFFSET") for _ in range(3)]
            case "CHANNELS" if open_joints and not joints[open_joints[-1]].channels:
                joints[open_joints[-1]].channels = _channels(lines, words)
            case "}" if open_joints:
                closed = joints[open_joints.pop()]
                if not closed.offset:
                    raise lines.error(f"ends joint {closed.name}, which has no OFFSET.")
            case "MOTION" if joints and not open_joints:
                return joints
            case _:
                raise lines.error(f"has an unknown word {words.last[:40]!r}, or one out of its place.")


def _channels(lines: TextLines, words: _Words) -> tuple[str, ...]:
    count = words.next()
    if count not in tuple("0123456"):
        raise lines.error(f"gives a joint {count[:40]!r} channels.")
    channels = tuple(words.next().capitalize() for _ in range(int(count)))
    if not _CHANNELS.issuperset(channels) or len(set(channels)) < len(channels):
        raise lines.error(f"has channels {' '.join(channels)[:80]}.")
    return channels


class _Words:
    """The words of a file's head, one after the other. last: the one that `next` gave."""

    def __init__(self, lines: TextLines, rows: Iterator[str]) -> None:
        self._lines = lines
        self._words = (word for row in rows for word in row.split())
        self.last = ""

    def next(self) -> str:
        """Raises FormatError where the file ends."""
        self.last = next(self._words, "")
        if not self.last:
            raise self._lines.ended("its motion")
        return self.last

    def expect(self, word: str) -> None:
        """Raises FormatError where another word comes."""
        if self.next().upper() != word:
            raise self._lines.error(f"has {self.last[:40]!r} where {word} should stand.")


def _field(lines: TextLines, rows: Iterator[str], title: str) -> str:
    """What stands behind a title on the next line that is not empty."""
    row = next((row.strip() for row in rows if row.strip()), "")
    if not row:
        raise lines.ended(title.rstrip(":"))
    if not row.lower().startswith(title.lower()):
        raise lines.error(f"has {row[:40]!r} where {title.rstrip(':')} should stand.")
    return row[len(title) :].strip()


def _number(lines: TextLines, text: str, what: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = float("nan")
    if not np.isfinite(number) or (what == "Frames" and not _DIGITS.fullmatch(text)):
        raise lines.error(f"gives {what} as {text[:40]!r}.")
    return number
