"""What the formats share: which hands a solution holds, and when its frames were."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from core.frames import BoolArray, HandFrame, HandState, IntArray, MarkerFrame, Side, TrackedFrame
from core.takes.export.progress import Progress
from core.takes.export.timeline import Timeline, timeline_of
from core.takes.solution import Solution

PREFIX: dict[Side, str] = {"left": "L_", "right": "R_"}
"""Before the name of a marker or joint, where one file holds both hands."""

MOST_IN_MEMORY = 30_000
"""Frames; some 300 MB of two hands. Longer recordings are read from disk again for each format."""

T = TypeVar("T")


@dataclass(frozen=True)
class Content:
    """A solution, looked through once.

    raw, solved: its frames, in memory where they fit: formats go through them several times.
    timeline: of the solved frames, or of the raw ones where none is solved. tracked_sides: hands tracked in any
    frame. scale: hand scale of each at the end of the recording, when the engine knows it best. with_joints: marker
    formats also hold the joint centres.
    """

    solution: Solution
    raw: Sequence[MarkerFrame]
    solved: Sequence[TrackedFrame]
    timeline: Timeline
    tracked_sides: tuple[Side, ...]
    scale: dict[Side, float]
    with_joints: bool


def look_through(solution: Solution, with_joints: bool, with_raw: bool, progress: Progress) -> Content:
    """with_raw: the raw frames are to be written too. Raises ExportError if the frame rate cannot be found."""
    raw = solution.raw
    if with_raw:
        raw = _in_memory(raw, progress.part(0.0, 0.3), "Reading the raw frames")
    solved = _in_memory(solution.solved, progress.part(0.3, 1.0), "Reading the solved frames")
    scale: dict[Side, float] = {}

    def noting_hands() -> Iterator[TrackedFrame]:
        for frame in solved:
            scale.update({hand.side: hand.scale for hand in frame.hands if hand.state is HandState.TRACKED})
            yield frame

    timeline = timeline_of(noting_hands() if len(solved) else raw, solution.rate_hz)
    if len(raw):  # times of all files count from the first frame of the recording
        timeline = timeline.shifted(raw[0].times.host_s)
    sides = tuple(side for side in solution.profile.sides if side in scale)
    return Content(solution, raw, solved, timeline, sides, scale, with_joints)


def _in_memory(frames: Sequence[T], progress: Progress, text: str) -> Sequence[T]:
    if len(frames) > MOST_IN_MEMORY:
        return frames
    return list(progress.over(frames, text))


def hand_of(frame: TrackedFrame, side: Side) -> HandFrame | None:
    """The hand of one side, if it is tracked in this frame."""
    for hand in frame.hands:
        if hand.side == side and hand.state is HandState.TRACKED:
            return hand
    return None


def last_tracked(tracked: BoolArray) -> IntArray:
    """(n,) int64 from (n,) bool: for each frame the last one tracked until then, or else the first one ever."""
    frames = np.where(tracked, np.arange(len(tracked)), -1)
    held = np.maximum.accumulate(frames)
    return np.where(held < 0, int(np.argmax(tracked)), held).astype(np.int64)
