"""What the formats share: which hands a solution holds, and when its frames were."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from core.frames import BoolArray, HandFrame, HandState, IntArray, Side, TrackedFrame
from core.takes.export.progress import Progress
from core.takes.export.timeline import Timeline, timeline_of
from core.takes.solution import Solution

PREFIX: dict[Side, str] = {"left": "L_", "right": "R_"}
"""Before the name of a marker or joint, where one file holds both hands."""


@dataclass(frozen=True)
class Content:
    """A solution, looked through once.

    timeline: of the solved frames, or of the raw ones where none is solved. tracked_sides: hands tracked in any
    frame. scale: hand scale of each at the end of the recording, when the engine knows it best. with_joints: marker
    formats also hold the joint centres.
    """

    solution: Solution
    timeline: Timeline
    tracked_sides: tuple[Side, ...]
    scale: dict[Side, float]
    with_joints: bool

    @property
    def solved(self) -> Iterator[TrackedFrame]:
        """The solved frames, from the first."""
        return iter(self.solution.solved)


def look_through(solution: Solution, with_joints: bool, progress: Progress) -> Content:
    """Raises ExportError if the frame rate cannot be found."""
    scale: dict[Side, float] = {}

    def noting_hands() -> Iterator[TrackedFrame]:
        for frame in progress.over(solution.solved, "Reading the solved frames"):
            scale.update({hand.side: hand.scale for hand in frame.hands if hand.state is HandState.TRACKED})
            yield frame

    timeline = timeline_of(noting_hands() if len(solution.solved) else solution.raw, solution.rate_hz)
    if len(solution.raw):  # times of all files count from the first frame of the recording
        timeline = timeline.shifted(solution.raw[0].times.host_s)
    sides = tuple(side for side in solution.profile.sides if side in scale)
    return Content(solution, timeline, sides, scale, with_joints)


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
