"""The performers in the volume: what each wears and how large the hands are; others can be added and removed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from PySide6.QtCore import QPoint, QRectF, QSize
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QLineEdit, QMenu, QToolButton, QVBoxLayout, QWidget

from app import theme
from app.editing import Field
from app.hand_words import performer_titles
from app.lights import label
from app.panels.hand_size_chooser import HandSizeChooser
from app.panels.panel import column, row, section
from app.panels.profile_chooser import OPEN, ProfileChooser, ask_for_profile
from app.panels.told_line import ToldLine
from app.undo import UndoStack
from app.worker import SessionWorker
from core.cast import with_profile
from core.frames import SIDES, HandKey
from core.markers.layout import layout_names
from core.profile import load_profile
from core.takes.take import MOST_PERFORMERS


class PerformersBox(QWidget):
    """A block per performer. With one it is just the profile and the hand size."""

    def __init__(self, worker: SessionWorker, undo: UndoStack) -> None:
        super().__init__()
        self._worker, self._undo = worker, undo
        self.heading = section("Profile")
        self.add = QToolButton(text="Add a performer…")
        self.add.setToolTip(
            "Track the hands of one more person in the same volume, with a profile of their own.\n"
            "Locked while recording."
        )
        self.add.clicked.connect(self._ask)
        self.blocks: list[PerformerBlock] = []
        self._inside: QVBoxLayout = column(margin=0, spacing=10)
        layout = column(self, 0, 6)
        layout.addLayout(row(self.heading, None, self.add))
        layout.addLayout(self._inside)
        worker.profile_changed.connect(lambda _: self._show_cast())
        worker.recording_changed.connect(lambda recording: self.add.setEnabled(not recording))
        self._show_cast()

    def add_performer(self, name_or_path: str) -> None:
        """One more, as a step that can be undone. What cannot be read is told."""
        before = self._worker.session.profiles
        try:
            profile = load_profile(name_or_path)
        except Exception as error:
            self._worker.notifications.error(error, "Tracking", "Opening the profile")
            return
        if len(before) >= MOST_PERFORMERS:
            self._worker.notifications.warning(f"There are {len(before)} performers already.", "A take holds no more.")
            return
        after = (*before, profile)
        words = f"add {performer_titles(after)[-1]}"
        self._worker.with_networks(
            after,
            lambda: self._undo.change(
                words, lambda: self._worker.set_profiles(after), lambda: self._worker.set_profiles(before)
            ),
        )

    def remove_performer(self, performer: int) -> None:
        """One less, as a step that can be undone."""
        before = self._worker.session.profiles
        after = before[:performer] + before[performer + 1 :]
        words = f"remove {performer_titles(before)[performer]}"
        self._undo.change(words, lambda: self._worker.set_profiles(after), lambda: self._worker.set_profiles(before))

    def menu(self) -> QMenu:
        """What a further performer may wear."""
        menu = QMenu(self)
        for name in layout_names():
            menu.addAction(name, lambda name=name: self.add_performer(name))
        menu.addSeparator()
        menu.addAction(OPEN, self._open)
        return menu

    def _ask(self) -> None:
        menu = self.menu()
        menu.exec(self.add.mapToGlobal(QPoint(0, self.add.height())))
        menu.deleteLater()

    def _open(self) -> None:
        path = ask_for_profile(self)
        if path:
            self.add_performer(path)

    def _show_cast(self) -> None:
        cast = self._worker.session.profiles
        while len(self.blocks) > len(cast):
            block = self.blocks.pop()
            self._inside.removeWidget(block)
            block.hide()
            block.deleteLater()
        while len(self.blocks) < len(cast):
            number = len(self.blocks)
            block = PerformerBlock(
                self._worker, self._undo, number, lambda number=number: self.remove_performer(number)
            )
            self.blocks.append(block)
            self._inside.addWidget(block)
        self.heading.setText("Performers" if len(cast) > 1 else "Profile")
        for block in self.blocks:
            block.show_several(len(cast) > 1)


class PerformerBlock(QWidget):
    """One performer: name and colours where there are several, profile, hand size, and what its markers tell."""

    def __init__(self, worker: SessionWorker, undo: UndoStack, performer: int, remove: Callable[[], None]) -> None:
        super().__init__()
        self._worker, self._undo, self._performer = worker, undo, performer
        self.name = QLineEdit()
        self.name.setToolTip("What exports, plots and the 3D view call this performer. Locked while recording.")
        self._name = Field(self.name, self.rename)
        self.remove = QToolButton(text="Remove")
        self.remove.clicked.connect(lambda _=False: remove())
        self.swatch = Swatch(performer)
        self.profile = ProfileChooser(worker, undo, performer)
        self.size = HandSizeChooser(worker, undo, performer)
        self.told = ToldLine(worker, performer)
        self._head = QWidget()
        head = row(self.swatch, self.name, self.remove)
        head.setStretch(1, 1)
        self._head.setLayout(head)
        layout = column(self, 0, 6)
        layout.addWidget(self._head)
        layout.addWidget(self.profile)
        size = row(label("Hand size", "muted"), self.size)
        size.setStretch(1, 1)
        layout.addLayout(size)
        told = row(label("Measured", "muted"), self.told)
        told.setStretch(1, 1)
        layout.addLayout(told)
        worker.recording_changed.connect(self._lock)

    def show_several(self, several: bool) -> None:
        """Name the performer, where there are others."""
        self._head.setVisible(several)
        cast = self._worker.session.profiles
        self.name.setPlaceholderText(f"Performer {self._performer + 1}")
        self._name.show(cast[self._performer].performer)
        if several:
            whom = performer_titles(cast)[self._performer]
            self.remove.setToolTip(f"Track {whom} no more. Locked while recording.")

    def rename(self, name: str) -> None:
        """Another name, as a step that can be undone."""
        before = self._worker.session.profiles
        if name == before[self._performer].performer:
            return
        after = with_profile(before, self._performer, replace(before[self._performer], performer=name))
        self._undo.change(
            f"name performer {self._performer + 1}",
            lambda: self._worker.set_profiles(after),
            lambda: self._worker.set_profiles(before),
        )

    def _lock(self, recording: bool) -> None:
        for widget in (self.name, self.remove):
            widget.setEnabled(not recording)


class Swatch(QWidget):
    """The two colours of a performer's hands."""

    def __init__(self, performer: int) -> None:
        super().__init__()
        self._colours = [QColor(theme.hand_colour(HandKey(performer, side))) for side in SIDES]
        self.setFixedSize(QSize(20, 14))
        self.setToolTip("The colours of the left and the right hand in plots and lists.")

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: D102, N802
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        for i, colour in enumerate(self._colours):
            painter.fillRect(QRectF(1 + 9 * i, 3, 8, 8), colour)
