"""Hand shape of Han's users 1 to 4, each found from its own motion.

What the data call palm width is no breadth of skin: 77, 74, 65 and 64 mm are the median distances between the
markers IndexMCP and PinkyMCP over each user's frames (77.8, 74.2, 65.9 and 64.5 mm, right hands). A hand that was
found is therefore measured alike: between those two markers of the model, over the same poses. Beside it stand the
breadth over the knuckles of the shaped hand, as anthropometry measures it, and the distance of its second and fifth
knuckle joints.

Calibrated from the right hands of every second sequence (the left ones are their mirror images); RMS is of the
others, palm width of both, as stated ones are of all frames. The data's jitter is 3.2 mm; a pose of 26 parameters
fitted to 57 coordinates takes up part of that, and 2.4 mm is what jitter alone leaves. Two starts: han19 as shipped,
whose marker positions are the mean of fits to these four users, and its markers placed by anatomy alone.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from core.calibration.hand import HandCalibration, calibrate_hand
from core.calibration.shots import Shots, shots_of
from core.frames import FloatArray, MarkerFrame, Side, Times
from core.hand.measures import measure as measured
from core.kinematics.forward import markers_world
from core.markers.layout import MarkerLayout, load_layout
from core.profile import Profile
from core.takes.reprocess import solve
from core.untrusted.npz import read_npz
from resources.layouts.build_layouts import han19

NEEDS = ("han2018",)
USERS = (1, 2, 3, 4)
PALM_WIDTHS_MM = (77.0, 74.0, 65.0, 64.0)
"""Of users 1 to 4, as the data set states them."""

GOAL_WIDTH_MM = 2.0
FLOOR_MM = 3.2
FRAMES = 2000
"""To calibrate from, and as many others."""
RATE_HZ = 30.0
PAUSE_S = 1.0
"""Between sequences: no motion leads from one to the next."""


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Prints one line per user and start."""
    shipped = load_layout("han19")
    labels: dict[int, tuple[Side, int]] = {k: ("right", k) for k in range(len(shipped.joints))}
    figures: dict[str, Any] = {"floor_mm": FLOOR_MM, "floor_of_residual_mm": residual_floor_mm(len(shipped.joints))}
    print("  user  markers      frames   RMS [mm]           palm width [mm]                breadth   knuckles")
    print("                              before   after     stated   points  found  off    [mm]      2nd to 5th [mm]")
    for name, layout in (("as shipped", shipped), ("by anatomy", han19())):
        found = {}
        for user, stated in zip(USERS, PALM_WIDTHS_MM, strict=True):
            used, others = sequences(arguments.data / NEEDS[0] / f"han_user{user}.npz", arguments.frames)
            given = Profile("", layout, ("right",))
            calibrated = calibrate_hand(used, given, labels=labels, performer=f"user {user}")
            one = found[user] = _tried(calibrated, given, used, others, labels, stated)
            print(
                f"  {user}     {name}   {one['frames']:6,}   {one['rms_before_mm']:6.2f}  {one['rms_after_mm']:6.2f}   "
                f"{stated:8.1f}  {one['points_mm']:7.1f}  {one['found_mm']:5.1f} {one['off_mm']:+5.1f}"
                f"  {one['breadth_mm']:6.1f}  {one['knuckles_mm']:9.1f} +- {one['knuckles_std_mm']:.1f}"
            )
        figures[name] = {
            "users": found,
            "in_order": _falling([found[user]["found_mm"] for user in USERS]),
            "knuckles_in_order": _falling([found[user]["knuckles_mm"] for user in USERS]),
            "within_goal": all(abs(one["off_mm"]) <= GOAL_WIDTH_MM for one in found.values()),
        }
        worst = max(abs(one["off_mm"]) for one in found.values())
        print(
            f"  palm widths {'in order' if figures[name]['in_order'] else 'not in order'}, at most {worst:.1f} mm off "
            f"(goal {GOAL_WIDTH_MM:.0f}); jitter alone would leave {figures['floor_of_residual_mm']:.1f} mm RMS"
        )
    return figures


def _falling(values: list[float]) -> bool:
    return values == sorted(values, reverse=True)


def residual_floor_mm(markers: int) -> float:
    """RMS that the data's jitter leaves when a pose of 26 parameters is fitted to it."""
    return FLOOR_MM * float(np.sqrt(1.0 - 26.0 / (3.0 * markers)))


