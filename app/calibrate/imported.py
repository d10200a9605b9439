"""Hand shape from a rigged glTF hand or your own MANO file.

The profile gets the shape in which our hand is nearest to it, with the layout of the profile that is given.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from app.calibrate.neutral import say_dropped
from app.commands.out import out_file
from app.commands.result import Result
from core.frames import SIDES
from core.hand.imports.load import load_hand
from core.hand.imports.measure import bone_lengths_m, measure_shape, posed_joints_m
from core.hand.model import template
from core.hand.shape import BONE_NAMES, shaped_hand
from core.hand.skeleton import DIGITS
from core.printable import printable
from core.profile import load_profile, save_profile

NAME = "import"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this calibration."""
    parser.add_argument("file", metavar="FILE", type=Path, help="rigged .glb or .gltf hand, or a MANO .npz")
    parser.add_argument("--profile", metavar="P", required=True, help="profile file, or a layout on a generic hand")
    parser.add_argument("--side", choices=SIDES, help="side of the file's hand; default: seen from its shape")
    parser.add_argument("--out", metavar="PROFILE", type=out_file, required=True, help="profile file to write")


def run(arguments: argparse.Namespace) -> Result:
    """Measures the hand, says its lengths, and writes the profile."""
    profile = load_profile(arguments.profile)
    imported = load_hand(arguments.file, arguments.side)
    shape = measure_shape(imported.hand)
    ours = shaped_hand(template(), shape)
    apart_m = np.linalg.norm(posed_joints_m(ours.skeleton) - posed_joints_m(imported.hand.skeleton), axis=-1)
    lengths_mm = 1e3 * bone_lengths_m(imported.hand.skeleton).reshape(len(DIGITS), 3)
    joints = imported.hand.skeleton.joint_positions_m
    palm_mm = 1e3 * float(np.linalg.norm(joints[13] - joints[4]))
    hand_mm = 1e3 * imported.hand.skeleton.length_m
    save_profile(profile.with_hand(shape=shape, scale=1.0), arguments.out)
    print(
        f"{arguments.file.name}: a {imported.side} hand, {hand_mm:.0f} mm long, {palm_mm:.0f} mm between its knuckles"
    )
    for digit, row in zip(DIGITS, lengths_mm, strict=True):
        words = ", ".join(f"{bone} {mm:.1f}" for bone, mm in zip(BONE_NAMES[digit != "thumb"], row, strict=True))
        print(f"  {digit:7} {words} mm")
    print(
        f"Joints and fingertips of the shape lie {1e3 * apart_m.mean():.1f} mm from the hand's on average, "
        f"at most {1e3 * apart_m.max():.1f} mm."
    )
    print(f"{printable(arguments.out)} written.")
    say_dropped(profile)
    return Result(
        figures={
            "file": arguments.file,
            "side": imported.side,
            "hand_length_mm": hand_mm,
            "knuckles_mm": palm_mm,
            "bones_mm": dict(zip(DIGITS, lengths_mm, strict=True)),
            "shape": shape.to_dict(),
            "joints_apart_mm": {"mean": 1e3 * apart_m.mean(), "max": 1e3 * apart_m.max()},
            "profile": arguments.out,
        }
    )
