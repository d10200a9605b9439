"""Props among hands that hold them: how often they are tracked, how exactly, and at what cost."""

from __future__ import annotations

import argparse
from itertools import islice
from time import thread_time
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from app.people import add_sizes, said, size_of, sized
from core.engine import warm_up
from core.frames import NO_POINT, FloatArray
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile
from core.props.marked import marked
from core.props.tracker import Props

CASES = ((0.0, 0.0), (0.05, 2.0), (0.1, 2.0), (0.2, 4.0))
"""Share of the time a marker is hidden, and ghosts per frame."""

NEAR_M, NEAR_RAD = 0.001, np.radians(1.0)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument(
        "--frames", metavar="N", type=int, default=1800, help="of each performance; default %(default)s"
    )
    parser.add_argument("--performances", metavar="N", type=int, default=4, help="default %(default)s")
    parser.add_argument("--activity", metavar="WHAT", default="grasping", help="default %(default)s")
    parser.add_argument("--seed", metavar="N", type=int, default=100, help="of the first; default %(default)s")
    add_sizes(parser)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Two hands with han19, and three things of five markers, at 120 Hz."""
    warm_up()
    figures: dict[str, Any] = {"frames": arguments.frames, "performances": arguments.performances, "cases": []}
    seeds = range(arguments.seed, arguments.seed + arguments.performances)
    print(said(arguments, seeds))
    print("hidden ghosts | tracked, of what shows 3 markers | within 1 mm, 1 deg | worst       | wrong points | a prop")
    for hidden, ghosts in CASES:
        each = [_measured(arguments, seed, hidden, ghosts) for seed in seeds]
        way_m, turn_rad, time_s = (
            np.concatenate([one[name] for one in each]) for name in ("way_m", "turn_rad", "time_s")
        )
        due, wrong, points = (sum(one[name] for one in each) for name in ("due", "wrong", "points"))
        case = {
            "hidden": hidden,
            "ghosts": ghosts,
            "tracked": len(way_m) / due,
            "near": float(np.mean((way_m < NEAR_M) & (turn_rad < NEAR_RAD))),
            "worst_mm": 1e3 * float(way_m.max()),
            "worst_deg": float(np.degrees(turn_rad.max())),
            "wrong_points": wrong / max(points, 1),
            "cpu_us_median": 1e6 * float(np.median(time_s)),
            "cpu_us_p99": 1e6 * float(np.percentile(time_s, 99)),
        }
        figures["cases"].append(case)
        print(
            f"{hidden:6.0%} {ghosts:6.0f} | {case['tracked']:34.2%} | {case['near']:18.3%} | "
            f"{case['worst_mm']:4.2f} mm {case['worst_deg']:.1f}° | {case['wrong_points']:12.4%} | "
            f"{case['cpu_us_median']:.0f} us, 99 % below {case['cpu_us_p99']:.0f}"
        )
    return figures


def _measured(arguments: argparse.Namespace, seed: int, hidden: float, ghosts: float) -> dict[str, Any]:
    true = sized(load_profile("han19"), size_of(arguments, seed))
    performer = Performer(true, seed, arguments.activity)
    things = tuple(marked(name, thing, seed) for name, thing in performer.props.items())
    stream = MarkerStream(performer, 120.0, seed, hidden=hidden, ghosts=ghosts, props=things)
    first_of = dict(zip(performer.props, len(performer.labels) + 5 * np.arange(len(things)), strict=True))
    props = Props(things)
    way_m, turn_rad, time_s = [], [], []
    due = wrong = points = 0
    for i, sent in enumerate(islice(stream.labelled(), arguments.frames)):
        frame = sent.frame
        started = thread_time()
        props.step(frame.points_m, frame.ids, 1.0 / 120.0)
        time_s.append((thread_time() - started) / len(things))
        truth = performer.props_world(i / 120.0)
        for found in (tracker.frame(frame.points_m, np.arange(len(frame.ids))) for tracker in props.trackers):
            own = first_of[found.name] + np.arange(5)
            enough = np.isin(sent.truth, own).sum() >= 3
            due += enough
            if not found.tracked or not enough:
                continue
            seen = found.point != NO_POINT
            points += int(seen.sum())
            wrong += int((sent.truth[found.point[seen]] != own[seen]).sum())
            way_m.append(np.linalg.norm(found.transform_world[:3, 3] - truth[found.name][:3, 3]))
            turn_rad.append(_turn_rad(found.transform_world, truth[found.name]))
    return {
        "way_m": np.array(way_m), "turn_rad": np.array(turn_rad), "time_s": np.array(time_s),
        "due": due, "wrong": wrong, "points": points,
    }  # fmt: skip


def _turn_rad(one: FloatArray, other: FloatArray) -> float:
    return float(Rotation.from_matrix(one[:3, :3].T @ other[:3, :3]).magnitude())
