"""What a hand's joints are called, in the words of the programs that files are for.

Sources: VRM 1.0 humanoid bones (VRMC_vrm); the Unreal mannequin's skeleton; Unity's HumanBodyBones; Mixamo's rig, whose
fourth bone of a digit is its end; and SMPL-X, which holds two MANO hands. Ends that a scheme has no name for are named
in its way. docs/joints.md has the table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from core.frames import Side
from core.hand.skeleton import DIGITS, JOINT_NAMES, TIP_NAMES

_Namer = Callable[[Side, str, int], str]
"""Side, digit ("" for the wrist), and which of its joints: 1, 2, 3, and 4 for its end."""


@dataclass(frozen=True)
class BoneNames:
    """joints: 16, as JOINT_NAMES. tips: 5, as TIP_NAMES. All differ, and none holds white space."""

    joints: tuple[str, ...]
    tips: tuple[str, ...]


def bone_names(scheme: str, side: Side, subject: str = "") -> BoneNames:
    """The names of one hand. subject: its performer where there are several, before every name as a namespace.

    Raises KeyError for a scheme that is not in BONE_SCHEMES.
    """
    name, whose = BONE_SCHEMES[scheme], f"{subject}:" if subject else ""
    joints = [name(side, "", 0), *(name(side, digit, number) for digit in DIGITS for number in (1, 2, 3))]
    tips = [name(side, digit, 4) for digit in DIGITS]
    return BoneNames(tuple(whose + joint for joint in joints), tuple(whose + tip for tip in tips))


def _phalanx(side: Side, digit: str, number: int) -> str:
    prefix = "L_" if side == "left" else "R_"
    if number == 4:
        return prefix + TIP_NAMES[DIGITS.index(digit)]
    return prefix + JOINT_NAMES[3 * DIGITS.index(digit) + number if digit else 0]


_VRM_THUMB = ("Metacarpal", "Proximal", "Distal", "Tip")
_HUMANOID = ("Proximal", "Intermediate", "Distal", "Tip")


def _little(digit: str) -> str:
    return {"pinky": "Little"}.get(digit, digit.capitalize())


def _vrm(side: Side, digit: str, number: int) -> str:
    bones = _VRM_THUMB if digit == "thumb" else _HUMANOID
    return f"{side}{_little(digit)}{bones[number - 1]}" if digit else f"{side}Hand"


def _unity(side: Side, digit: str, number: int) -> str:
    return f"{side.capitalize()}{_little(digit)}{_HUMANOID[number - 1]}" if digit else f"{side.capitalize()}Hand"


def _unreal(side: Side, digit: str, number: int) -> str:
    end = "tip" if number == 4 else f"{number:02}"
    return f"{digit}_{end}_{side[0]}" if digit else f"hand_{side[0]}"


def _mixamo(side: Side, digit: str, number: int) -> str:
    return f"mixamorig:{side.capitalize()}Hand" + (f"{digit.capitalize()}{number}" if digit else "")


def _mano(side: Side, digit: str, number: int) -> str:
    return f"{side}_{digit or 'wrist'}{number if number in (1, 2, 3) else ''}"


BONE_SCHEMES: dict[str, _Namer] = {
    "phalanx": _phalanx,
    "vrm": _vrm,
    "unreal": _unreal,
    "unity": _unity,
    "mixamo": _mixamo,
    "mano": _mano,
}
"""How to call a bone, by the name that `--bones` takes."""
