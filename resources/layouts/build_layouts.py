"""Writes the marker layouts of this folder, from the hand template and, where named, from labelled motion.

    python -m resources.layouts.build_layouts DATA

DATA holds the recordings to which the positions of han19 and qualisys13 are fitted (positions are facts about where
markers sit; no pose of anybody is kept). Every other layout is placed by anatomy alone: so far along a bone, so high
above its dorsal side.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import FloatArray, Side
from core.hand.model import template
from core.hand.skeleton import DIGITS
from core.kinematics.solver import HandPose
from core.markers.layout import MarkerLayout
from core.takes.formats import read_recording
from resources.layouts.marker_fit import fit_markers

HERE = Path(__file__).parent
SKELETON = template().skeleton
FINGERS = DIGITS[1:]
HEIGHTS_M = (0.0135, 0.0120, 0.0105)
"""Bone axis to marker centre, by bone from the palm: half a finger, a glove and half a marker."""

Place = tuple[str, int, FloatArray]


def on_digit(name: str, digit: str, bone: int, along: float, height_m: float | None = None) -> Place:
    """A marker on the back of a digit: bone 0..2 from the palm, `along` 0..1 towards the tip."""
    g = DIGITS.index(digit)
    joints = SKELETON.joint_positions_m[1 + 3 * g : 4 + 3 * g]
    ends = np.vstack([joints, SKELETON.tip_positions_m[g]])
    bone_m = ends[bone + 1] - ends[bone]
    dorsal = np.cross(bone_m, SKELETON.axes[4 * g + 3])
    height_m = HEIGHTS_M[bone] if height_m is None else height_m
    return name, 1 + 3 * g + bone, ends[bone] + along * bone_m + height_m * dorsal / np.linalg.norm(dorsal)


def on_back(name: str, finger: str, along: float, height_m: float = 0.018, ulnar_m: float = 0.0) -> Place:
    """A marker on the back of the hand over a finger's metacarpal: `along` 0 (wrist) to 1 (knuckle)."""
    knuckle = SKELETON.joint_positions_m[1 + 3 * DIGITS.index(finger)]
    return name, 0, along * knuckle + np.array([ulnar_m, height_m, 0.0])


def layout(
    name: str, description: str, places: list[Place], sides: tuple[Side, ...] = ("left", "right")
) -> MarkerLayout:
    """The layout of these markers."""
    return MarkerLayout(
        name, description, sides, tuple(p[0] for p in places), np.asarray([p[1] for p in places]),
        np.asarray([p[2] for p in places]),
    )  # fmt: skip


def han19() -> MarkerLayout:
    """Han 2018, Fig. 2: three markers on the back, one on every bone of every digit."""
    places = [
        on_digit("ThumbCMC", "thumb", 0, 0.1, 0.012),
        on_digit("ThumbMCP", "thumb", 0, 0.8, 0.012),
        on_digit("ThumbIP", "thumb", 1, 0.7),
        on_digit("ThumbTip", "thumb", 2, 0.6),
    ]
    for finger in FINGERS:
        places += [on_digit(f"{finger.capitalize()}{part}", finger, bone, 0.5)
                   for bone, part in enumerate(("MCP", "PIP", "Tip"))]  # fmt: skip
    places += [
        on_back("BackHand1", "ring", 0.5, 0.025),
        on_back("BackHand2", "ring", 0.1, 0.025),
        on_back("BackHand3", "index", 0.35, 0.022, -0.009),
    ]
    return layout("han19", "Dense glove of Han 2018: 3 markers on the back, 4 on the thumb, 3 on each finger.", places)


def qualisys13() -> MarkerLayout:
    """The right glove of the recording in data/qualisys_hand, as its picture shows it."""
    digits = ("thumb", "index", "middle", "ring", "little")
    places = [
        on_back("hand_top", "ring", 0.65), on_back("hand_left", "middle", 0.2), on_back("hand_right", "pinky", 0.2),
    ]  # fmt: skip
    for digit, word in zip(DIGITS, digits, strict=True):
        places.append(on_digit(f"{word}_tip", digit, 2, 0.4, 0.012))
        places.append(
            on_digit(f"{word}_middle", digit, 1 if digit == "thumb" else 0, 0.3 if digit == "thumb" else 0.6, 0.012)
        )
    return layout("qualisys13", "Right glove with 3 markers on the back and 2 on each digit.", places, ("right",))


def alexanderson13(dense: MarkerLayout) -> MarkerLayout:
    """Alexanderson 2016, as Han 2018 (Table 6) uses it: 3 on the back, 2 on each digit, of the dense set."""
    keep = [n for n in dense.marker_names if n.startswith("Back") or n.endswith(("Tip", "PIP")) or n == "ThumbMCP"]
    return subset(dense, "alexanderson13", "Sparse set: 3 markers on the back, 2 on each digit.", keep)


