"""One quantity at a time over the whole of its range: rates, reflections, noise, distances, layouts, speeds, clocks."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.commands.terminal import Progress
from app.people import said, size_of
from app.tracking_bench.scene import NOISE_M, RATE_HZ, SKIN_M, Curtained, as_calibrated, as_generic, person
from app.tracking_bench.score import Truth, listed, tracked, wanted_of
from core.frames import Times
from core.motion.performer import Performer
from core.motion.stream import MarkerStream

SECONDS = 4.0
ACTIVITY = "hands"
KNOWN = {"calibrated": as_calibrated, "generic": lambda true, _: as_generic(true)}
SETTLED_S = 1.0
"""After the start: what is counted of later frames is no matter of finding the hands."""


@dataclass(frozen=True)
class Setting:
    """What a sequence is made with. ghosts: mean per frame. hidden: share of the time. away_m: of the hands from the
    origin. apart_m: of the hands from each other, beyond what the performer has. speed: of the motion to the
    performer's. clock_s: of the device at the first frame. bodies: of four markers, in the volume besides."""

    rate_hz: float = RATE_HZ
    ghosts: float = 1.0
    hidden: float = 0.05
    noise_m: float = NOISE_M
    skin_m: float = SKIN_M
    away_m: float = 0.0
    apart_m: float = 0.0
    speed: float = 1.0
    clock_s: float = 0.0
    bodies: int = 0
    layout: str = "han19"
    size: float | None = None


LAYOUTS = ("han19", "schroeder17", "alexanderson13", "qualisys13", "pavllo9", "schroeder8", "schroeder6")
QUANTITIES: dict[str, tuple[str, Sequence[float | int | str]]] = {
    "rate_hz": ("frames a second", (30.0, 60.0, 120.0, 240.0, 480.0, 960.0)),
    "ghosts": ("ghosts a frame, beside the hands", (0.0, 4.0, 15.0, 40.0, 80.0)),
    "bodies": ("rigid bodies of 4 markers in the volume", (0, 10, 50)),
    "hidden": ("share of the time that a marker is hidden", (0.0, 0.1, 0.3, 0.5)),
    "noise_m": ("noise per axis [m]", (0.00002, 0.0001, 0.0005, 0.001, 0.002)),
    "skin_m": ("skin against bone, RMS [m]", (0.0, 0.001, 0.002, 0.004)),
    "away_m": ("from the origin [m]", (0.0, 10.0, 100.0, 1000.0)),
    "apart_m": ("hands further apart by [m]", (0.0, 0.1, 0.3, 1.0, 5.0)),
    "speed": ("motion to the performer's", (0.25, 0.5, 1.0, 2.0, 3.0)),
    "clock_s": ("the device's clock at the start [s]", (0.0, 1e6, 1.7e9)),
    "layout": ("layout", LAYOUTS),
    "size": ("size of the hand to the template's", (0.65, 0.75, 0.85, 1.0, 1.15, 1.25, 1.35)),
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this experiment."""
    parser.add_argument(
        "--quantities", metavar="NAME", nargs="+", choices=QUANTITIES, default=list(QUANTITIES),
        help="ranges: of " + ", ".join(QUANTITIES),
    )  # fmt: skip
    parser.add_argument(
        "--range-seconds", metavar="S", type=float, default=SECONDS, help="ranges: of each; default %(default)s"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """One row for each value of each quantity; all others are as in the middle of their ranges."""
    seeds = range(arguments.seed, arguments.seed + arguments.seeds)
    print(
        f"  Two hands that meet, {arguments.range_seconds:g} s of each of {arguments.seeds} performers: "
        f"{said(arguments, seeds)}.\n  Where nothing else is said: 120 Hz, 19 markers, 1 ghost a frame, 5 % hidden, "
        f"noise 0.05 mm, skin 0.6 mm. Calibrated: the\n  performer's profile; generic: the layout alone. Later: from "
        f"{SETTLED_S:g} s on. [%]"
    )
    print("                      | calibrated: frames right   later   labels right | generic: frames right   later   "
          "labels right")  # fmt: skip
    figures: dict[str, Any] = {}
    for name in arguments.quantities:
        what, values = QUANTITIES[name]
        print(f"  {what}")
        figures[name] = {str(value): _row(name, value, seeds, arguments) for value in values}
    return figures


def _row(name: str, value: Any, seeds: Sequence[int], arguments: argparse.Namespace) -> dict[str, Any]:
    progress, row, verdicts = Progress(f"{name}, {value}"), {}, []
    for known in KNOWN:
        each = []
        for seed in seeds:
            setting = replace(Setting(size=size_of(arguments, seed)), **{name: value})
            each.append(tracked(made(setting, seed, known, arguments.range_seconds)))
        settled = round(SETTLED_S * (value if name == "rate_hz" else RATE_HZ))
        seen = np.sum([verdict.seen_right() for verdict in each], axis=0)
        row[known] = {
            "frames_right": 100.0 * float(np.mean([verdict.right.mean() for verdict in each])),
            "later": 100.0 * float(np.mean([verdict.right[settled:].mean() for verdict in each])),
            "labels_right": 100.0 * float(seen[0] / max(seen[1], 1)),
        }
        verdicts += each
    progress.done()
    cells = (
        f"{row[known]['frames_right']:{width}.2f} {row[known]['later']:7.2f} {row[known]['labels_right']:14.2f}"
        for known, width in (("calibrated", 24), ("generic", 21))
    )
    print(f"    {value:>17} | " + " | ".join(cells))
    listed(verdicts, arguments.failures)
    return row


def made(setting: Setting, seed: int, known: str, seconds: float) -> Truth:
    """A sequence as a device sends it. known: of KNOWN."""
    true = person(seed, setting.layout, setting.size)
    true = true.with_sides(true.layout.sides)
    performer = Performer(true, seed, ACTIVITY)
    n = round(seconds * setting.rate_hz)
    at_s = setting.speed * np.arange(n) / setting.rate_hz
    points = np.stack([np.concatenate(list(performer.at(t).markers_world_m.values())) for t in at_s])
    points[:, [label.startswith("left") for label in performer.labels], 0] -= setting.apart_m
    points += setting.away_m * np.array([0.6, 0.0, 0.8])
    source = Curtained(performer.labels, points, np.zeros(points.shape[:2], dtype=np.bool_))
    stream = MarkerStream(
        source, setting.rate_hz, seed, hidden=setting.hidden, ghosts=setting.ghosts, noise_m=setting.noise_m,
        skin_m=setting.skin_m, bodies=setting.bodies,
    )  # fmt: skip
    sent = list(stream.labelled())
    frames = [
        replace(one.frame, times=Times(*(3 * [one.frame.times.device_s + setting.clock_s])))
        if setting.clock_s
        else one.frame
        for one in sent
    ]
    hands, markers = len(true.sides), len(true.layout.marker_names)
    wanted = wanted_of([one.truth for one in sent], hands, markers)
    return Truth(f"{setting}, seed {seed}", (KNOWN[known](true, seed),), frames, wanted)
