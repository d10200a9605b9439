"""Hand sequences with labels (.npz of Han 2018) tracked without labels or ids: labels right and RMS per user."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from app.tracking_figures import TrackFigures, figures, frames_and_columns
from core.engine import warm_up
from core.errors import FormatError
from core.profile import Profile, load_profile
from core.recording import Recording
from core.takes.reprocess import solve
from core.untrusted.npz import read_npz

TRUE_RATE_HZ = 30.0
"""The files say 120 Hz; the motion is that of a depth camera."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("files", metavar="FILE", nargs="+", type=Path, help="han_user*.npz")
    parser.add_argument("--count", metavar="N", type=int, default=3, help="sequences per file; default %(default)s")
    parser.add_argument("--least", metavar="N", type=int, default=200, help="frames at least; default %(default)s")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="which sequences; default %(default)s")
    parser.add_argument("--profile", metavar="P", default="han19", help="default %(default)s")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """What `phalanx track --unlabelled` does, on sequences drawn at random."""
    warm_up()
    profile = load_profile(arguments.profile)
    users = {}
    for path in arguments.files:
        found = [_track(recording, profile) for recording in _sequences(path, arguments)]
        frames = np.asarray([f.frames for f in found], dtype=np.float64)
        points = np.asarray([f.labelled_points for f in found], dtype=np.float64)
        user = users[path.stem] = {
            "sequences": len(found),
            "frames": int(frames.sum()),
            "tracked": float(np.average([f.tracked for f in found], weights=frames)),
            "labels_right": float(np.average([f.labels_right for f in found], weights=points)),
            "labels_right_worst": min(f.labels_right for f in found),
            "rms_m": float(np.sqrt(np.average(np.square([f.rms_m for f in found]), weights=frames))),
        }
        print(
            f"{path.stem}: {user['sequences']} sequences, {user['frames']:,} frames, "
            f"{100 * user['tracked']:.2f} % tracked, {100 * user['labels_right']:.2f} % of labels right "
            f"(worst sequence {100 * user['labels_right_worst']:.2f} %), RMS {1e3 * user['rms_m']:.2f} mm"
        )
    return {"users": users, "seed": arguments.seed, "least_frames": arguments.least}


def _sequences(path: Path, arguments: argparse.Namespace) -> list[Recording]:
    """Sequences of one hand each, left and right alike, drawn without replacement. Raises FormatError."""
    wanted = ("points", "hand", "sequence", "frame", "marker_names")
    data = read_npz(path, wanted, str(path), "Give files han_user*.npz.")
    points, hand, sequence, frame = (data[name] for name in wanted[:-1])
    labels = tuple(str(name) for name in data["marker_names"])
    keys, counts = np.unique(np.stack([sequence, hand]), axis=1, return_counts=True)
    keys = keys[:, counts >= arguments.least]
    chosen = np.random.default_rng(arguments.seed).permutation(keys.shape[1])[: arguments.count]
    recordings = []
    for number, side in keys[:, chosen].T:
        rows = (sequence == number) & (hand == side)
        name = f"{path.stem} sequence {number} {('left', 'right')[side]}"
        recordings.append(
            Recording(
                name,
                TRUE_RATE_HZ,
                (frame[rows] - frame[rows][0]) / TRUE_RATE_HZ,
                frame[rows].astype(np.int64),
                points[rows].astype(np.float64),
                labels,
                np.arange(len(labels)),
            )
        )
    if not recordings:
        raise FormatError(f"{path} has no sequence of {arguments.least} frames.", "Choose a lower --least.")
    return recordings


def _track(recording: Recording, profile: Profile) -> TrackFigures:
    frames, columns = frames_and_columns(recording, unlabelled=True)
    return figures(Path(recording.name), recording, profile, solve(frames, profile), columns)
