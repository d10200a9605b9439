"""The export dialog: formats, folder and range; progress and cancel; what was written and read back."""

from __future__ import annotations

import math
from pathlib import Path

from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QCloseEvent, QDesktopServices
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QFileDialog,
    QGridLayout,
    QLineEdit,
    QProgressBar,
    QPushButton,
    QRadioButton,
    QWidget,
)

from app.lights import label, set_property
from app.panels.panel import column, keep_room, row
from app.review.document import ReviewDocument, export_part
from app.review.export_choices import ExportChoices
from app.review.job import Job
from app.review.lanes import clock
from app.review.player import Player
from app.settings import Settings
from core.errors import ExportError, PhalanxError
from core.takes.export import FORMATS, Exported
from core.takes.export.holes_csv import words
from core.takes.holes import Holes

FORMATS_SETTING = "export/formats"
_FOLDER = "exports"


class ExportDialog(QDialog):
    """Stays open over the export and shows its result; a failure says what to do and lets it be done."""

    def __init__(self, document: ReviewDocument, player: Player, settings: Settings, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Export {document.info.name}")
        self._document, self._player, self._settings = document, player, settings
        self._job: Job | None = None
        chosen = settings.get(FORMATS_SETTING, ["c3d", "csv"])
        self.formats = {key: QCheckBox(known.title) for key, known in FORMATS.items()}
        for key, box in self.formats.items():
            box.setChecked(key in chosen)
            box.toggled.connect(self._check)
        self.choices = ExportChoices(settings)
        self.choices.changed.connect(self._check)
        self.folder = QLineEdit(str(document.path.parent / _FOLDER / document.path.stem))
        self.folder.textChanged.connect(self._check)
        browse = QPushButton("Choose…")
        browse.clicked.connect(self._choose_folder)
        self.replace = QCheckBox("Replace files of an earlier export")
        self.whole = QRadioButton(f"The whole take, {clock(player.end_s - player.start_s, 2)}")
        times = player.times_s
        span_s = float(times[player.out_frame] - times[player.in_frame]) if player.n_frames else 0.0
        self.part = QRadioButton(f"From in to out, frames {player.in_frame} to {player.out_frame}, {clock(span_s, 2)}")
        self.part.setEnabled(player.ranged)
        (self.part if player.ranged else self.whole).setChecked(True)

        self.progress = QProgressBar()
        self.progress.setRange(0, 1000)
        self.state = label(wrap=True, lines=2)
        self.state.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.open_folder = QPushButton("Open folder")
        self.open_folder.clicked.connect(
            lambda: QDesktopServices.openUrl(QUrl.fromLocalFile(self.folder.text().strip()))
        )
        self.start = QPushButton("Export")
        self.start.setDefault(True)
        self.start.clicked.connect(self.export)
        self.cancel = QPushButton("Close")
        self.cancel.clicked.connect(self._cancel_or_close)

        layout = column(self, 16, 8)
        for heading, widgets in (
            ("Formats", list(self.formats.values())),
            ("Range", [self.whole, self.part]),
            ("Options", [self.choices]),
        ):
            layout.addWidget(label(heading, "section"))
            grid = QGridLayout()
            grid.setVerticalSpacing(8)
            columns = 2 if len(widgets) > 2 else 1
            for i, widget in enumerate(widgets):
                grid.addWidget(widget, i // columns, i % columns)
            layout.addLayout(grid)
        layout.addWidget(label("Folder", "section"))
        layout.addLayout(row(self.folder, browse))
        layout.addWidget(self.replace)
        layout.addSpacing(4)
        layout.addWidget(self.progress)
        layout.addWidget(self.state)
        layout.addStretch(1)
        layout.addLayout(row(self.open_folder, None, self.cancel, self.start))
        for button in (browse, self.open_folder, self.cancel):
            button.setAutoDefault(False)
        self.setMinimumWidth(480)
        keep_room(self.progress, self.open_folder)
        self.progress.hide()
        self.open_folder.hide()
        self._check()

    @property
    def exporting(self) -> bool:
        """Whether files are being written."""
        return self._job is not None

    def export(self) -> None:
        """Write what is chosen."""
        document, player = self._document, self._player
        if document.solved is None or self._job is not None:
            return
        formats = [key for key, box in self.formats.items() if box.isChecked()]
        self._settings.set(FORMATS_SETTING, formats)
        options = self.choices.options
        self.choices.remember()
        first, last = (player.in_frame, player.out_frame) if self.part.isChecked() else (0, player.n_frames - 1)
        folder = Path(self.folder.text().strip()).expanduser()
        path = document.path_of(document.solved)
        replace, said = self.replace.isChecked(), (document.info, document.marks)
        self._job = Job(
            "Export",
            lambda report: export_part(path, first, last, formats, folder, options, report, replace, said),
            self,
        )
        self._job.progressed.connect(self._progressed)
        self._job.succeeded.connect(self._succeeded)
        self._job.failed.connect(self._failed)
        self._job.cancelled.connect(lambda: self._finished("Cancelled. Formats that were finished are kept.", ""))
        self.progress.setValue(0)
        self.progress.show()
        self.open_folder.hide()
        self._say("Reading the frames…", "")
        self._enable(False)
        self._job.start()

    def _progressed(self, share: float, text: str) -> None:
        self.progress.setValue(round(1000 * share))
        self._say(text, "")

    def _succeeded(self, exported: Exported) -> None:
        files, level = exported.files, "good"
        names = ", ".join(f"{path.name} ({_size(path)})" for path in files)
        count = "One file" if len(files) == 1 else f"{len(files)} files"
        text = f"{count} written, read back and equal: {names}." if files else ""
        if exported.record is not None and files:
            text += f" {exported.record.name} says what they are."
        said = list(exported.warnings)
        holes = self._exported_holes()
        if len(holes) and files:
            player = self._player
            first, last = (player.in_frame, player.out_frame) if self.part.isChecked() else (0, player.n_frames - 1)
            length_s = float(player.times_s[last] - player.times_s[first])
            said.append(f"{words(holes, length_s)} {files[-1].name} says where.")
        if said:
            level = "warning"
        if exported.failed:
            level = "problem"
            said = [*dict.fromkeys(map(str, exported.failed.values())), *said]
        self._finished("\n\n".join(filter(None, [text, *said, " ".join(exported.notes)])), level)
        self.open_folder.setVisible(bool(files))

    def _exported_holes(self) -> Holes:
        """Where the part that is exported has no frames."""
        player, holes = self._player, self._document.holes
        if not self.part.isChecked():
            return holes
        first_s = float(player.times_s[player.in_frame])
        return holes.within(first_s, float(player.times_s[player.out_frame])).shifted(-first_s)

    def _failed(self, error: Exception) -> None:
        words = (
            str(error) if isinstance(error, PhalanxError) else f"The export failed: {error or type(error).__name__}."
        )
        self._finished(words, "problem")

    def _finished(self, text: str, level: str) -> None:
        self._job = None
        self.progress.hide()
        self._say(text, level)
        self._enable(True)
        self._make_room()

    def _make_room(self) -> None:
        """As high as what is said needs; Qt's own way stops at two thirds of the screen."""
        layout = self.layout()
        layout.activate()
        self.resize(self.width(), max(layout.totalHeightForWidth(self.width()), self.minimumSizeHint().height()))

    def _say(self, text: str, level: str) -> None:
        self.state.setText(text)
        set_property(self.state, "level", level)

    def _enable(self, able: bool) -> None:
        for widget in (*self.formats.values(), self.whole, self.folder, self.replace):
            widget.setEnabled(able)
        self.part.setEnabled(able and self._player.ranged)
        self.cancel.setText("Close" if able else "Cancel")
        self.cancel.setEnabled(True)
        self._check()

    def _check(self) -> None:
        """Whether there is something to export, and why not."""
        reason = ""
        if self._document.solved is None:
            reason = "Solve the take first (Solve again): its own profile cannot be used."
        elif not any(box.isChecked() for box in self.formats.values()):
            reason = "Choose a format."
        elif not self.folder.text().strip():
            reason = "Choose a folder."
        else:
            try:
                self.choices.options  # noqa: B018 - says why it cannot be followed
            except ExportError as error:
                reason = str(error)
        self.start.setEnabled(not reason and self._job is None)
        self.start.setToolTip(reason)
        self.choices.follow([key for key, box in self.formats.items() if box.isChecked()], self._job is None)

    def _choose_folder(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Export to", self.folder.text())
        if chosen:
            self.folder.setText(chosen)

    def _cancel_or_close(self) -> None:
        if self._job is None:
            self.reject()
        else:
            self.cancel.setEnabled(False)
            self._say("Cancelling…", "")
            self._job.cancel()

    def reject(self) -> None:
        """Escape cancels an export before it closes the dialog."""
        if self._job is not None:
            self._cancel_or_close()
        else:
            super().reject()

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802 (Qt's name)
        """An export that runs is cancelled, and its end awaited."""
        if self._job is not None:
            self._cancel_or_close()
            event.ignore()
        else:
            super().closeEvent(event)

    def stop(self) -> None:
        """Cancel and wait: the application ends."""
        if self._job is not None:
            self._job.cancel()
            self._job.join()


def _size(path: Path) -> str:
    n = path.stat().st_size
    if n < 1000:
        return f"{n} bytes"
    power = min(int(math.log10(n) // 3), 3)
    return f"{n / 1000**power:.1f} {('', 'kB', 'MB', 'GB')[power]}"
