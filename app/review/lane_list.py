"""The lanes of a timeline: one per hand and, if wanted, one per marker; their words and their picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QColor, QImage

from app import theme
from app.pose_words import least_sure, plus_minus_mm
from app.review.analysis import Analysis, Cell
from app.review.lanes import EMPTY, GUESSED, HOLE, MISSING, SEEN, worst_cells
from core.frames import FloatArray

HAND_PX = 16
MARKER_PX = 11
GAP_PX = 3

_COLOURS = {
    Cell.UNSOLVED: theme.GROUND,
    Cell.SEARCHING: "#565d69",
    Cell.LOST: theme.PROBLEM,
    Cell.TRACKED: "#2f7d5a",
    EMPTY: theme.GROUND,
    SEEN: "#2a4a40",
    MISSING: "#d75a9a",
    GUESSED: "#8fb0dc",
    HOLE: theme.PANEL,
}
_WORDS = {
    Cell.UNSOLVED: "not solved",
    Cell.SEARCHING: "searching",
    Cell.LOST: "lost",
    Cell.TRACKED: "tracked",
    EMPTY: "hand not tracked",
    SEEN: "seen",
    MISSING: "hidden: a gap",
    GUESSED: "tracked, partly a guess",
    HOLE: "no frames",
}


@dataclass(frozen=True)
class Lane:
    """One lane. marker is -1 for a hand's own. name, figure: what stands beside it. y: its top, from the first's."""

    hand: int
    marker: int
    y: int
    height: int
    name: str
    figure: str
    colour: str


class LaneList:
    """The lanes of one analysis, from the top."""

    def __init__(self, analysis: Analysis | None = None, markers_shown: bool = False) -> None:
        self._analysis = analysis
        self.lanes: list[Lane] = []
        if analysis is None:
            return
        for hand, key in enumerate(analysis.hands):
            share = f"{100 * analysis.tracked_share(hand):.1f} %"
            name = analysis.title(hand) + ("" if analysis.performers else " hand")
            self._add(hand, -1, HAND_PX, name, share, theme.hand_colour(key))
            if markers_shown:
                shares = analysis.gap_shares(hand)
                for marker, name in enumerate(analysis.marker_names[hand]):
                    self._add(hand, marker, MARKER_PX, name, f"{100 * shares[marker]:.1f} % gap", theme.MUTED)

    def _add(self, hand: int, marker: int, height: int, name: str, figure: str, colour: str) -> None:
        self.lanes.append(Lane(hand, marker, self.height, height, name, figure, colour))

    @property
    def height(self) -> int:
        """Of all lanes with their gaps [pixels]."""
        return self.lanes[-1].y + self.lanes[-1].height + GAP_PX if self.lanes else 0

    def at(self, y: float) -> Lane | None:
        """The lane at a height below the first's top."""
        return next((lane for lane in self.lanes if lane.y <= y < lane.y + lane.height), None)

    def title(self, lane: Lane) -> str:
        """Whose a lane is, and what its figure says, in words."""
        name = self.lanes[[other.hand for other in self.lanes].index(lane.hand)].name
        if lane.marker < 0:
            return f"{name}: tracked {lane.figure} of the take"
        return f"{name}, {lane.name}: hidden {lane.figure.removesuffix(' gap')} of the time its hand is tracked"

    def describe(self, lane: Lane, frame: int) -> str:
        """What a lane shows at a frame, in words."""
        name = self.lanes[[other.hand for other in self.lanes].index(lane.hand)].name
        marker = "" if lane.marker < 0 else f", {lane.name}"
        return f"{name}{marker}: {_WORDS[int(self.cells(lane)[frame])]}{self._how_sure(lane, frame)}, frame {frame}"

    def _how_sure(self, lane: Lane, frame: int) -> str:
        assert self._analysis is not None
        if lane.marker >= 0:
            return plus_minus_mm(float(self._analysis.marker_std_m[lane.hand, frame, lane.marker]))
        words = least_sure(self._analysis.theta_std[lane.hand, frame])
        return f", least sure: {words}" if words else ""

    def cells(self, lane: Lane) -> NDArray[np.uint8]:
        """(n,) uint8, what a lane shows at each frame."""
        assert self._analysis is not None
        states = self._analysis.states[lane.hand]
        if lane.marker < 0:
            guessed = (states == Cell.TRACKED) & (self._analysis.guessed_joints[lane.hand] > 0)
            return np.where(guessed, GUESSED, states).astype(np.uint8)
        seen = np.where(self._analysis.observed[lane.hand, :, lane.marker], SEEN, MISSING)
        return np.where(states == Cell.TRACKED, seen, EMPTY).astype(np.uint8)

    def picture(self, times_s: FloatArray, from_s: float, to_s: float, width: int) -> QImage:
        """One row of pixels per lane, one column per pixel of the timeline: the worst of its frames, or a hole.

        times_s: (n,) float64 [s], ascending, of the frames.
        """
        edges_s = np.linspace(from_s, to_s, width + 1)
        starts = np.searchsorted(times_s, edges_s[:-1], side="right") - 1
        ends = np.searchsorted(times_s, edges_s[1:], side="left")
        assert self._analysis is not None
        holes, per_s = self._analysis.holes, width / (to_s - from_s)
        no_frames = np.zeros(width, dtype=np.bool_)
        for begin_s, end_s in zip(holes.from_s, holes.to_s, strict=True):
            begin, end = math.floor((begin_s - from_s) * per_s), math.ceil((end_s - from_s) * per_s)
            no_frames[max(begin, 0) : max(end, 0)] = True
        codes = np.array([QColor(_COLOURS[cell]).rgb() for cell in range(len(_COLOURS))], np.uint32)
        shown = (np.where(no_frames, HOLE, worst_cells(self.cells(lane), starts, ends)) for lane in self.lanes)
        rows = np.stack([codes[cells] for cells in shown])
        return QImage(rows.data, width, len(rows), width * 4, QImage.Format.Format_RGB32).copy()
