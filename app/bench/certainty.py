"""Whether a pose is as sure as it says: stated standard deviations of angles and markers against true errors."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import replace
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from app.labels import label_map
from app.people import add_sizes, size_of, sized
from core.engine import Engine, warm_up
from core.errors import FormatError
from core.frames import FloatArray, HandState, MarkerFrame
from core.hand.certainty import guesses
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile, load_profile
from core.takes.formats import read_recording
from core.takes.reprocess import solve

SETTLED_S = 1.0
"""Before that a hand's size is still being found."""

STEPS_DEG = (0.0, 1.0, 2.0, 3.0, 5.0, 8.0, 90.0)
STEPS_MM = (0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 1000.0)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument(
        "file", metavar="FILE", nargs="?", type=Path, help="a labelled recording; each marker is hidden in turn"
    )
    parser.add_argument("--profile", metavar="P", default="han19", help="default %(default)s")
    parser.add_argument("--from", metavar="S", dest="begin", type=float, default=0.0, help="of FILE; default its start")
    parser.add_argument("--seconds", metavar="S", type=float, default=20.0, help="default %(default)s")
    parser.add_argument("--hide", metavar="SHARE", type=float, default=0.2, help="markers hidden; default %(default)s")
    parser.add_argument("--skin", metavar="MM", type=float, default=0.6, help="sliding of skin; default %(default)s")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="default %(default)s")
    add_sizes(parser)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Without a file: angles and hidden markers of the built-in performer, whose truth is known. Labels are searched.

    With one: each marker is left out of the whole recording, the others carrying their names, and its predicted place
    held against where it was seen. What is not in the figures is then in them too: a marker that sits wrong in the
    profile.
    """
    warm_up()
    profile = load_profile(arguments.profile)
    if arguments.file is not None:
        return _hidden_in_turn(profile, arguments)
    return _performance(profile, arguments)


def _performance(profile: Profile, arguments: argparse.Namespace) -> dict[str, Any]:
    true = sized(profile, size_of(arguments, arguments.seed))
    performer, engine = Performer(true, seed=arguments.seed), Engine(profile)
    stream = MarkerStream(
        performer, 120.0, arguments.seed, hidden=arguments.hide, ghosts=0.3, skin_m=arguments.skin / 1e3
    )
    angles, markers, guessed = [], [], []
    for frame in islice(stream.frames(), round(arguments.seconds * 120.0)):
        truth = performer.at(frame.times.device_s)
        for hand in engine.step(frame).hands:
            if hand.state is HandState.TRACKED and frame.times.device_s > SETTLED_S:
                off_rad = np.abs(hand.theta_rad - truth.theta_rad[hand.side])[6:]
                off_m = np.linalg.norm(hand.markers_world_m - truth.markers_world_m[hand.side], axis=1)
                hidden = ~hand.observed
                angles.append(np.degrees([hand.theta_std[6:], off_rad]))
                markers.append(1e3 * np.array([hand.marker_std_m[hidden], off_m[hidden]]))
                guessed.append(guesses(hand.theta_std))
    share = float(np.mean(guessed)) if guessed else float("nan")
    print(
        f"{profile.layout.name}, a hand of {true.scale:g} times the template's size, "
        f"{100 * arguments.hide:.0f} % of the time hidden: {100 * share:.1f} % of joints a guess"
    )
    return {
        "angles_deg": _table("angles", "°", angles, STEPS_DEG),
        "hidden_markers_mm": _table("hidden markers", "mm", markers, STEPS_MM),
        "guessed": share,
        "seed": arguments.seed,
        "size": true.scale,
    }


def _hidden_in_turn(profile: Profile, arguments: argparse.Namespace) -> dict[str, Any]:
    recording = read_recording(arguments.file)
    labels = label_map(recording, profile)
    if labels is None:
        raise FormatError(
            f"{arguments.file} names no marker of {profile.layout.name}.", "Choose the --profile that it was made with."
        )
    first, last = (round(s * recording.rate_hz) for s in (arguments.begin, arguments.begin + arguments.seconds))
    frames = list(islice(recording.frames(), first, last))
    if not frames:
        raise FormatError(
            f"{arguments.file} ends before second {arguments.begin:g}.", f"It has {recording.duration_s:g} s."
        )
    pairs = []
    for identity, (side, marker) in labels.items():
        solved = solve([_without(frame, identity) for frame in frames], profile, labels=labels)
        for frame, tracked in zip(frames, solved, strict=True):
            truth_m = frame.points_m[frame.ids == identity]
            for hand in tracked.hands:
                if hand.side == side and hand.state is HandState.TRACKED and len(truth_m):
                    off_m = np.linalg.norm(hand.markers_world_m[marker] - truth_m[0])
                    pairs.append(1e3 * np.array([[hand.marker_std_m[marker]], [off_m]]))
    print(f"{arguments.file.name}, {len(frames):,} frames, each of {len(labels)} markers hidden in turn")
    return {"hidden_markers_mm": _table("hidden markers", "mm", pairs, STEPS_MM), "frames": len(frames)}


def _without(frame: MarkerFrame, identity: int) -> MarkerFrame:
    keep = frame.ids != identity
    return replace(frame, points_m=frame.points_m[keep], ids=frame.ids[keep], residuals_m=frame.residuals_m[keep])


def _table(what: str, unit: str, pairs: Iterable[FloatArray], steps: tuple[float, ...]) -> list[dict[str, Any]]:
    """Rows of stated against true. pairs: (2, k) each, standard deviations and absolute errors."""
    std, error = np.concatenate([np.empty((2, 0)), *pairs], axis=1)
    print(f"{what} [{unit}]: stated, true RMS, within one and two standard deviations")
    rows = []
    for low, high in (*pairwise(steps), (0.0, np.inf)):
        among = (std >= low) & (std < high)
        if not among.any():
            continue
        row = {
            "from": low,
            "to": None if np.isinf(high) else high,
            "n": int(among.sum()),
            "stated": float(np.sqrt(np.square(std[among]).mean())),
            "true": float(np.sqrt(np.square(error[among]).mean())),
            "within_1": float((error[among] < std[among]).mean()),
            "within_2": float((error[among] < 2.0 * std[among]).mean()),
        }
        rows.append(row)
        name = "all" if np.isinf(high) else f"{low:g} to {high:g}"
        print(
            f"  {name:10} n {row['n']:8,}  {row['stated']:6.2f}  {row['true']:6.2f}  "
            f"{100 * row['within_1']:4.0f} %  {100 * row['within_2']:4.0f} %"
        )
    return rows