def sequences(path: Path, most: int | None = None) -> tuple[list[MarkerFrame], list[MarkerFrame]]:
    """Right hands to calibrate from, and others: every second sequence each. Raises FormatError."""
    data = read_npz(path, ("hand", "points", "sequence"), str(path), "Give the folder that holds it as --data.")
    right = data["hand"] == 1
    points, sequence = data["points"][right].astype(np.float64), data["sequence"][right]
    odd = np.isin(sequence, np.unique(sequence)[1::2])
    parts = []
    for rows in (~odd, odd):
        # Runs of frames, spread over all sequences: what a recording of so many frames would show.
        chosen = _runs(np.flatnonzero(rows), min(FRAMES, most or FRAMES))
        parts.append(list(_frames(points[chosen], sequence[chosen], chosen)))
    return parts[0], parts[1]


def _runs(rows: np.ndarray, count: int, length: int = 30) -> np.ndarray:
    """`count` rows in runs of `length`, evenly spread."""
    starts = np.linspace(0, max(len(rows) - length, 0), max(count // length, 1)).astype(int)
    return np.unique(np.concatenate([rows[start : start + length] for start in starts]))


def _frames(points_m: FloatArray, sequence: np.ndarray, rows: np.ndarray) -> Iterator[MarkerFrame]:
    """A break in the rows, or another sequence, is a pause."""
    time_s = 0.0
    for i, points in enumerate(points_m):
        together = i > 0 and rows[i] == rows[i - 1] + 1 and sequence[i] == sequence[i - 1]
        time_s += 1.0 / RATE_HZ if together else PAUSE_S
        times = Times(time_s, time_s, time_s)
        yield MarkerFrame(i, times, points, np.arange(len(points)), np.full(len(points), np.nan))


def palm_width_mm(points_m: FloatArray, marker_names: tuple[str, ...]) -> float:
    """Median distance between the markers IndexMCP and PinkyMCP [mm]. points_m: (n, m, 3) float64 [m]."""
    index, pinky = marker_names.index("IndexMCP"), marker_names.index("PinkyMCP")
    return 1000.0 * float(np.nanmedian(np.linalg.norm(points_m[:, index] - points_m[:, pinky], axis=1)))


def _tried(
    calibrated: HandCalibration,
    given: Profile,
    used: list[MarkerFrame],
    others: list[MarkerFrame],
    labels: dict[int, tuple[Side, int]],
    stated_mm: float,
) -> dict[str, Any]:
    """Figures of one user: how well the sequences that were not used are explained, how wide the palm is in all."""
    profile = calibrated.profile
    count = len(given.layout.joints)
    before = shots_of(others, solve(others, given, labels=labels), count)
    after = shots_of(others, solve(others, profile, labels=labels), count)
    every = shots_of(used + others, solve(used + others, profile, labels=labels), count)
    names = profile.layout.marker_names
    found = palm_width_mm(_model_m(profile, every), names)
    std = next(measure.std for measure in calibrated.measures if measure.name == "palm_width")
    joints = profile.hand.skeleton.joint_positions_m
    knuckles = 1e3 * float(np.linalg.norm(joints[4] - joints[13]))
    return {
        "frames": len(after),
        "rms_before_mm": _rms_mm(before),
        "rms_after_mm": _rms_mm(after),
        "points_mm": palm_width_mm(every.points_m, names),
        "found_mm": found,
        "off_mm": found - stated_mm,
        "breadth_mm": 1e3 * measured(profile.hand).breadth,
        "knuckles_mm": knuckles,
        "knuckles_std_mm": std * knuckles,
        "shape": profile.shape.to_dict(),
        "not_seen": calibrated.unseen,
    }


def _model_m(profile: Profile, shots: Shots) -> FloatArray:
    """(n, m, 3) float64 [m]: the model's markers in the poses of the shots."""
    worn: MarkerLayout = profile.worn
    skeleton = profile.hand.skeleton
    return np.stack([markers_world(skeleton, theta, worn.joints, worn.positions_m) for theta in shots.thetas_rad])


def _rms_mm(shots: Shots) -> float:
    return 1e3 * float(np.sqrt(np.mean(shots.rms_m**2)))
