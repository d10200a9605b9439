"""Time of Engine.step for one and two hands, by stage, on the built-in performer."""

from __future__ import annotations

import argparse
import itertools
from time import perf_counter
from typing import Any

import numpy as np

from app.people import add_sizes, said, size_of, sized
from core.engine import Engine, warm_up
from core.frames import SIDES, HandState, Side
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile, load_profile

CASES: tuple[tuple[Side, ...], ...] = (("right",), SIDES)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("--profile", metavar="P", default="han19", help="default %(default)s")
    parser.add_argument("--frames", metavar="N", type=int, default=3600, help="default %(default)s")
    parser.add_argument("--rate", metavar="HZ", type=float, default=120.0, help="default %(default)s")
    parser.add_argument("--hide", metavar="SHARE", type=float, default=0.05, help="markers hidden; default %(default)s")
    parser.add_argument("--ghosts", metavar="N", type=float, default=0.5, help="mean per frame; default %(default)s")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="default %(default)s")
    add_sizes(parser)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Steps the engine over the same dressed performance for each number of hands."""
    warm_up()
    profile = load_profile(arguments.profile)
    figures = {"frames": arguments.frames, "hide": arguments.hide, "ghosts": arguments.ghosts, "seed": arguments.seed}
    print(said(arguments, [arguments.seed]))
    for sides in CASES:
        word = "one hand" if len(sides) == 1 else "two hands"
        case = _measure(profile.with_sides(sides), arguments)
        figures[word.replace(" ", "_")] = case
        print(
            f"{word}, {arguments.frames:,} frames, tracked {100 * case['tracked']:.2f} %, "
            f"labels {100 * case['labels_right']:.2f} %"
        )
        for stage, us in case["stages_us"].items():
            print(f"  {stage:10} median {us['median']:7.0f} us, 99 % below {us['p99']:7.0f}, most {us['max']:8.0f}")
    return figures


def _measure(profile: Profile, arguments: argparse.Namespace) -> dict[str, Any]:
    true = sized(profile, size_of(arguments, arguments.seed))
    stream = MarkerStream(
        Performer(true, seed=arguments.seed), arguments.rate, arguments.seed,
        hidden=arguments.hide, ghosts=arguments.ghosts, skin_m=0.0006,
    )  # fmt: skip
    frames = list(itertools.islice(stream.labelled(), arguments.frames))
    names = profile.layout.marker_names
    engine = Engine(profile)
    times: dict[str, list[float]] = {"step": []}
    tracked = right = labelled = 0
    for sent in frames:
        started = perf_counter()
        solved = engine.step(sent.frame)
        times["step"].append(perf_counter() - started)
        for stage, seconds in solved.stage_s.items():
            times.setdefault(stage, []).append(seconds)
        known = np.asarray([stream.labels[t] if 0 <= t < len(stream.labels) else "" for t in sent.truth])
        labelled += int(np.isin(known, [f"{side}_{name}" for side in profile.sides for name in names]).sum())
        for hand in solved.hands:
            tracked += hand.state is HandState.TRACKED
            right += sum(known[hand.point[k]] == f"{hand.side}_{names[k]}" for k in np.flatnonzero(hand.observed))
    return {
        "tracked": tracked / (len(frames) * len(profile.sides)),
        "labels_right": right / max(labelled, 1),
        "stages_us": {
            stage: {
                "median": 1e6 * float(np.median(seconds)),
                "p99": 1e6 * float(np.percentile(seconds, 99)),
                "max": 1e6 * max(seconds),
            }
            for stage, seconds in times.items()
        },
    }
