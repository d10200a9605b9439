"""What earlier runs left behind, beside the window: told, recovered, cleared or kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Qt, QUrl, Signal
from PySide6.QtGui import QDesktopServices, QGuiApplication
from PySide6.QtWidgets import QDialog, QPushButton, QVBoxLayout, QWidget

from app.left_behind.cut_takes import CutTake
from app.left_behind.found import Found, size_words
from app.left_behind.leftovers import Leftover
from app.left_behind.run_file import EndedRun
from app.lights import elided, label
from app.panels.panel import card, clear, column, row, scrolling

WIDTH, MOST_HEIGHT = 620, 680
AROUND = 96
"""Of the width and of the height that are not the body's, at most."""
_LISTED = 50


class LeftBehindDialog(QDialog):
    """One goes on working beside it. What is asked for is done elsewhere, and `show_found` shows what is left then."""

    recover_asked = Signal(object)
    """The take (CutTake) is to be made whole."""
    review_asked = Signal(Path)
    """A take that was recovered is to be opened."""
    clear_asked = Signal(object)
    """These files (tuple of Leftover) are to go."""
    keep_asked = Signal(object)
    """These paths (list) are to be left as they are, without a word."""
    settled = Signal(object)
    """The operator has seen the report of this run (EndedRun)."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Left by earlier runs")
        self.setAttribute(Qt.WidgetAttribute.WA_ShowWithoutActivating)  # the keys go on to the window
        self._body = QWidget()
        self._parts = column(self._body, 0, 14)
        self.recover: dict[Path, QPushButton] = {}
        self.clear_files, self.keep_files = QPushButton(), QPushButton()
        close = QPushButton("Close")
        close.setAutoDefault(False)
        close.setToolTip("What is not settled is told again at the next start. Help > Left by earlier runs… shows it.")
        close.clicked.connect(self.close)
        area = scrolling(self._body)
        self._body.setObjectName("")  # on the ground of the dialog, not of a panel
        layout = QVBoxLayout(self)
        layout.setContentsMargins(20, 18, 12, 14)
        layout.setSpacing(14)
        layout.addWidget(area, 1)
        layout.addLayout(row(None, close))

    def show_found(self, found: Found, recovered: tuple[Path, ...] = (), recovering: Path | None = None) -> None:
        """What there is now. recovered: takes that were made whole just now. recovering: the one that is."""
        clear(self._parts)
        self.recover = {}
        for run in found.faults:
            self._parts.addWidget(self._fault(run))
        for run in found.displays:
            self._parts.addWidget(self._display(run))
        if found.takes or recovered:
            self._parts.addWidget(self._takes(found.takes, recovered, recovering))
        if found.files:
            self._parts.addWidget(self._files(found.files))
        if not (found or recovered):
            self._parts.addWidget(
                label("Nothing is left: every run has ended by itself, and every take is whole.", "muted")
            )
        self._parts.addStretch(1)
        if not self.isVisible():  # later nothing moves that somebody looks at
            self.ensurePolished()
            self._parts.activate()
            wanted = self._parts.totalHeightForWidth(WIDTH - AROUND) + AROUND
            self.resize(WIDTH, min(wanted, MOST_HEIGHT))

    def _fault(self, run: EndedRun) -> QWidget:
        frame, box = card()
        box.addWidget(label("A fault ended Phalanx", "heading"))
        box.addWidget(
            label(
                f"{run.what[:1].upper()}{run.what[1:]}, begun {run.begun:%d %b %Y, %H:%M}: {run.fault}. The report "
                "says where that was in the program, and holds nothing of your takes but their names. Please send it "
                "to whoever looks after Phalanx for you.",
                wrap=True,
            )
        )
        if run.takes:
            box.addWidget(elided(f"It was recording {' and '.join(take.stem for take in run.takes)}."))
        box.addWidget(elided(str(run.path), "small", Qt.TextElideMode.ElideMiddle))
        seen = _button("Seen", lambda: self.settled.emit(run), "Do not tell again; the report stays in the log folder.")
        opened = _button("Open the report", lambda: QDesktopServices.openUrl(QUrl.fromLocalFile(str(run.path))))
        copied = _button("Copy the report", lambda: _copy(run.path), "To the clipboard, to be pasted into a message.")
        box.addLayout(row(None, opened, copied, seen))
        return frame

    def _display(self, run: EndedRun) -> QWidget:
        frame, box = card()
        box.addWidget(label("The display went away", "heading"))
        first = "The take was finished first." if run.finished else "The take could not be finished."
        box.addWidget(
            label(
                f"{run.what[:1].upper()}{run.what[1:]}, begun {run.begun:%d %b %Y, %H:%M}, ended at "
                f"{run.display_gone:%H:%M:%S}: its display was closed, or the network to it broke. {first}",
                wrap=True,
            )
        )
        for take in run.finished:
            opened = _button("Open in review", lambda take=take: self.review_asked.emit(take))
            box.addLayout(_line(take, "was finished", opened))
        box.addLayout(row(None, _button("Seen", lambda: self.settled.emit(run), "Do not tell again.")))
        return frame

    def _takes(self, takes: tuple[CutTake, ...], recovered: tuple[Path, ...], recovering: Path | None) -> QWidget:
        frame, box = card()
        box.addWidget(
            label("A take was cut off" if len(takes) + len(recovered) == 1 else "Takes were cut off", "heading")
        )
        box.addWidget(
            label(
                "Phalanx ended before the recording was finished: by a second Ctrl+C, without a disk that hung, by a "
                "fault, by the system, or by a power cut. Every frame that was written can be read. Recovering makes a "
                "take whole, and changes no frame.",
                wrap=True,
            )
        )
        for take in takes[:_LISTED]:
            about = f"{size_words(take.bytes)}, {take.changed:%d %b %Y, %H:%M}"
            if take.only_copy:
                about += "; the take is gone, and this copy of it is there"
            button = _button("Recover", lambda take=take: self.recover_asked.emit(take), "Make this take whole.")
            keep = _button(
                "Keep", lambda take=take: self.keep_asked.emit([take.path]), "Leave it as it is, and do not ask again."
            )
            if recovering is not None:
                button.setEnabled(False)
                keep.setEnabled(False)
                about = "is being recovered…" if take.path == recovering else about
            self.recover[take.path] = button
            box.addLayout(_line(take.path, about, button, keep))
        if len(takes) > _LISTED:
            box.addWidget(label(f"and {len(takes) - _LISTED} more", "muted"))
        for path in recovered:
            box.addLayout(
                _line(path, "is whole now", _button("Open in review", lambda path=path: self.review_asked.emit(path)))
            )
        return frame

    def _files(self, files: tuple[Leftover, ...]) -> QWidget:
        frame, box = card()
        box.addWidget(label("Files that nobody needs", "heading"))
        box.addWidget(label("Processes that were ended before they were done left them. None is in use.", wrap=True))
        for file in files[:_LISTED]:
            box.addLayout(_line(file.path, f"{size_words(file.bytes)}, {file.what}"))
        if len(files) > _LISTED:
            box.addWidget(label(f"and {len(files) - _LISTED} more", "muted"))
        total = size_words(sum(file.bytes for file in files))
        self.clear_files = _button(
            f"Clear {total}", lambda: self.clear_asked.emit(files), "Remove these files for good."
        )
        self.keep_files = _button(
            "Keep", lambda: self.keep_asked.emit([file.path for file in files]), "Leave them, and do not ask again."
        )
        box.addLayout(row(None, self.clear_files, self.keep_files))
        return frame


def _line(path: Path, about: str, *buttons: QPushButton) -> QVBoxLayout:
    name = elided(path.name, mode=Qt.TextElideMode.ElideMiddle)
    name.setToolTip(str(path))
    words = column(margin=0, spacing=0)
    words.addWidget(name)
    words.addWidget(elided(about, "small"))
    line = row(*buttons)
    line.insertLayout(0, words, 1)
    outer = column(margin=0, spacing=0)
    outer.addLayout(line)
    return outer


def _button(text: str, do: Callable[[], object], tip: str = "") -> QPushButton:
    button = QPushButton(text)
    button.setAutoDefault(False)
    button.setToolTip(tip)
    button.clicked.connect(lambda _=False: do())
    return button


def _copy(path: Path) -> None:
    QGuiApplication.clipboard().setText(path.read_text(encoding="utf-8", errors="replace") if path.exists() else "")
