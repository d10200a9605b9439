"""BVH: one skeleton per hand and file, for Blender, MotionBuilder, Maya and what reads them.

One file per hand, since their importers make one armature of a file and expect a single moving root. Centimetres,
Y up, unless asked otherwise. The root is the wrist, with position and rotation; other joints turn only, so bones keep
their length. All rotations are Z Y X: R = Rz Ry Rx, in which a finger's flexion is about X and its abduction about Y
(docs/joints.md says how far off), and which is far from its singularity (Y = 90 degrees) in every finger. At zero the
hand is flat, palm down, fingers to -Z. With Z up only the root's rotation is another: bones keep their frames.

Frames are evenly spaced. Where a hand is not tracked, or there is no frame, the last pose is held (held.csv tells
where). If the engine was still finding the hand's size, bones have the size found in the end.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import TextIO

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import FloatArray, HandKey
from core.hand.skeleton import JOINT_PARENTS, N_JOINTS, TIP_JOINTS
from core.takes.export.bone_names import BoneNames, bone_names
from core.takes.export.compare import compare, mismatch, read_back
from core.takes.export.content import Content
from core.takes.export.hands import HandMotion, hand_motion
from core.takes.export.naming import file_stem
from core.takes.export.options import UNITS_M, ExportOptions, Up
from core.takes.export.progress import Progress
from core.takes.formats.bvh import read_bvh

TOLERANCE_M = 1e-6
_USUAL_UNIT = "cm"
_Y_TO_Z_UP = Rotation.from_euler("X", 90.0, degrees=True)
_PATH_SIGNS = str.maketrans("[].:/", "_____")
_ROTATION = "Zrotation Yrotation Xrotation"


def names(content: Content) -> list[str]:
    """One file for each hand that is tracked at all: `take_left.bvh`, with several performers `take_Anna_left.bvh`."""
    stem = file_stem(content.solution.name)
    whose = [f"{subject}_" if subject else "" for subject in content.subjects]
    return [f"{stem}_{whose[hand.performer]}{hand.side}.bvh" for hand in content.tracked]


def _names(content: Content, hand: HandKey) -> BoneNames:
    """Of several performers, whose joints they are stands before: `Anna_L_wrist`, without the signs that three.js reads
    as a path to what is to be moved, and then moves nothing (its BVHLoader keeps them, 0.187). Names of other programs
    stay as these have them."""
    subject = content.subjects[hand.performer].translate(_PATH_SIGNS)
    named = bone_names(content.options.bones, hand.side)
    whose = f"{subject}_" if subject else ""
    return BoneNames(tuple(whose + name for name in named.joints), tuple(whose + name for name in named.tips))


def write(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, CancelledError, OSError."""
    for i, (hand, path) in enumerate(zip(content.tracked, paths, strict=True)):
        step = progress.part(i / len(paths), (i + 1) / len(paths))
        grid = content.grid
        motion = hand_motion(content, hand, step.part(0.0, 0.3)).between(grid.before, grid.after, grid.share)
        motion = replace(motion, names=_names(content, hand))
        _write(path, motion, grid.rate_hz, content.options, step.part(0.3, 0.7))
        step(0.7, f"Reading back {path.name}")
        _check(path, motion, grid.rate_hz, content.options)
        step(1.0, f"{path.name} is complete")


def _write(path: Path, motion: HandMotion, rate_hz: float, options: ExportOptions, progress: Progress) -> None:
    rotations_xyzw = motion.rotations_xyzw
    if options.up == "z":
        rotations_xyzw = rotations_xyzw.copy()
        rotations_xyzw[:, 0] = (_Y_TO_Z_UP * Rotation.from_quat(rotations_xyzw[:, 0])).as_quat()
    per_m = _per_m(options)
    values = np.empty((motion.n_frames, 3 + 3 * N_JOINTS))
    values[:, :3] = _turned_up(motion.wrist_m, options.up) * per_m
    values[:, 3:] = np.degrees(_smooth_euler(rotations_xyzw)).reshape(motion.n_frames, -1)
    row = " ".join(["%.7f"] * values.shape[1]) + "\n"
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write("HIERARCHY\n")
        _write_joint(stream, motion, per_m, 0, "")
        stream.write(f"MOTION\nFrames: {motion.n_frames}\nFrame Time: {1.0 / rate_hz:.10f}\n")
        for frame in progress.over(values, f"Writing {path.name}"):
            stream.write(row % tuple(frame.tolist()))


