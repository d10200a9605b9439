"""What following hands costs: the engine alone, and two performers with their props over the wire at 120 Hz."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from time import thread_time
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from app.loopback import serving
from app.people import said, size_of
from app.session import Session
from app.tracking_bench.gaps import TABLE_3, hidden_as_in
from app.tracking_bench.scene import NOISE_M, RATE_HZ, Curtained, as_calibrated, as_generic, performed, person
from app.tracking_bench.sight import in_the_way, sightings, studio
from app.tracking_bench.wire import written
from core.engine import Engine, warm_up
from core.errors import DeviceError
from core.frames import SIDES, HandState, IntArray, MarkerFrame, Side
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile
from core.props.marked import marked
from core.props.prop import Prop
from devices.natnet.client import NatNetDevice

GHOSTS = 4.0
APART_M = 0.9
ACTIVITY = "grasping"
QUIET_S = 2.0
READY_S, FIRST_S = 180.0, 20.0

HANDS: dict[str, tuple[Side, ...]] = {"one hand": ("right",), "two hands": SIDES}
ANEW_FRAMES = 24
SCRAMBLED_M = 0.03


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this experiment."""
    parser.add_argument(
        "--live-seconds", metavar="S", type=float, default=30.0, help="cost: over the wire; default %(default)s"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """The engine's step for one hand and for two, then four hands and two props live."""
    warm_up()
    print(
        "  Engine.step on hand-hand sequences (gaps, ghosts and noise as in kinds) [ms], time of the processor in the\n"
        f"  engine's thread; {said(arguments, [arguments.seed])}. Followed: all hands were tracked\n"
        f"  before; found: begun anew every {ANEW_FRAMES} frames, the steps until all hands are tracked; never found: "
        f"every marker\n  {1e3 * SCRAMBLED_M:g} mm aside, a cluster that is no hand"
    )
    figures: dict[str, Any] = {}
    for name, sides in HANDS.items():
        figures[name] = _steps(name, sides, arguments)
    figures["live"] = _live(arguments)
    return figures


def _steps(name: str, sides: tuple[Side, ...], arguments: argparse.Namespace) -> dict[str, dict[str, float]]:
    seconds = min(arguments.seconds, 20.0)
    truth = performed("hand-hand", arguments.seed, seconds, size=size_of(arguments, arguments.seed)).truth
    own = {"left": slice(0, 1), "right": slice(1, 2)}[sides[0]] if len(sides) == 1 else slice(0, 2)
    true = truth.profiles[0]
    frames = [_of_hands(frame, truth.wanted[f], own) for f, frame in enumerate(truth.frames)]
    known, generic = as_calibrated(true, arguments.seed).with_sides(sides), as_generic(true).with_sides(sides)
    scrambled = _scrambled(frames, arguments.seed)
    rows = {
        "followed": _spent(known, frames, searching=False),
        "found": _spent(known, frames, anew=ANEW_FRAMES),
        "found, generic": _spent(generic, frames, anew=ANEW_FRAMES),
        "never found": _spent(generic, scrambled),
    }
    figures = {what: _percentiles(spent) for what, spent in rows.items()}
    for what, row in figures.items():
        print(
            f"  {name:9} {what:14} {row['steps']:5.0f} steps: median {row['median_ms']:.2f}, 99 % below "
            f"{row['p99_ms']:.2f}, worst {row['worst_ms']:.1f}; {100 * row['over_budget']:.2f} % above "
            f"{1e3 / RATE_HZ:.1f}"
        )
    return figures


def _spent(
    profile: Profile, frames: Sequence[MarkerFrame], searching: bool = True, anew: int | None = None
) -> list[float]:
    """[s] of the thread for every step before which some hand was missing (searching), or none was."""
    engine, spent, tracked = Engine(profile), [], False
    for f, frame in enumerate(frames):
        if anew is not None and f % anew == 0:
            engine.reset()
            tracked = False
        began = thread_time()
        solved = engine.step(frame)
        if tracked is not searching:
            spent.append(thread_time() - began)
        tracked = all(hand.state is HandState.TRACKED for hand in solved.hands)
    return spent


def _percentiles(spent: Sequence[float]) -> dict[str, float]:
    if not spent:
        return {"steps": 0, **dict.fromkeys(("median_ms", "p99_ms", "worst_ms", "over_budget"), float("nan"))}
    at = {"median_ms": 50, "p99_ms": 99, "worst_ms": 100}
    row = {key: 1e3 * float(np.percentile(spent, share)) for key, share in at.items()}
    return {"steps": len(spent), **row, "over_budget": float(np.mean(np.array(spent) > 1.0 / RATE_HZ))}


def _of_hands(frame: MarkerFrame, wanted: IntArray, own: slice) -> MarkerFrame:
    """The frame without the markers of other hands."""
    kept = np.setdiff1d(np.arange(len(frame.ids)), np.setdiff1d(wanted, wanted[own]))
    return replace(frame, points_m=frame.points_m[kept], ids=frame.ids[kept], residuals_m=frame.residuals_m[kept])


def _scrambled(frames: Sequence[MarkerFrame], seed: int) -> list[MarkerFrame]:
    """Every id's point moved aside, the same way as long as it is seen."""
    random = np.random.default_rng([seed, 4])
    most = 1 + max(int(frame.ids.max(initial=0)) for frame in frames)
    aside = random.normal(size=(most, 3))
    aside *= SCRAMBLED_M / np.linalg.norm(aside, axis=1, keepdims=True)
    return [replace(frame, points_m=frame.points_m + aside[frame.ids]) for frame in frames]


@dataclass(frozen=True)
class Cast:
    """Two performers in one volume. profiles: as calibrated, each with one prop. frames: of the device."""

    profiles: tuple[Profile, Profile]
    frames: list[MarkerFrame]


def _live(arguments: argparse.Namespace) -> dict[str, Any]:
    """As the application runs it: server in a process of its own, receiver thread, bounded queue, engine thread."""
    print(
        f"  Two performers who take things up, {APART_M} m apart, 4 x 19 markers, a prop each, {GHOSTS:g} ghosts a "
        f"frame, gaps as of\n  hand-hand; {arguments.live_seconds:g} s over loopback at {RATE_HZ:g} Hz"
    )
    cast = both(arguments.seed, arguments.live_seconds, [size_of(arguments, arguments.seed + k) for k in (0, 1)])
    session = Session(cast.profiles)
    session.start()
    try:
        session.wait_ready(READY_S)
        with written(cast.frames, RATE_HZ) as path, serving(["--motion", str(path), "--once"]) as (command, data, _):
            stream = session.add_device(NatNetDevice, {"command_port": command, "data_port": data})
            session.connect(stream)
            steps, latencies, tracked = [], [], []
            for numbers, hands in _until_quiet(session, stream):
                steps.append(numbers.step_s)
                latencies.append(numbers.latency_p99_s)
                tracked.append(hands)
            health, solver = stream.device.health(), session.numbers().solver
            session.disconnect(stream)
    finally:
        session.close()
    dropped = sum(solver.dropped.values())
    row = {
        "sent": len(cast.frames),
        "received": health.received,
        "lost": health.lost,
        "solved": solver.solved,
        "dropped": dropped,
        "dropped_by_reason": solver.dropped,
        "step_median_ms": 1e3 * float(np.nanmedian(steps)),
        "step_worst_second_ms": 1e3 * float(np.nanmax(steps)),
        "latency_p99_worst_second_ms": 1e3 * float(np.nanmax(latencies)),
        "hands_tracked": float(np.mean(tracked)),
    }
    print(
        f"  sent {row['sent']:,}, received {row['received']:,} ({row['lost']} lost on the way) = solved "
        f"{row['solved']:,} + dropped {dropped}; goal: 0 dropped\n"
        f"  solver thread {row['step_median_ms']:.2f} ms a frame (median; {row['step_worst_second_ms']:.2f} in the "
        f"worst second), exposure to pose 99 % below {row['latency_p99_worst_second_ms']:.1f} ms in the worst second; "
        f"{row['hands_tracked']:.2f} of 4 hands tracked"
    )
    return row


def _until_quiet(session: Session, stream: Any) -> Iterator[tuple[Any, int]]:
    """The solver's figures and the number of tracked hands, every half second, until no frame comes any more and none
    waits. Raises DeviceError if none came."""
    last, count = time.monotonic(), 0
    while time.monotonic() - last < (QUIET_S if count else FIRST_S) or session.numbers().queue_depth:
        time.sleep(0.5)
        received = stream.device.health().received
        if received > count:
            last, count = time.monotonic(), received
            newest = session.latest.peek()
            hands = newest.solved.hands if newest is not None else ()
            yield session.numbers().solver, sum(hand.state is HandState.TRACKED for hand in hands)
    if not count:
        raise DeviceError("No frame arrived.", stream.device.health().reason)


def both(seed: int, seconds: float, sizes: Sequence[float | None] = (None, None)) -> Cast:
    """Two performers, the second beside the first and turned, with what they take up. sizes: of their hands."""
    n = round(seconds * RATE_HZ)
    profiles, points, hidden, labels = [], [], [], []
    for number in (0, 1):
        true = person(seed + number, size=sizes[number])
        performer = Performer(true, seed + number, ACTIVITY)
        times_s = np.arange(n) / RATE_HZ
        own = np.stack([np.concatenate(list(performer.at(t).markers_world_m.values())) for t in times_s])
        counts = sightings(own, in_the_way(performer, times_s), studio())
        prop = _prop(performer, number)
        of_prop = np.stack([prop.placed_m(performer.props_world(t)[prop.name]) for t in times_s])
        turn = Rotation.from_euler("Y", 0.6 * number).as_matrix()
        both_ = np.concatenate([own, of_prop], axis=1) @ turn.T + np.array([APART_M * number, 0.0, 0.0])
        gaps = hidden_as_in(TABLE_3["hand-hand"], counts, np.random.default_rng([seed, number]))
        points.append(both_)
        hidden.append(np.concatenate([gaps, np.zeros(of_prop.shape[:2], dtype=np.bool_)], axis=1))
        labels += [f"{number}_{k}" for k in range(both_.shape[1])]
        renamed = replace(prop, name=f"{prop.name} {number + 1}")
        profiles.append(replace(as_calibrated(true, seed + number), props=(renamed,)))
    source = Curtained(tuple(labels), np.concatenate(points, axis=1), np.concatenate(hidden, axis=1))
    stream = MarkerStream(source, RATE_HZ, seed, ghosts=GHOSTS, noise_m=NOISE_M)
    return Cast((profiles[0], profiles[1]), list(stream.frames()))


def _prop(performer: Performer, seed: int) -> Prop:
    """The first of its things, with markers on it."""
    name, thing = next(iter(performer.props.items()))
    return marked(name, thing, seed)
