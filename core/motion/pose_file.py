"""Named poses of a hand, each with what it holds and where it touches, and the human-readable file they are kept in.

    {"format": "phalanx-poses", "version": 1, "poses": [
      {"name": "tip_pinch", "activity": "grasp", "source": "Feix 2016, 24: Tip Pinch",
       "digits_deg": {"thumb": [4 numbers], "index": [4], "middle": [4], "ring": [4], "pinky": [4]},
       "prop": {"shape": "sphere", "size_mm": [6], "position_mm": [3], "quaternion_wxyz": [4]},
       "contacts": [["thumb tip", "prop"], ["index tip", "prop"]]}]}

Angles stand in the order of core.hand.skeleton.DIGIT_DOF_NAMES; "prop" and "contacts" may be left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from core.errors import FormatError
from core.frames import FloatArray
from core.hand.skeleton import DIGITS
from core.json_form import checked_form

FORMAT = "phalanx-poses"
VERSION = 1
ACTIVITIES = ("rest", "extreme", "grasp", "pinch", "counting", "sign", "gesture", "piano")

SIZES = {"sphere": 1, "cylinder": 2, "disk": 2, "box": 3}
"""How many lengths a shape of prop has: a sphere its diameter, a cylinder and a disk diameter and length, a box its
edges along x, y and z."""


@dataclass(frozen=True)
class Prop:
    """What a hand holds.

    shape: a key of SIZES; size_m: its lengths [m]. transform_hand: (4, 4) float64 [m], prop to the hand frame of a
    right hand at scale 1; a cylinder and a disk stand along their z.
    """

    shape: str
    size_m: tuple[float, ...]
    transform_hand: FloatArray


@dataclass(frozen=True)
class LibraryPose:
    """One pose of the digits, right or left hand alike.

    activity: one of ACTIVITIES. source: where the name comes from. angles_rad: (20,) float64 [rad], read-only.
    contacts: pairs of places that touch; a place is "prop", "palm", or a digit and where on it, such as "index pad",
    "thumb tip" or "middle proximal radial" (resources.motion.surface).
    """

    name: str
    activity: str
    source: str
    angles_rad: FloatArray
    prop: Prop | None = None
    contacts: tuple[tuple[str, str], ...] = ()


def poses_to_dict(poses: Mapping[str, LibraryPose]) -> dict[str, Any]:
    """The JSON form of poses."""
    return {"format": FORMAT, "version": VERSION, "poses": [_pose_to_dict(pose) for pose in poses.values()]}


def poses_from_dict(data: Any, source: str = "Poses") -> dict[str, LibraryPose]:
    """Poses by name from their JSON form. Raises FormatError naming `source`, the pose and what is wrong."""
    data = checked_form(data, source, FORMAT, (VERSION,), "pose library", "")
    rows = data.get("poses")
    if not isinstance(rows, list):
        raise FormatError(f'{source}: "poses" is no list.', "Restore the file.")
    poses: dict[str, LibraryPose] = {}
    for i, row in enumerate(rows):
        name = row.get("name") if isinstance(row, dict) else None
        where = f"{source}, pose {name or i!r}"
        if name in poses:
            raise FormatError(f"{where} stands there twice.", "Give every pose its own name.")
        try:
            pose = _pose_from_dict(row)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            problem = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise FormatError(f"{where} cannot be read ({problem}).", "Mend this pose or take it out.") from error
        poses[pose.name] = pose
    return poses


def _pose_to_dict(pose: LibraryPose) -> dict[str, Any]:
    angles_deg = np.degrees(pose.angles_rad).reshape(len(DIGITS), 4)
    row: dict[str, Any] = {
        "name": pose.name,
        "activity": pose.activity,
        "source": pose.source,
        "digits_deg": {digit: _rounded(angles, 1) for digit, angles in zip(DIGITS, angles_deg, strict=True)},
    }
    if pose.prop is not None:
        transform = pose.prop.transform_hand
        row["prop"] = {
            "shape": pose.prop.shape,
            "size_mm": _rounded(np.asarray(pose.prop.size_m) * 1e3, 2),
            "position_mm": _rounded(transform[:3, 3] * 1e3, 2),
            "quaternion_wxyz": _rounded(Rotation.from_matrix(transform[:3, :3]).as_quat(scalar_first=True), 5),
        }
    if pose.contacts:
        row["contacts"] = [list(pair) for pair in pose.contacts]
    return row


def _pose_from_dict(row: Any) -> LibraryPose:
    digits = row["digits_deg"]
    if row["activity"] not in ACTIVITIES:
        raise ValueError(f"activity {row['activity']!r} is none of {', '.join(ACTIVITIES)}")
    angles = np.radians([_numbers(digits[digit], 4, digit) for digit in DIGITS]).reshape(4 * len(DIGITS))
    angles.flags.writeable = False
    contacts = tuple((str(a), str(b)) for a, b in row.get("contacts", ()))
    prop = _prop_from_dict(row["prop"]) if row.get("prop") is not None else None
    return LibraryPose(str(row["name"]), str(row["activity"]), str(row["source"]), angles, prop, contacts)


def _prop_from_dict(row: Any) -> Prop:
    shape = row["shape"]
    if shape not in SIZES:
        raise ValueError(f"prop of shape {shape!r}, which is none of {', '.join(SIZES)}")
    size_mm = _numbers(row["size_mm"], SIZES[shape], "size_mm")
    if size_mm.min() <= 0.0:
        raise ValueError(f"size_mm {row['size_mm']} is not positive")
    quaternion = _numbers(row["quaternion_wxyz"], 4, "quaternion_wxyz")
    transform = np.eye(4)
    transform[:3, :3] = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    transform[:3, 3] = _numbers(row["position_mm"], 3, "position_mm") * 1e-3
    transform.flags.writeable = False
    return Prop(shape, tuple(float(length) for length in size_mm * 1e-3), transform)


def _numbers(values: Any, count: int, what: str) -> FloatArray:
    numbers = np.asarray(values, dtype=np.float64)
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise ValueError(f"{what} {values!r} is not {count} numbers")
    return numbers


def _rounded(values: FloatArray, digits: int) -> list[float]:
    return [round(float(value), digits) + 0.0 for value in values]