def _write_joint(stream: TextIO, motion: HandMotion, per_m: float, joint: int, indent: str) -> None:
    inner = indent + "\t"
    channels = f"CHANNELS 6 Xposition Yposition Zposition {_ROTATION}" if joint == 0 else f"CHANNELS 3 {_ROTATION}"
    stream.write(f"{indent}{'JOINT' if joint else 'ROOT'} {motion.names.joints[joint]}\n{indent}{{\n")
    stream.write(f"{inner}OFFSET {_triple(motion.offsets_m[joint] * per_m)}\n{inner}{channels}\n")
    children = [child for child, parent in enumerate(JOINT_PARENTS) if parent == joint]
    for child in children:
        _write_joint(stream, motion, per_m, child, inner)
    if not children:
        tip = motion.tips_m[TIP_JOINTS.index(joint)] - motion.rest_m[joint]
        stream.write(f"{inner}End Site\n{inner}{{\n{inner}\tOFFSET {_triple(tip * per_m)}\n{inner}}}\n")
    stream.write(f"{indent}}}\n")


def _triple(offset: FloatArray) -> str:
    return " ".join(f"{value:.7f}" for value in offset)


def _per_m(options: ExportOptions) -> float:
    """Units of the file in a metre."""
    return 1.0 / UNITS_M[options.unit or _USUAL_UNIT]


def _turned_up(points_m: FloatArray, up: Up) -> FloatArray:
    """(..., 3) float64 of the world in the file's axes: with Z up, x, -z, y."""
    return points_m if up == "y" else np.stack([points_m[..., 0], -points_m[..., 2], points_m[..., 1]], axis=-1)


def _smooth_euler(rotations_xyzw: FloatArray) -> FloatArray:
    """(t, 16, 3) float64 [rad], angles about Z, Y, X, without the jumps an angle makes at its ends.

    Each rotation has two triples, (z, y, x) and (z + pi, pi - y, x + pi); the nearer to the frame before is taken.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # at the singularity itself any z and x of the right sum will do
        flat = Rotation.from_quat(rotations_xyzw.reshape(-1, 4)).as_euler("ZYX")
    angles = flat.reshape(*rotations_xyzw.shape[:2], 3)
    other = np.stack([angles[..., 0] + np.pi, np.pi - angles[..., 1], angles[..., 2] + np.pi], axis=-1)
    changes = _distance(other[1:], angles[:-1]) < _distance(angles[1:], angles[:-1])
    use_other = np.zeros(angles.shape[:2], dtype=np.bool_)
    use_other[1:] = np.cumsum(changes, axis=0) % 2 == 1
    smooth: FloatArray = np.unwrap(np.where(use_other[..., None], other, angles), axis=0)
    return smooth


def _distance(a: FloatArray, b: FloatArray) -> FloatArray:
    """(t, 16) [rad], how far the angles of one triple turn to reach the other's."""
    apart: FloatArray = np.abs(np.remainder(a - b + np.pi, 2.0 * np.pi) - np.pi).sum(axis=-1)
    return apart


def _check(path: Path, motion: HandMotion, rate_hz: float, options: ExportOptions) -> None:
    read = read_back(path, read_bvh)
    if read.warnings:
        raise mismatch(path, f"it is not sound ({read.warnings[0].rstrip('.')})")
    names = list(motion.names.joints)
    names += [f"{names[joint]} end" for joint in TIP_JOINTS]
    if sorted(read.names) != sorted(names):
        raise mismatch(path, f"it holds the joints {', '.join(read.names)}")
    if abs(read.frame_time_s * rate_hz - 1.0) > 1e-6:
        raise mismatch(path, f"its frame time is {read.frame_time_s:g} s instead of {1.0 / rate_hz:g} s")
    wrist = motion.joints_m[:, :1]
    solved = np.concatenate([motion.joints_m, motion.ends_m], axis=1)
    sized = wrist + (solved - wrist) / motion.sizes[:, None, None]
    written = read.positions()[:, [read.names.index(name) for name in names]] / _per_m(options)
    compare(path, written, _turned_up(sized, options.up), TOLERANCE_M, names)
