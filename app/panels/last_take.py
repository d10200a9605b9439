"""How the last take ended, in a card."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QToolButton

from app.clock import clock
from app.lights import Light, elided, label, set_property
from app.panels.panel import card, column, row
from app.stream_figures import together
from app.take_summary import SealingNumbers, TakeSummary
from core.level import Level
from core.words import count


class LastTake(QFrame):
    """How the last take ended: every frame accounted for. While its disk hangs, what is on it, and a way out; while it
    is solved, how far that is."""

    def __init__(
        self, open_take: Callable[[Path], None], give_up: Callable[[], None], solve_no_more: Callable[[], None]
    ) -> None:
        super().__init__()
        frame, inside = card()
        column(self, 0, 0).addWidget(frame)
        self._open = open_take
        self._path: Path | None = None
        self._stalled = False
        self.light = Light(10)
        self.title = elided("", "heading", Qt.TextElideMode.ElideMiddle)
        review = QToolButton(text="Review")
        review.setProperty("flat", True)
        review.setToolTip("Look at this take.")
        review.clicked.connect(self._review)
        self.review = review
        self.give_up = QToolButton(text="Give up")
        self.give_up.setProperty("small", True)
        self.give_up.setToolTip(
            "Wait no longer for the disk. What is on it can be recovered once it answers; what waits in memory is lost "
            "unless it answers while Phalanx runs."
        )
        self.give_up.clicked.connect(give_up)
        self.give_up.hide()
        self.no_poses = QToolButton(text="Cancel")
        self.no_poses.setProperty("flat", True)
        self.no_poses.setToolTip("Solve it no further. Every frame is kept; Solve again in Review makes the poses.")
        self.no_poses.clicked.connect(solve_no_more)
        self.no_poses.hide()
        self.counts = label("", "muted", wrap=True, lines=2)
        self.reason = label("", "small", wrap=True, lines=1)
        inside.addLayout(row(self.light, self.title, None, review, self.give_up, self.no_poses))
        inside.addWidget(self.counts)
        inside.addWidget(self.reason)
        self._show_none()

    def _show_none(self) -> None:
        """Before the first take, in the room it will have."""
        self.title.setText("No take yet")
        self.counts.setText("How it ended and what was lost is said here, frame by frame accounted for.")
        self.review.setEnabled(False)

    def show_finishing(self, takes: Sequence[SealingNumbers]) -> None:
        """A take whose disk hangs while it is finished, or one that is solved before, if there is one: else that goes
        without words."""
        take = next((take for take in takes if take.stalled_s), None)
        waiting = [take for take in takes if take.solving]
        solved = max(waiting, key=lambda take: take.part) if waiting and take is None else None
        self.give_up.setVisible(take is not None)
        self.no_poses.setVisible(solved is not None)
        self.review.setVisible(take is None and solved is None)
        if solved is not None:
            self._show_solving(solved, len(waiting) - 1)
        if take is None:
            if self._stalled:
                self.reason.setText("The disk answers again: it is being finished.")
                set_property(self.reason, "level", "")
            self._stalled = False
            return
        self._stalled = True
        self.title.setText(take.name)
        self.light.set_level(Level.PROBLEM)
        self.counts.setText(f"Not finished: {take.written:,} of {take.received:,} frames are on the disk.")
        self.reason.setText(f"The disk has not answered for {take.stalled_s:.0f} s.")
        set_property(self.reason, "level", "problem")

    def _show_solving(self, take: SealingNumbers, waiting: int) -> None:
        self._stalled = False
        self.title.setText(take.name)
        self.light.set_level(Level.IDLE)
        self.counts.setText(f"Looked back: {take.received:,} frames, {take.written:,} of them on the disk.")
        after = f", then {count(waiting, 'more take')}" if waiting else ""
        self.reason.setText(f"Solving them: {take.part:.0%}{after}")
        set_property(self.reason, "level", "")

    def show_summary(self, summary: TakeSummary) -> None:
        """Received = written + dropped, and by which reason."""
        self._path, self._stalled = summary.path, False
        self.title.setText(summary.name)
        every, marks = together(summary.streams), count(summary.marks, "mark")
        several = f" · {len(summary.streams)} streams" if summary.beside else ""
        also = "looked back" if summary.looked_back else marks
        self.counts.setText(
            f"{clock(summary.duration_s)} · {summary.bytes / 1e6:.1f} MB · {also}{several}\n{every.words}"
        )
        verdict = summary.verdict
        self.light.set_level(verdict.level)
        good = "Every frame of every stream is on disk." if several else "Every frame is on disk and solved."
        self.reason.setText("\n".join(verdict.texts) or good)
        set_property(self.reason, "level", verdict.level.value)
        self.review.setEnabled(summary.sealed or summary.written > 0)

    def _review(self) -> None:
        if self._path is not None:
            self._open(self._path)
