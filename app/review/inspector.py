"""What is known of the take under review, and what an operator says of it: rating, notes, marks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QButtonGroup,
    QFrame,
    QInputDialog,
    QListWidgetItem,
    QPlainTextEdit,
    QPushButton,
    QScrollArea,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from app import theme
from app.clock import clock as stop_watch
from app.editing import Field
from app.hand_words import performer_titles
from app.lights import Light, elided, label, set_property
from app.panels.hinted_list import HintedList
from app.panels.panel import column, keep_room_for, row
from app.review.analysis import Analysis
from app.review.document import ReviewDocument
from app.review.lanes import clock
from app.review.streams_box import StreamsBox
from core.takes.take import LOOKED_BACK, RATINGS, Mark
from core.words import count
from devices.device import Level

_RATING_WORDS = {"": "Unrated", "A": "A", "alt": "Alt", "no good": "No good"}


EMPTY = (
    "No take is open.\n\nClick one in the list, PgUp and PgDown go through it, Ctrl+O opens a file.\n\n"
    "Its rating, notes and marks are here then, and how well its hands were tracked."
)


_RATING_STYLE = f"""
QPushButton {{ padding-left: 5px; padding-right: 5px; }}
QPushButton:checked {{ background: #3f3162; border-color: {theme.REVIEW}; }}
"""


class Inspector(QScrollArea):
    """Edits are only asked for: the room makes them, so that each can be undone."""

    rating_asked = Signal(str)
    notes_asked = Signal(str)
    mark_asked = Signal(int, str)
    """Index of a mark, and its new text."""
    mark_removed = Signal(int)
    mark_chosen = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWidgetResizable(True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.body = QWidget()
        self.empty = label(EMPTY, "empty", wrap=True)
        self.empty.setAlignment(Qt.AlignmentFlag.AlignTop)
        pages = QWidget()
        pages.setObjectName("panelBody")
        both = column(pages, 0, 0)
        both.addWidget(self.empty)
        both.addWidget(self.body)
        self.setWidget(pages)
        keep_room_for(self)
        layout: QVBoxLayout = column(self.body, 10, 8)
        self.name = elided("", "take", Qt.TextElideMode.ElideMiddle)
        self.light = Light(9)
        self.facts = label("", "small", wrap=True)
        self.problems = label("", "small", wrap=True)
        set_property(self.problems, "level", "warning")
        head = row(self.light, self.name)
        head.setStretch(1, 1)
        layout.addLayout(head)
        self.streams = StreamsBox()
        layout.addWidget(self.facts)
        layout.addWidget(self.problems)
        layout.addWidget(self.streams)

        layout.addWidget(label("Rating", "section"))
        self._ratings = QButtonGroup(self)
        buttons = []
        for i, rating in enumerate(RATINGS):
            button = QPushButton(_RATING_WORDS[rating], checkable=True)
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            button.setStyleSheet(_RATING_STYLE)
            self._ratings.addButton(button, i)
            buttons.append(button)
        self._ratings.idClicked.connect(lambda i: self.rating_asked.emit(RATINGS[i]))
        layout.addLayout(row(*buttons, spacing=3))

        layout.addWidget(label("Notes", "section"))
        self.notes = QPlainTextEdit(placeholderText="What to remember of this take")
        self.notes.setFixedHeight(84)
        self.notes.setTabChangesFocus(True)
        self._notes = Field(self.notes, self.notes_asked.emit)
        self._shown: Path | None = None
        layout.addWidget(self.notes)

        layout.addWidget(label("Marks", "section"))
        self.marks = HintedList("M marks the moment shown.")
        self.marks.setFixedHeight(86)
        self.marks.setToolTip("Click to go there, double-click to name it.")
        self.marks.itemClicked.connect(lambda item: self.mark_chosen.emit(self.marks.row(item)))
        self.marks.itemDoubleClicked.connect(self._rename)
        layout.addWidget(self.marks)
        self.remove = QToolButton(text="Remove mark")
        self.remove.clicked.connect(lambda: self.mark_removed.emit(self.marks.currentRow()))
        layout.addLayout(row(None, self.remove))

        layout.addWidget(label("Hands", "section"))
        self.hands = label("", "small", wrap=True)
        layout.addWidget(self.hands)
        layout.addWidget(label("This frame", "section"))
        self.moment = label("", "small", wrap=True)
        self.moment.setToolTip(
            "The angle chosen in the plots, and the joint of which the markers say least.\n"
            "±: one standard deviation, of this frame by itself. In all frames ±: of an error that is the same in all "
            "of them, because the hand's measures and the places of its markers are not quite known. No mean over "
            "frames takes it away; a calibration makes it smaller."
        )
        layout.addWidget(self.moment)
        layout.addStretch(1)
        self._show_body(False)

    def _show_body(self, shown: bool) -> None:
        """What is known of the take, or what to do to see any."""
        self.body.setVisible(shown)
        self.body.setEnabled(shown)
        self.empty.setVisible(not shown)

    def show_take(self, document: ReviewDocument) -> None:
        """All of a take."""
        self._show_body(True)
        if document.path != self._shown:
            self._shown = document.path
            self._notes.reset(document.info.notes)
        info, counts = document.info, document.counts
        self.name.setText(info.name)
        rate = f"{info.rate_hz:g} Hz" if info.rate_hz == info.rate_hz else "rate unknown"
        facts = [info.created_utc.astimezone().strftime("%d %B %Y, %H:%M")]
        if info.looked_back:
            facts.append(LOOKED_BACK)
        if info.performer:
            facts.append(f"Performer: {info.performer}")
        if info.shot:
            facts.append(f"Shot: {info.shot}")
        if document.solved is not None and len(document.solved.cast) > 1:
            facts.append(f"Hands of {' and '.join(performer_titles(document.solved.cast))}")
        if document.n_frames or not document.streams:
            facts.append(f"{stop_watch(document.length_s)}, {document.n_frames:,} frames, {rate}")
        else:
            facts.append(f"{stop_watch(document.length_s)}, none of its streams was solved")
        if info.device.get("title") and not document.streams:
            facts.append(f"Device: {info.device['title']}")
        if counts is not None and not document.streams:
            facts.append(counts.words)
        if document.solved is not None and (document.n_frames or not document.streams):
            solved = document.solved
            worn = " and ".join(dict.fromkeys(profile.layout.name for profile in solved.cast))
            layout = f", layout {worn}" if solved.again is None else ""
            facts.append(solved.title + layout)
        self.facts.setText("\n".join(facts))
        verdict = document.verdict
        problems, level = verdict.texts, verdict.level
        if document.profile_error:
            problems, level = (*problems, document.profile_error), Level.PROBLEM
        self.problems.setText("\n".join(problems))
        self.problems.setVisible(bool(problems))
        set_property(self.problems, "level", level.value)
        self.streams.show_streams(document.streams)
        self.light.set_level(level)
        self.light.setToolTip("\n".join(problems) or "Nothing was dropped or lost, and the file is whole.")
        self.show_words(document)
        self.show_analysis(None)
        if not document.n_frames:
            self.hands.setText("None: there are no frames to track them in.")

    def show_coming(self, name: str) -> None:
        """A take of this name is selected and not open yet, or cannot be opened: nothing can be said of it."""
        self.clear()
        self.body.show()
        self.empty.hide()
        self.name.setText(name)
        self._ratings.setExclusive(False)  # else one of them is always checked
        for button in self._ratings.buttons():
            button.setChecked(False)
        self._ratings.setExclusive(True)

    def show_words(self, document: ReviewDocument) -> None:
        """Rating, notes and marks."""
        if document.info.rating in RATINGS:
            self._ratings.button(RATINGS.index(document.info.rating)).setChecked(True)
        self._notes.show(document.info.notes)
        chosen = self.marks.currentRow()
        self.marks.clear()
        for mark in document.marks:
            self.marks.addItem(QListWidgetItem(_mark_words(mark)))
        self.marks.setCurrentRow(min(chosen, len(document.marks) - 1))
        self.remove.setEnabled(bool(document.marks))
        self._mark_texts = [mark.text for mark in document.marks]

    def show_analysis(self, analysis: Analysis | None) -> None:
        """How well the hands were tracked."""
        if analysis is None:
            self.hands.setText("Reading…")
            return
        lines = []
        for i in range(len(analysis.hands)):
            share, losses = analysis.tracked_share(i), analysis.losses(i)
            times = "once" if losses == 1 else f"{losses} times"
            gaps = analysis.gap_shares(i)
            known = np.isfinite(analysis.theta_std[i]).any()
            guessed = f", some joint a guess in {100 * analysis.guessed_share(i):.0f}\u00a0%" if known else ""
            lines.append(
                f"{analysis.title(i)}: tracked {100 * share:.1f} %, lost {times if losses else 'never'}, "
                f"{100 * gaps.mean():.1f} % of markers hidden{guessed}"
            )
        if analysis.left_out:
            lines.append(f"No pose by choice, and not counted here: {count(analysis.left_out, 'frame')}")
        self.hands.setText("\n".join(lines))

    def show_moment(self, words: str) -> None:
        """What is known of the frame shown (moment_words)."""
        self.moment.setText(words)

    def clear(self) -> None:
        """No take."""
        self._show_body(False)
        for field in (self.name, self.facts, self.problems, self.hands, self.moment):
            field.setText("")
        self.streams.show_streams(())
        self.light.set_level(Level.IDLE)
        self._notes.reset("")
        self._shown = None
        self.marks.clear()

    def finish_typing(self) -> None:
        """Ask for the notes as typed so far."""
        if self.body.isEnabled():
            self._notes.take_up()

    def _rename(self, item: QListWidgetItem) -> None:
        index = self.marks.row(item)
        text, given = QInputDialog.getText(self, "Mark", "Name of this mark:", text=self._mark_texts[index])
        if given:
            self.mark_asked.emit(index, text.strip())


def _mark_words(mark: Mark) -> str:
    return f"{clock(mark.time_s, 2)}  {mark.text or 'Mark'}"
