"""A real glove solved from 6 and 8 of its 13 markers against all 13 (Schröder 2017, Fig. 15).

The right glove of qualisys_hand, its root not given. The hand is calibrated from the first 10 s; the error is the mean
distance of the 16 joints between the two solutions over the other 50 s, where all 13 markers are seen. 13 markers
leave some angles to what a method believes: each is therefore held against its own solution with all markers, as in
the paper, and against that of standard inverse kinematics.

The reduced layouts are those of schroeder6 and schroeder8 by the glove's names: two markers at the wrist, thumb, index,
middle and little finger at the tips; and with the thumb's second marker and the ring's tip. Beside them `6, back` and
`8, back`: all three markers on the back, and the tips of thumb, index and little finger, or of all digits.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from app.reconstruction.methods import LAYERED, MAP, STANDARD, SUBSPACE, Method, markers_of
from core.calibration.hand import calibrate_hand
from core.errors import FormatError
from core.frames import FloatArray
from core.hand.skeleton import N_JOINTS, Skeleton
from core.kinematics.solver import HandPose, HandSolver
from core.labelling.search import TemplateSearch
from core.markers.layout import MarkerLayout
from core.motion.subspace import Subspace, shipped_subspace, subspace_names
from core.profile import Profile, load_profile
from core.recording import Recording
from core.takes.formats import read_recording

QUALISYS = "qualisys_hand"
NEEDS = (QUALISYS,)

CALIBRATION_S = 10.0
GOAL_MM = 5.0
PUBLISHED_MM = 5.0
"""Schröder 2017, Fig. 15: 6 and 8 of 17 markers, both subjects, below this in the mean."""

_TIPS = ("thumb_tip", "index_tip", "middle_tip", "little_tip")
REDUCED = {
    "6": ("hand_left", "hand_right", *_TIPS),
    "8": ("hand_left", "hand_right", "thumb_middle", *_TIPS, "ring_tip"),
    "6, back": ("hand_top", "hand_left", "hand_right", "thumb_tip", "index_tip", "little_tip"),
    "8, back": ("hand_top", "hand_left", "hand_right", *_TIPS, "ring_tip"),
}
METHODS = (STANDARD, SUBSPACE, LAYERED, MAP)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Prints the mean difference of joints for every reduced layout and method."""
    recording = _recording(arguments.data)
    profile = calibrated(recording, load_profile("qualisys13"))
    hand, worn = profile.hand, profile.worn
    later = recording.points_m[recording.times_s >= CALIBRATION_S]
    points_m = later[~np.isnan(later[:, :, 0]).any(axis=1)][: arguments.frames]
    figures: dict[str, Any] = {"frames": len(points_m), "goal_mm": GOAL_MM, "published_mm": PUBLISHED_MM}
    print(f"  {len(points_m):,} frames with all 13 markers; mean and worst 5 % of the difference of joints [mm]")
    full_standard = solved(STANDARD, hand.skeleton, worn, shipped_subspace("generic"), points_m)
    for name in ("generic", "grasping"):
        if name not in subspace_names():
            continue
        subspace = shipped_subspace(name)
        rows: dict[str, Any] = {}
        print(f"  subspace {name}, {subspace.dimensions} dimensions")
        print(f"  {'layout':9} {'method':14} {'to its own':>18} {'to standard':>18}")
        for method in METHODS:
            whole = full_standard if method is STANDARD else solved(method, hand.skeleton, worn, subspace, points_m)
            for layout_name, markers in REDUCED.items():
                layout = markers_of(worn, markers, layout_name)
                columns = [worn.marker_names.index(marker) for marker in markers]
                found = solved(method, hand.skeleton, layout, subspace, points_m[:, columns])
                row = {"own": _apart(found, whole), "standard": _apart(found, full_standard)}
                rows.setdefault(layout_name, {})[method.title] = row
                numbers = " ".join(f"{each['mean_mm']:9.2f} {each['p95_mm']:8.2f}" for each in row.values())
                print(f"  {layout_name:9} {method.title:14} {numbers}")
        figures[name] = rows
    print(f"  published: below {PUBLISHED_MM:.0f} mm with 6 and 8 of 17 markers")
    return figures


def calibrated(recording: Recording, profile: Profile) -> Profile:
    """Shape and markers found from the first seconds of the recording."""
    first = recording.times_s < CALIBRATION_S
    frames = [frame for frame, early in zip(recording.frames(), first, strict=True) if early]
    labels = {int(i): ("right", k) for k, i in enumerate(recording.ids)}
    return calibrate_hand(frames, profile, labels=labels).profile  # type: ignore[arg-type]


def solved(
    method: Method, skeleton: Skeleton, layout: MarkerLayout, subspace: Subspace, points_m: FloatArray
) -> FloatArray:
    """(t, 16, 3) float64 [m], the joints of every frame of labelled points (t, m, 3), each from the frame before."""
    step, weights = method.make(skeleton, layout, subspace), np.ones(len(layout.joints))
    search = TemplateSearch(skeleton, layout, HandSolver(skeleton, layout))
    pose: HandPose = search.fit_labelled(points_m[0], np.arange(len(layout.joints)), 1.0)
    joints = np.empty((len(points_m), N_JOINTS, 3))
    for t, points in enumerate(points_m):
        step(pose, points, weights, True, 30)
        joints[t] = pose.joints_world[:, :3, 3]
    return joints


def _apart(a: FloatArray, b: FloatArray) -> dict[str, float]:
    apart_mm = 1e3 * np.linalg.norm(a - b, axis=2)
    return {"mean_mm": float(apart_mm.mean()), "p95_mm": float(np.percentile(apart_mm.mean(axis=1), 95))}


def _recording(data: Path) -> Recording:
    """The glove's markers alone, in the order of its layout. Raises FormatError."""
    recording = read_recording(data / QUALISYS / "recording.tsv")
    names = load_profile("qualisys13").layout.marker_names
    missing = [name for name in names if name not in recording.labels]
    if missing:
        raise FormatError(f"{recording.name} has no marker {', '.join(missing)}.", "Give the recording of the glove.")
    columns = [recording.labels.index(name) for name in names]
    return Recording(
        recording.name,
        recording.rate_hz,
        recording.times_s,
        recording.frame_numbers,
        recording.points_m[:, columns],
        names,
        np.arange(len(names)),
    )
