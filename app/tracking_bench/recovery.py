"""How soon every label is right again after all is lost: frames of full view until then."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from app.commands.terminal import Progress
from app.people import said, size_of
from app.tracking_bench.scene import NOISE_M, RATE_HZ, SKIN_M, Curtained, as_calibrated, as_generic, person
from app.tracking_bench.score import Truth, Verdict, tracked, wanted_of
from core.frames import BoolArray, FloatArray
from core.motion.performer import PERIOD_S, Performer
from core.motion.stream import MarkerStream

GOAL_FRAMES = 2
LOSS_S = (0.2, 2.0)
VIEW_S = 0.5
"""Full view after a loss, and before the next."""
FIRST_VIEW_S = 2.0

LOSSES_EACH = 20
"""In the performance of one seed."""


@dataclass(frozen=True)
class Loss:
    """What is lost in a performance. elsewhere: afterwards the hands are elsewhere and in another pose. hands: which go
    out of sight, 0 left, 1 right; none: only the ids break."""

    what: str
    activity: str
    hands: tuple[int, ...]
    elsewhere: bool = False


LOSSES = {
    "all gone": Loss(
        "nothing is seen for 0.2 to 2 s; then both hands are elsewhere, turned anyhow, in another pose; hands apart",
        "free", (0, 1), True,
    ),
    "all gone, hands meet": Loss("the same with hands that touch, fold and interlace", "hands", (0, 1), True),
    "one hand gone": Loss("one hand is not seen for 0.2 to 2 s, the other one is; hands meet", "hands", (0,)),
    "ids new": Loss("every point has another id from one frame to the next; hands meet", "hands", ()),
}  # fmt: skip


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """One row for each of LOSSES, with a calibrated profile and with the layout alone."""
    print(
        "  Two hands at 120 Hz without ghosts. Counted are the frames of full view up to the first from which on\n"
        f"  every label is right for the rest of {VIEW_S:g} s, that one counted: 1 is at once. {LOSSES_EACH} losses\n"
        f"  of each of {arguments.seeds} performers: "
        f"{said(arguments, range(arguments.seed, arguments.seed + arguments.seeds))}."
    )
    for name, loss in LOSSES.items():
        print(f"  - {name}: {loss.what}")
    print(
        "  loss                  profile    | within 2 frames | median  90 %  99 %  worst | never within 0.5 s [losses]"
    )
    return {name: {known: _row(name, known, arguments) for known in ("calibrated", "generic")} for name in LOSSES}


def _row(name: str, known: str, arguments: argparse.Namespace) -> dict[str, Any]:
    progress, taken, lines = Progress(f"{name}, {known}"), [], []
    for seed in range(arguments.seed, arguments.seed + arguments.seeds):
        verdict, views = lost_and_found(name, known, seed, LOSSES_EACH, size_of(arguments, seed))
        for first, end in views:
            frames = frames_until_right(verdict, first, end)
            taken.append(frames)
            if frames > GOAL_FRAMES:
                lines.append((frames, _line(verdict, first, end)))
        progress((seed - arguments.seed + 1) / arguments.seeds)
    progress.done()
    frames = np.array(taken)
    never = int((frames > round(VIEW_S * RATE_HZ)).sum())
    row = {
        "within_goal": float((frames <= GOAL_FRAMES).mean()),
        "median": float(np.median(frames)),
        "p90": float(np.percentile(frames, 90)),
        "p99": float(np.percentile(frames, 99)),
        "worst": int(frames.max()),
        "never": never,
        "losses": len(frames),
        "at_once": float((frames == 1).mean()),
    }
    print(
        f"  {name:21} {known:10} | {100 * row['within_goal']:13.1f} % | {row['median']:6.0f} {row['p90']:5.0f} "
        f"{row['p99']:5.0f} {row['worst']:6} | {never} of {len(frames)}"
    )
    for _, line in sorted(lines, key=lambda one: -one[0])[: arguments.failures]:
        print(f"      {line}")
    return row


def frames_until_right(verdict: Verdict, first: int, end: int) -> int:
    """Frames of the view [first, end) up to the first from which on all is right; one more than it has if none is."""
    wrong = np.flatnonzero(~verdict.right[first:end])
    return int(wrong[-1]) + 2 if len(wrong) else 1


def lost_and_found(
    name: str, known: str, seed: int, losses: int, size: float | None = None
) -> tuple[Verdict, list[tuple[int, int]]]:
    """One performance tracked, and its views after each loss, first frame and end. size: as of `person`."""
    loss, true = LOSSES[name], person(seed, size=size)
    random = np.random.default_rng([seed, list(LOSSES).index(name)])
    performer = Performer(true, seed, loss.activity)
    points, hidden, views = _played(performer, loss, losses, random)
    curtained = Curtained(performer.labels, points, hidden)
    sent = list(MarkerStream(curtained, RATE_HZ, seed, noise_m=NOISE_M, skin_m=SKIN_M).labelled())
    frames = [one.frame for one in sent]
    if not loss.hands:
        begun = np.searchsorted([first for first, _ in views], np.arange(len(frames)), side="right")
        frames = [replace(frame, ids=frame.ids + 1000 * int(k)) for frame, k in zip(frames, begun, strict=True)]
    hands, markers = len(true.sides), len(true.layout.marker_names)
    told = as_calibrated(true, seed) if known == "calibrated" else as_generic(true)
    wanted = wanted_of([one.truth for one in sent], hands, markers)
    return tracked(Truth(f"{name}, {known}, seed {seed}", (told,), frames, wanted)), views


def _played(
    performer: Performer, loss: Loss, losses: int, random: np.random.Generator
) -> tuple[FloatArray, BoolArray, list[tuple[int, int]]]:
    """Markers (f, n, 3) [m], which are hidden (f, n), and the views after each loss."""
    markers = len(performer.labels) // 2
    points, hidden, views = [], [], []
    view, at_s = round(VIEW_S * RATE_HZ), 0.0
    turn, shift = np.eye(3), np.zeros(3)

    def play(frames: int, unseen: tuple[int, ...]) -> None:
        nonlocal at_s
        out = np.zeros(2 * markers, dtype=np.bool_)
        for hand in unseen:
            out[hand * markers : (hand + 1) * markers] = True
        for _ in range(frames):
            placed = np.concatenate(list(performer.at(at_s).markers_world_m.values()))
            points.append(placed @ turn.T + shift)
            hidden.append(out)
            at_s += 1.0 / RATE_HZ

    play(round(FIRST_VIEW_S * RATE_HZ), ())
    for number in range(losses):
        unseen = tuple((hand + number) % 2 for hand in loss.hands)
        if unseen:
            play(round(random.uniform(*LOSS_S) * RATE_HZ), unseen)
        if loss.elsewhere:
            at_s = random.uniform(0.0, PERIOD_S)
            turn = Rotation.from_euler("YXZ", random.uniform((-np.pi, -0.3, -0.3), (np.pi, 0.3, 0.3))).as_matrix()
            shift = random.uniform((-0.6, 0.0, -0.6), (0.6, 0.3, 0.6))
        views.append((len(points), len(points) + view))
        play(2 * view, ())
    return np.stack(points), np.stack(hidden), views


def _line(verdict: Verdict, first: int, end: int) -> str:
    """The first wrong stretch of a view, told."""
    for failure in verdict.failures():
        if first < failure.first + failure.frames and failure.first < end:
            return failure.line
    return ""
