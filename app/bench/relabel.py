"""Labels found from the whole of a recording beside those of live tracking: frames right, ghosts, and time."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from app.commands.terminal import Progress
from app.people import add_sizes, said, size_of
from app.tracking_bench.glove import FILE, LAYOUT, glove_truth
from app.tracking_bench.scene import RATE_HZ, SKIN_M, as_calibrated, performed, person
from app.tracking_bench.score import GHOST, Truth, Verdict, judged, wanted_of
from core.engine import warm_up
from core.frames import NO_ID, NO_POINT, IntArray, Side
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile
from core.relabel.relabel import named_by, passes_over, settling_of
from core.relabel.teller import Teller
from core.takes.formats import read_recording
from core.takes.reprocess import solve_each

BOTH: tuple[Side, ...] = ("left", "right")
HIDDEN: dict[str, tuple[str, tuple[Side, ...]]] = {
    "one hand": ("everyday", ("right",)),
    "hands apart": ("free", BOTH),
    "hands interlacing": ("hands", BOTH),
}
"""What the performer does, and with which hands; markers hidden at random, each for itself."""

TABLE_3 = "hand-hand, as Han's"
GLOVE = "real glove"
GLOVE_GHOSTS, GLOVE_HIDDEN = 2.0, 0.1
METHODS = ("live", "backward", "both vote", "relabelled")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    known = [*HIDDEN, TABLE_3, GLOVE]
    parser.add_argument(
        "--only",
        metavar="NAME",
        nargs="+",
        choices=known,
        default=known,
        help="of " + ", ".join(known) + "; default all",
    )
    parser.add_argument("--seconds", metavar="S", type=float, default=20.0, help="of each; default %(default)s")
    parser.add_argument("--seeds", metavar="N", type=int, default=3, help="performers; default %(default)s")
    parser.add_argument("--seed", metavar="N", type=int, default=100, help="the first; default %(default)s")
    parser.add_argument("--hide", metavar="SHARE", type=float, default=0.3, help="of the time; default %(default)s")
    parser.add_argument("--ghosts", metavar="N", type=float, default=1.5, help="per frame; default %(default)s")
    add_sizes(parser)
    parser.add_argument("--no-ids", action="store_true", help="points without ids, in any order")
    parser.add_argument("--data", metavar="DIR", type=Path, help="folder of the recordings, for the real glove")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """One row for each kind of sequence."""
    warm_up()
    ids = "without ids" if arguments.no_ids else "ids break at every gap"
    print(
        f"{arguments.seconds:g} s each, {arguments.seeds} performer(s), "
        f"{said(arguments, range(arguments.seed, arguments.seed + arguments.seeds))},\n19 markers a hand each 1 mm off "
        f"the profile, {100 * arguments.hide:g} % hidden, {arguments.ghosts:g} ghosts a frame, "
        f"skin {1e3 * SKIN_M:g} mm, {ids}; "
        f"{TABLE_3}: gaps of Table 3, ghosts of Table 4.\nA frame is right when every marker seen has its name, hidden "
        "ones none, and ghosts none.\nlive: forward in time; backward: the same engine from the last frame to the "
        "first; both vote: tracklets by the votes\nof both; relabelled: as phalanx track. Time: of the processor, "
        "with solving and filling gaps."
    )
    print("                      | frames right [%]:" + "".join(f"{name:>11}" for name in METHODS)
          + " | labels live  relabelled | ghosts named live, relabelled | ms a frame  x real time  x live")  # fmt: skip
    figures: dict[str, Any] = {key: getattr(arguments, key) for key in ("seconds", "seeds", "seed", "hide", "ghosts")}
    for name in arguments.only:
        if name == GLOVE and arguments.data is None:
            print(f"  {GLOVE}: left out, it needs the folder of the recordings as --data")
            continue
        figures[name] = _row(name, arguments)
    return figures


def _row(name: str, arguments: argparse.Namespace) -> dict[str, Any]:
    progress = Progress(name)
    found: dict[str, list[Verdict]] = {method: [] for method in METHODS}
    live_s = whole_s = seconds = 0.0
    n_frames, count = 0, 1 if name == GLOVE else arguments.seeds
    for seed in range(arguments.seed, arguments.seed + count):
        truth, rate_hz = _truth(name, seed, arguments)
        if arguments.no_ids:
            frames = [replace(frame, ids=np.full(len(frame.ids), NO_ID)) for frame in truth.frames]
            truth = replace(truth, frames=frames)
        verdicts, live, whole = _measured(truth, lambda share, text: progress(share, text))
        for method, verdict in verdicts.items():
            found[method].append(verdict)
        live_s, whole_s = live_s + live, whole_s + whole
        n_frames, seconds = n_frames + len(truth.frames), seconds + len(truth.frames) / rate_hz
    progress.done()
    right = {method: 100.0 * float(np.concatenate([v.right for v in all_]).mean()) for method, all_ in found.items()}
    labels, ghosts = {}, {}
    for method, all_ in found.items():
        good, seen = np.sum([verdict.seen_right() for verdict in all_], axis=0)
        labels[method] = 100.0 * float(good / max(seen, 1))
        ghosts[method] = sum(verdict.causes()[GHOST] for verdict in all_)
    row = {
        "frames": n_frames, "frames_right": right, "labels_right": labels, "ghosts_named": ghosts,
        "ms_a_frame": 1e3 * whole_s / n_frames, "times_real_time": seconds / whole_s, "times_live": whole_s / live_s,
    }  # fmt: skip
    print(
        f"  {name:19} | {'':17}" + "".join(f"{right[method]:11.2f}" for method in METHODS)
        + f" | {labels['live']:11.3f} {labels['relabelled']:11.3f} | {ghosts['live']:18d}, {ghosts['relabelled']:10d}"
        f" | {row['ms_a_frame']:10.2f} {row['times_real_time']:12.1f} {row['times_live']:7.1f}"
    )  # fmt: skip
    return row


def _truth(name: str, seed: int, arguments: argparse.Namespace) -> tuple[Truth, float]:
    if name == GLOVE:
        recording, profile = read_recording(arguments.data / FILE), load_profile(LAYOUT)
        n = min(round(arguments.seconds * recording.rate_hz), recording.n_frames)
        return glove_truth(recording, profile, 0, n, GLOVE_GHOSTS, GLOVE_HIDDEN, seed), recording.rate_hz
    if name == TABLE_3:
        truth = performed("hand-hand", seed, arguments.seconds, size=size_of(arguments, seed)).truth
        return replace(truth, profiles=(as_calibrated(truth.profiles[0], seed),)), RATE_HZ
    activity, sides = HIDDEN[name]
    true = person(seed, size=size_of(arguments, seed)).with_sides(sides)
    stream = MarkerStream(
        Performer(true, seed, activity), RATE_HZ, seed, hidden=arguments.hide, ghosts=arguments.ghosts, skin_m=SKIN_M
    )
    sent = list(islice(stream.labelled(), round(arguments.seconds * RATE_HZ)))
    wanted = wanted_of([one.truth for one in sent], len(sides), len(true.layout.marker_names))
    return Truth(name, (as_calibrated(true, seed),), [one.frame for one in sent], wanted), RATE_HZ


def _measured(truth: Truth, progress: Any) -> tuple[dict[str, Verdict], float, float]:
    """What each method makes of a sequence, and the seconds that live solving and relabelling took."""
    frames, cast, teller = truth.frames, truth.profiles, Teller(progress, len(truth.frames))
    began_s = process_time()
    solved = [one for _, one in solve_each(frames, cast, fill=True)]
    live_s = process_time() - began_s
    began_s = process_time()
    passes = passes_over(frames, cast, teller)
    result = named_by(frames, cast, passes, teller)
    again = [one for _, one in solve_each(result.named(frames), cast, result.labels, fill=True)]
    whole_s = process_time() - began_s
    votes = settling_of(frames, cast, passes, Teller(None, len(frames))).by_votes()

    def named(name: IntArray) -> Iterator[IntArray]:
        return (name[passes.cloud.rows(i)] for i in range(len(frames)))

    return {
        "live": judged(truth, solved),
        "backward": _by_name(truth, named(passes.backward.name)),
        "both vote": _by_name(truth, named(votes[passes.cloud.tracklet])),
        "relabelled": judged(truth, again),
    }, live_s, whole_s  # fmt: skip


def _by_name(truth: Truth, names: Iterator[IntArray]) -> Verdict:
    """names: of each frame's points, as core.relabel numbers them; below 0 for none."""
    point = np.full_like(truth.wanted, NO_POINT)
    for f, name in enumerate(names):
        own = np.flatnonzero(name >= 0)
        point[f].reshape(-1)[name[own]] = own
    return Verdict(truth, point)
