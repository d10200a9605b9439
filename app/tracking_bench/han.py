"""Han's own sequences at their true 30 Hz over the wire, both hands, unlabelled, ids broken: labels that are right."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.commands.terminal import Progress
from app.tracking_bench.score import Truth, judged, listed, wanted_of
from app.tracking_bench.wire import received
from core.engine import Engine, warm_up
from core.errors import FormatError
from core.frames import SIDES, FloatArray, IntArray, MarkerFrame, Times, TrackedFrame
from core.profile import Profile, load_profile
from core.untrusted.npz import read_npz

NEEDS = ("han2018",)
RATE_HZ = 30.0
"""The files say 120; the motion is that of a depth camera."""
LAYOUT = "han19"
USERS = (1, 2, 3, 4)
ID_LIFE_FRAMES = 15.0
"""Mean number of frames that a marker keeps its id: half a second."""
LEAD_IN_FRAMES, PAUSE_FRAMES = 60, 15
"""Without points: until the client has connected, and between sequences."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this experiment."""
    parser.add_argument("--sequences", metavar="N", type=int, default=4, help="han: of each user; default %(default)s")
    parser.add_argument("--users", metavar="N", type=int, nargs="+", default=list(USERS), help="han: default all")
    parser.add_argument(
        "--without-wire", action="store_true", help="han: hand the frames to the engine at once, not over the network"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """One row per user."""
    profile = load_profile(LAYOUT)
    warm_up()  # frames do not wait
    print(
        f"  {arguments.sequences} sequences of each user, drawn at random, left and right hand of the same frames\n"
        "  side by side; 19 markers each, never hidden, +-3.2 mm of jitter in the files; an id lasts half a second on\n"
        "  the average. The engine knows the layout and nothing of the user, and begins anew with every sequence."
    )
    print("  user | sequences frames (received) | frames right | labels right | worst sequence | longest wrong | swaps")
    figures: dict[str, Any] = {"wire": not arguments.without_wire}
    for user in arguments.users:
        figures[f"user{user}"] = _user(user, profile, arguments)
    return figures


@dataclass(frozen=True)
class Both:
    """Both hands: points_m (f, 2, m, 3) [m], left and right; frames (f,), as the file counts them."""

    number: int
    points_m: FloatArray
    frames: IntArray


def _user(user: int, profile: Profile, arguments: argparse.Namespace) -> dict[str, Any]:
    random = np.random.default_rng([arguments.seed, user])
    chosen = _sequences(arguments.data / "han2018" / f"han_user{user}.npz", profile, random, arguments.sequences)
    truths = [_sent(f"user {user}, sequence {one.number}", one, profile, random) for one in chosen]
    verdicts = [
        judged(truth, solved) for truth, solved in _solved(truths, profile, f"user {user}", arguments.without_wire)
    ]
    came = sum(len(verdict.point) for verdict in verdicts)
    seen = np.sum([verdict.seen_right() for verdict in verdicts], axis=0)
    row = {
        "sequences": len(truths),
        "sent": sum(len(truth.frames) for truth in truths),
        "received": came,
        "frames_right": float(np.concatenate([verdict.right for verdict in verdicts]).mean()),
        "labels_right": float(seen[0] / max(seen[1], 1)),
        "worst_sequence": min(verdict.seen_right()[0] / max(verdict.seen_right()[1], 1) for verdict in verdicts),
        "longest_wrong_frames": max((n for verdict in verdicts for _, n in verdict.stretches()), default=0),
        "side_swaps": sum(verdict.side_swaps() for verdict in verdicts),
    }
    print(
        f"  {user:4} | {row['sequences']:9} {row['sent']:6} ({row['received']:6})  | "
        f"{100 * row['frames_right']:10.2f} % | {100 * row['labels_right']:10.3f} % | "
        f"{100 * row['worst_sequence']:12.2f} % | "
        f"{row['longest_wrong_frames']:6} frames | {row['side_swaps']:5}"
    )
    listed(verdicts, arguments.failures)
    return row


def _solved(
    truths: list[Truth], profile: Profile, what: str, at_once: bool
) -> Iterator[tuple[Truth, list[TrackedFrame]]]:
    """Every sequence, those of its frames that came, and their poses."""
    empty = MarkerFrame(0, Times(0.0, 0.0, 0.0), np.empty((0, 3)), np.empty(0, dtype=np.int64), np.empty(0))
    sent, starts = [empty] * LEAD_IN_FRAMES, []
    for truth in truths:
        starts.append(len(sent))
        sent += [*truth.frames, *[empty] * PAUSE_FRAMES]
    engine, progress = Engine(profile), Progress(what)
    rows: list[list[int]] = [[] for _ in truths]
    solved: list[list[TrackedFrame]] = [[] for _ in truths]
    frames = _numbered(sent) if at_once else received(sent, RATE_HZ)
    now = -1
    for frame in frames:
        which = int(np.searchsorted(starts, frame.sequence, side="right")) - 1
        row = frame.sequence - starts[which]
        if which < 0 or row >= len(truths[which].frames):
            continue
        if which != now:
            engine.reset()
            now = which
        rows[which].append(row)
        solved[which].append(engine.step(frame))
        progress(frame.sequence / len(sent))
    progress.done()
    for truth, came, poses in zip(truths, rows, solved, strict=True):
        if came:
            kept = [truth.frames[row] for row in came]
            yield Truth(truth.title, truth.profiles, kept, truth.wanted[came]), poses


def _numbered(frames: list[MarkerFrame]) -> Iterator[MarkerFrame]:
    for number, frame in enumerate(frames):
        time_s = number / RATE_HZ
        yield MarkerFrame(number, Times(time_s, time_s, time_s), frame.points_m, frame.ids, frame.residuals_m)


def _sent(title: str, sequence: Both, profile: Profile, random: np.random.Generator) -> Truth:
    """The points in random order; every marker's id ends now and then, and where frames are missing."""
    f, hands, m, _ = sequence.points_m.shape
    n = hands * m
    ids, next_id = np.zeros(n, dtype=np.int64), 1
    frames, truth = [], []
    for i in range(f):
        broken = random.random(n) < 1.0 / ID_LIFE_FRAMES
        if i == 0 or sequence.frames[i] != sequence.frames[i - 1] + 1:
            broken[:] = True
        ids[broken] = next_id + np.arange(int(broken.sum()))
        next_id += int(broken.sum())
        order = random.permutation(n)
        time_s = float(sequence.frames[i] - sequence.frames[0]) / RATE_HZ
        points = sequence.points_m[i].reshape(n, 3)[order]
        frames.append(MarkerFrame(i, Times(time_s, time_s, time_s), points, ids[order].copy(), np.full(n, np.nan)))
        truth.append(order)
    return Truth(title, (profile,), frames, wanted_of(truth, hands, m))


def _sequences(path: Path, profile: Profile, random: np.random.Generator, count: int) -> list[Both]:
    """Sequences of both hands, drawn without replacement. Raises FormatError."""
    mend = "Give --data the folder with han2018/ in it."
    data = read_npz(path, ("marker_names", "points", "hand", "sequence", "frame"), str(path), mend)
    try:
        names = [str(name) for name in data["marker_names"]]
        order = [names.index(name) for name in profile.layout.marker_names]
        points = data["points"][:, order].astype(np.float64)
    except (ValueError, LookupError) as error:
        raise FormatError(f"{path} cannot be read ({error}).", mend) from error
    hand, sequence, frame = data["hand"], data["sequence"], data["frame"].astype(np.int64)
    lefts = np.unique(sequence[hand == SIDES.index("left")])
    found = []
    for number in random.permutation(lefts):
        left, right = sequence == number, sequence == number + 1  # the files hold them in turns
        common, a, b = np.intersect1d(frame[left], frame[right], return_indices=True)
        if len(common):
            found.append(Both(int(number), np.stack([points[left][a], points[right][b]], axis=1), common))
        if len(found) == count:
            break
    return found
