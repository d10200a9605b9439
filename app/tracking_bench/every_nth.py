"""Every n-th frame solved of streams faster than 120 Hz: labels and poses of the solved ones beside those at n = 1."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from time import thread_time
from typing import Any

import numpy as np

from app.commands.terminal import Progress
from app.people import said, size_of
from app.tracking_bench.scene import KINDS, as_calibrated, performed
from app.tracking_bench.score import Truth, judged
from core.engine import Engine, warm_up
from core.frames import SIDES, FloatArray, HandKey, HandState, MarkerFrame, TrackedFrame
from core.motion.performer import Performer

RATES_HZ = (240.0, 480.0)
EVERY = (1, 2, 4)
SETTLED_S = 2.0
"""Poses are compared after this: while a hand's size is found, frames solved are what counts."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this experiment."""
    parser.add_argument(
        "--nth-kinds", metavar="KIND", nargs="+", choices=KINDS, default=["single hand", "hand-hand"],
        help="every_nth: of " + ", ".join(KINDS) + "; default %(default)s",
    )  # fmt: skip
    parser.add_argument(
        "--nth-seconds", metavar="S", type=float, default=20.0, help="every_nth: of each; default %(default)s"
    )
    parser.add_argument(
        "--reused", action="store_true", help="every_nth: a device that gives the lowest ids that are free, again"
    )
    parser.add_argument(
        "--untold", action="store_true", help="every_nth: also with an engine that is not told the ids between"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """A row for each kind, rate and n; the same frames are compared at every n: those that the largest one solves."""
    warm_up()
    seeds = range(arguments.seed, arguments.seed + arguments.seeds)
    print(
        f"  Both hands with 19 markers each, {arguments.nth_seconds:g} s of each kind, {arguments.seeds} performers:\n"
        f"  {said(arguments, seeds)}. Gaps as in kinds, as long in\n"
        f"  seconds. Of every {max(EVERY)}th frame: frames right, markers seen named right [%]; joints off the truth\n"
        "  [mm], angles [°] and, in frames right at both, joints off where n = 1 has them; what it costs [ms, µs]\n\n"
        "  kind              Hz  n      | frames right  labels right | joints: mean  99 %   most | angles: mean  99 % |"
        " off n = 1: 99 %   most | a frame solved  passed over"
    )
    figures: dict[str, Any] = {}
    for kind in arguments.nth_kinds:
        for rate_hz in RATES_HZ:
            progress = Progress(f"{kind}, {rate_hz:g} Hz")
            rows: dict[str, list[_Outcome]] = {}
            for k, seed in enumerate(seeds):
                for name, outcome in _outcomes(kind, seed, rate_hz, arguments).items():
                    rows.setdefault(name, []).append(outcome)
                progress((k + 1) / len(seeds))
            progress.done()
            figures[f"{kind}, {rate_hz:g} Hz"] = {
                name: _told(kind, rate_hz, name, row, rows["1"]) for name, row in rows.items()
            }
    return figures


class _Outcome:
    """Of one stretch. right: (f,) bool, seen: named right and all. joints_m: (f, h, 16, 3), angles_rad: (f, h, 20), off
    the truth, NaN where a hand is not tracked. places_m: (f, h, 16, 3), where joints are. step_s, pass_s: each."""

    def __init__(self, truth: Truth, solved: list[TrackedFrame], performer: Performer) -> None:
        verdict = judged(truth, solved)
        self.right, self.seen = verdict.right, verdict.seen_right()
        f, h = verdict.point.shape[:2]
        self.places_m, self.joints_m = np.full((f, h, 16, 3), np.nan), np.full((f, h, 16, 3), np.nan)
        self.angles_rad = np.full((f, h, 20), np.nan)
        self.step_s: list[float] = []
        self.pass_s: list[float] = []
        for i, frame in enumerate(solved):
            time_s = frame.times.device_s
            true = performer.at(time_s)
            for hand in frame.hands:
                if hand.state is HandState.TRACKED and time_s >= SETTLED_S:
                    k = [HandKey(0, side) for side in SIDES].index(hand.key)
                    self.places_m[i, k] = hand.joints_world[:, :3, 3]
                    self.joints_m[i, k] = self.places_m[i, k] - true.joints_world[hand.side][:, :3, 3]
                    self.angles_rad[i, k] = hand.theta_rad[6:] - true.theta_rad[hand.side][6:]


def _outcomes(kind: str, seed: int, rate_hz: float, arguments: argparse.Namespace) -> dict[str, _Outcome]:
    """By n; where ids are not told, with a word."""
    played = performed(kind, seed, arguments.nth_seconds, size=size_of(arguments, seed), rate_hz=rate_hz)
    truth = played.truth
    if arguments.reused:
        truth = replace(truth, frames=_with_lowest_ids(truth.frames))
    true = truth.profiles[0]
    performer = Performer(true, seed, KINDS[kind].activity)
    known, compared = as_calibrated(true, seed), slice(0, None, max(EVERY))
    shown = replace(truth, profiles=(known,), frames=truth.frames[compared], wanted=truth.wanted[compared])
    outcomes: dict[str, _Outcome] = {}
    for n in EVERY:
        for told in (True, False)[: 1 + (arguments.untold and n > 1)]:
            engine, solved, steps, passes = Engine(known), [], [], []
            for i, frame in enumerate(truth.frames):
                began = thread_time()
                if i % n == 0:
                    one = engine.step(frame)
                    steps.append(thread_time() - began)
                    if i % max(EVERY) == 0:
                        solved.append(one)
                elif told:
                    engine.pass_over(frame)
                    passes.append(thread_time() - began)
                else:
                    engine.skip(1)
            outcome = _Outcome(shown, solved, performer)
            outcome.step_s, outcome.pass_s = steps, passes
            outcomes[f"{n}" if told else f"{n} untold"] = outcome
    return outcomes


def _with_lowest_ids(frames: Sequence[MarkerFrame]) -> list[MarkerFrame]:
    """As of a device that gives new points the lowest ids that were free in the frame before."""
    given: dict[int, int] = {}
    renamed = []
    for frame in frames:
        ids, taken = frame.ids.tolist(), set(given.values())
        free = iter(sorted(set(range(1, len(taken) + len(ids) + 1)) - taken))
        given = {own: given[own] if own in given else next(free) for own in sorted(ids)}
        renamed.append(replace(frame, ids=np.array([given[own] for own in ids], dtype=np.int64)))
    return renamed


def _told(kind: str, rate_hz: float, name: str, row: list[_Outcome], every: list[_Outcome]) -> dict[str, float]:
    joints, angles, off = _norms(row, "joints_m"), np.degrees(_all(row, "angles_rad")), []
    for one, at_1 in zip(row, every, strict=True):
        both = one.right & at_1.right
        off.append(np.linalg.norm(one.places_m[both] - at_1.places_m[both], axis=-1).ravel())
    apart = np.concatenate(off)
    seen = np.sum([one.seen for one in row], axis=0)
    passes = [s for one in row for s in one.pass_s]
    figures = {
        "frames_right": 100.0 * float(np.mean(np.concatenate([one.right for one in row]))),
        "labels_right": 100.0 * float(seen[0] / max(seen[1], 1)),
        "joints_mm": 1e3 * float(np.nanmean(joints)),
        "joints_p99_mm": 1e3 * float(np.nanpercentile(joints, 99)),
        "joints_most_mm": 1e3 * float(np.nanmax(joints)),
        "angles_deg": float(np.nanmean(np.abs(angles))),
        "angles_p99_deg": float(np.nanpercentile(np.abs(angles), 99)),
        "off_p99_mm": 1e3 * float(np.nanpercentile(apart, 99)),
        "off_most_mm": 1e3 * float(np.nanmax(apart)),
        "step_ms": 1e3 * float(np.median([s for one in row for s in one.step_s])),
        "pass_us": 1e6 * float(np.median(passes)) if passes else float("nan"),
    }
    print(
        f"  {kind:16} {rate_hz:3.0f}  {name:8}| {figures['frames_right']:12.3f} {figures['labels_right']:13.3f} | "
        f"{figures['joints_mm']:12.3f} {figures['joints_p99_mm']:5.2f} {figures['joints_most_mm']:6.1f} | "
        f"{figures['angles_deg']:12.3f} {figures['angles_p99_deg']:5.2f} | {figures['off_p99_mm']:15.3f} "
        f"{figures['off_most_mm']:6.1f} | {figures['step_ms']:14.2f} {figures['pass_us']:12.1f}"
    )
    return figures


def _all(row: list[_Outcome], what: str) -> FloatArray:
    values: FloatArray = np.concatenate([getattr(one, what).reshape(len(one.right), -1) for one in row])
    return values


def _norms(row: list[_Outcome], what: str) -> FloatArray:
    norms: FloatArray = np.concatenate([np.linalg.norm(getattr(one, what), axis=-1).ravel() for one in row])
    return norms