def schroeder17() -> MarkerLayout:
    """Schröder 2017, Fig. 14: 17 markers over most degrees of freedom."""
    places = [
        on_back("wrist_radial", "index", 0.12, ulnar_m=-0.014),
        on_back("wrist_ulnar", "pinky", 0.15, 0.016, 0.014),
    ]
    places += [
        on_digit("thumb_metacarpal", "thumb", 0, 0.7, 0.016),
        on_digit("thumb_proximal", "thumb", 1, 0.6),
        on_digit("thumb_tip", "thumb", 2, 0.6),
    ]
    for finger in FINGERS:
        places += [on_digit(f"{finger}_proximal", finger, 0, 0.55), on_digit(f"{finger}_middle", finger, 1, 0.55),
                   on_digit(f"{finger}_tip", finger, 2, 0.6)]  # fmt: skip
    return layout("schroeder17", "17 markers: 2 near the wrist, 3 on each digit.", places)


def pavllo9() -> MarkerLayout:
    """Pavllo 2019: nine active LEDs, named and ordered as their template."""
    return layout(
        "pavllo9", "Nine active LEDs: wrist, index and pinky base, and six on the digits.",
        [
            on_back("LEHAR", "pinky", 0.95, 0.012), on_back("LEHAL", "middle", 0.05, 0.018),
            on_back("WHARHAR", "index", 0.95, 0.012), on_digit("LRIF", "ring", 2, 0.6),
            on_digit("LBAF", "pinky", 2, 0.6), on_digit("LMIF", "index", 2, 0.6), on_digit("LINF", "middle", 2, 0.6),
            on_digit("LPAL", "thumb", 1, 0.5), on_digit("LTHF", "thumb", 2, 0.6),
        ],
    )  # fmt: skip


def subset(full: MarkerLayout, name: str, description: str, keep: list[str]) -> MarkerLayout:
    """Only these markers of a layout."""
    rows = [full.marker_names.index(marker) for marker in keep]
    return MarkerLayout(name, description, full.sides, tuple(keep), full.joints[rows], full.positions_m[rows])


def pose_near(layout_: MarkerLayout, points_m: FloatArray) -> HandPose:
    """The template laid rigidly onto the labelled points (m, 3) of one frame."""
    seen = ~np.isnan(points_m[:, 0])
    ours, theirs = layout_.positions_m[seen], points_m[seen]
    rotation, _ = Rotation.align_vectors(theirs - theirs.mean(0), ours - ours.mean(0))
    pose = HandPose.at_rest(len(points_m))
    pose.theta_rad[:3] = theirs.mean(0) - rotation.apply(ours.mean(0))
    pose.theta_rad[3:6] = rotation.as_rotvec()
    pose.scale = 0.95
    return pose


def fit_han19(data: Path) -> MarkerLayout:
    """Mean of the fits to 400 right-hand frames of each user."""
    start, fitted = han19(), []
    for file in sorted((data / "han2018").glob("han_user*.npz")):
        with np.load(file, allow_pickle=False) as user:
            points = user["points"][user["hand"] == 1].astype(np.float64)
        points = points[np.linspace(0, len(points) - 1, 400).astype(int)]
        fit = fit_markers(SKELETON, start, points, start=pose_near(start, points[0]), rounds=8, prior_frames=20)
        print(f"{file.stem}: scale {fit.scale:.3f}, RMS {fit.rms_before_m * 1e3:.2f} -> {fit.rms_after_m * 1e3:.2f} mm")
        fitted.append(fit.layout.positions_m)
    return replace(start, positions_m=np.mean(fitted, axis=0))


def fit_qualisys13(data: Path) -> MarkerLayout:
    """Fit to every 4th frame of the first 10 s of the recording."""
    start = qualisys13()
    recording = read_recording(data / "qualisys_hand" / "recording.tsv")
    columns = [recording.labels.index(name) for name in start.marker_names]
    points = recording.points_m[:1000:4, columns]
    fit = fit_markers(SKELETON, start, points, start=pose_near(start, points[0]), rounds=12, prior_frames=10)
    print(f"qualisys13: scale {fit.scale:.3f}, RMS {fit.rms_before_m * 1e3:.2f} -> {fit.rms_after_m * 1e3:.2f} mm")
    return fit.layout


def main(data: Path) -> None:
    """Write every layout."""
    dense, full = fit_han19(data), schroeder17()
    tips = ["thumb_tip", "index_tip", "middle_tip", "ring_tip", "pinky_tip"]
    layouts = [
        dense,
        alexanderson13(dense),
        fit_qualisys13(data),
        full,
        subset(full, "schroeder8", "8 of the 17 markers: wrist, thumb and fingertips.",
               ["wrist_radial", "wrist_ulnar", "thumb_metacarpal", *tips]),
        subset(full, "schroeder6", "6 of the 17 markers: wrist and four tips.",
               ["wrist_radial", "wrist_ulnar", "thumb_tip", "index_tip", "middle_tip", "pinky_tip"]),
        pavllo9(),
    ]  # fmt: skip
    for made in layouts:
        (HERE / f"{made.name}.json").write_text(json.dumps(made.to_dict(), indent=2) + "\n", encoding="utf-8")
        print(f"{made.name}: {len(made.marker_names)} markers")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
