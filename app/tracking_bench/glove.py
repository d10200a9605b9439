"""The real glove from any frame on, among the markers of the room: time until every label is right."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from app.commands.terminal import Progress
from app.tracking_bench.scene import Curtained
from app.tracking_bench.score import Truth, Verdict, tracked, wanted_of
from core.errors import FormatError
from core.frames import BoolArray
from core.motion.stream import MarkerStream
from core.profile import Profile, load_profile
from core.recording import Recording
from core.takes.formats import read_recording

NEEDS = ("qualisys_hand",)
FILE = Path("qualisys_hand") / "recording.tsv"
LAYOUT = "qualisys13"
GOAL_S, STAYS_S = 1.0, 2.0
CONDITIONS = {"as recorded": (0.0, 0.0), "2 ghosts, 10 % hidden": (2.0, 0.1)}
"""Mean number of ghosts a frame, and share of the time that a marker is hidden besides the recording's own gaps."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this experiment."""
    parser.add_argument(
        "--starts", metavar="N", type=int, default=60, help="glove: begun so often; default %(default)s"
    )
    parser.add_argument(
        "--glove-profile", metavar="P", default=LAYOUT, help="glove: default the layout alone, %(default)s"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """One row for each of CONDITIONS."""
    recording, profile = read_recording(arguments.data / FILE), load_profile(arguments.glove_profile)
    others = len(recording.labels) - len(profile.layout.marker_names)
    print(
        f"  {recording.n_frames:,} frames at {recording.rate_hz:g} Hz, 13 markers of the hand and {others} others; the "
        f"engine begins\n  anew at each of {arguments.starts} frames, evenly spread, and sees {GOAL_S + STAYS_S:g} s "
        f"without names, in any order; ids\n  break at every gap. Right within 1 s: from a frame of the first second "
        f"on, every marker seen has its name for {STAYS_S:g} s.\n  Hidden too: and no hidden one ever has a point. [s]"
    )
    print(
        "                         | right within 1 s | hidden too | median  worst | labels right | frames right, later"
    )
    return {name: _row(name, recording, profile, arguments) for name in CONDITIONS}


def _row(name: str, recording: Recording, profile: Profile, arguments: argparse.Namespace) -> dict[str, Any]:
    rate = recording.rate_hz
    goal, stays = round(GOAL_S * rate), round(STAYS_S * rate)
    starts = np.linspace(0, recording.n_frames - goal - stays, arguments.starts).astype(np.int64)
    waits, strictly, right, seen, frames_right, lines = [], 0, 0, 0, [], []
    progress = Progress(name)
    for number, start in enumerate(starts):
        verdict = from_frame(recording, profile, int(start), goal + stays, *CONDITIONS[name], arguments.seed + number)
        waits.append(frames_until(verdict.seen_all_right, goal, stays))
        strictly += frames_until(verdict.right, goal, stays) is not None
        later = Verdict(
            Truth(
                verdict.truth.title, verdict.truth.profiles, verdict.truth.frames[goal:], verdict.truth.wanted[goal:]
            ),
            verdict.point[goal:],
        )
        good, all_ = later.seen_right()
        right, seen = right + good, seen + all_
        frames_right.append(float(later.right.mean()))
        lines += [failure.line for failure in later.failures()]
        progress((number + 1) / len(starts))
    progress.done()
    found = np.array([wait for wait in waits if wait is not None]) / rate
    row = {
        "starts": len(waits),
        "within_goal": len(found) / len(waits),
        "within_goal_hidden_too": strictly / len(waits),
        "median_s": float(np.median(found)) if len(found) else None,
        "worst_s": float(found.max()) if len(found) else None,
        "labels_right_after": right / max(seen, 1),
        "frames_right_after": float(np.mean(frames_right)),
    }
    median, worst = ("none" if row[key] is None else f"{row[key]:.2f}" for key in ("median_s", "worst_s"))
    print(
        f"  {name:22} | {len(found):6} of {len(waits):3}    | {strictly:10} | {median:>6} {worst:>6} | "
        f"{100 * row['labels_right_after']:10.3f} % | {100 * row['frames_right_after']:10.2f} %"
    )
    for line in lines[: arguments.failures]:
        print(f"      {line}")
    return row


def frames_until(right: BoolArray, goal: int, stays: int) -> int | None:
    """Frames before the first from which on `stays` are right, no more than `goal`; None if there is none."""
    return next((f for f in range(goal + 1) if right[f : f + stays].all()), None)


def from_frame(
    recording: Recording, profile: Profile, start: int, frames: int, ghosts: float, hidden: float, seed: int
) -> Verdict:
    """Some frames of the recording, tracked by an engine that has seen none before. Raises FormatError."""
    return tracked(glove_truth(recording, profile, start, frames, ghosts, hidden, seed))


def glove_truth(
    recording: Recording, profile: Profile, start: int, frames: int, ghosts: float, hidden: float, seed: int
) -> Truth:
    """Some frames of the recording without their names. Raises FormatError."""
    names = profile.layout.marker_names
    missing = [name for name in names if name not in recording.labels]
    if missing:
        raise FormatError(f"{recording.name} has no marker {missing[0]!r}.", f"Give a recording of the glove {LAYOUT}.")
    own = [recording.labels.index(name) for name in names]
    columns = own + [column for column in range(len(recording.labels)) if column not in own]
    points = recording.points_m[start : start + frames, columns]
    source = Curtained(tuple(recording.labels[column] for column in columns), points, np.isnan(points[:, :, 0]))
    stream = MarkerStream(source, recording.rate_hz, seed, ghosts=ghosts, hidden=hidden, noise_m=0.0)
    sent = list(stream.labelled())
    wanted = wanted_of([one.truth for one in sent], 1, len(own))
    return Truth(f"from frame {start}", (profile,), [one.frame for one in sent], wanted)
