"""The export dialog: formats, folder and range; progress and cancel; what was written and read back."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

from PySide6.QtCore import Qt, QTimer, QUrl
from PySide6.QtGui import QCloseEvent, QDesktopServices, QKeyEvent
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
from app.review.export_result import ExportResult
from app.review.job import Job
from app.review.lanes import clock
from app.review.player import Player
from app.settings import Settings
from app.texts import window_title
from core.errors import ExportError, PhalanxError
from core.takes.export import FORMATS, Exported
from core.takes.export.counted import neutral_words
from core.takes.export.holes_csv import words
from core.takes.holes import Holes

FORMATS_SETTING = "export/formats"
_FOLDER = "exports"


class ExportDialog(QDialog):
    """Stays open over the export and shows its result; a failure says what to do and lets it be done."""

    def __init__(self, document: ReviewDocument, player: Player, settings: Settings, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle(window_title(f"Export {document.info.name}"))
        self._document, self._player, self._settings = document, player, settings
        self._job: Job | None = None
        chosen = settings.get(FORMATS_SETTING, ["c3d", "csv"])
        self.formats = {key: QCheckBox(known.title) for key, known in FORMATS.items()}
        for key, box in self.formats.items():
            box.setChecked(key in chosen)
            box.toggled.connect(self._check)
        self.choices = ExportChoices(settings, neutral_words(document.solved.cast) if document.solved else ())
        self.choices.changed.connect(self._check)
        self.folder = QLineEdit(str(document.path.parent / _FOLDER / document.path.stem))
        self.folder.textChanged.connect(self._check)
        self.browse = QPushButton("Choose…")
        self.browse.clicked.connect(self._choose_folder)
        self.replace = QCheckBox("Replace files of an earlier export")
        self.whole = QRadioButton(f"The whole take, {clock(player.end_s - player.start_s, 2)}")
        times = player.times_s
        span_s = float(times[player.out_frame] - times[player.in_frame]) if player.n_frames else 0.0
        self.part = QRadioButton(f"From in to out, frames {player.in_frame} to {player.out_frame}, {clock(span_s, 2)}")
        self.part.setEnabled(player.ranged)
        (self.part if player.ranged else self.whole).setChecked(True)

        self.progress = QProgressBar()
        self.progress.setRange(0, 1000)
        self.result = ExportResult()
        self.reason = label(wrap=True, lines=1)
        """Why there is nothing to export as it is chosen now."""
        set_property(self.reason, "level", "warning")
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
        layout.addLayout(row(self.folder, self.browse))
        layout.addWidget(self.replace)
        layout.addSpacing(4)
        layout.addWidget(self.progress)
        layout.addWidget(self.result, 1)
        layout.addWidget(self.reason)
        layout.addLayout(row(self.open_folder, None, self.cancel, self.start))
        order = [
            *self.formats.values(), self.whole, self.part, *self.choices.fields, self.folder, self.browse, self.replace,
            self.open_folder, self.cancel, self.start,
        ]  # fmt: skip
        for before, after in pairwise(order):
            self.setTabOrder(before, after)
        self.setMinimumWidth(520)
        keep_room(self.progress, self.open_folder)
        self.progress.hide()
        self.open_folder.hide()
        self._check()
        (self.start if self.start.isEnabled() else order[0]).setFocus()

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
        self._job.cancelled.connect(lambda: self._said("Cancelled. Formats that were finished are kept.", ""))
        self.progress.setValue(0)
        self.progress.show()
        self.open_folder.hide()
        self.result.say("Reading the frames…", "")
        self.setFocus()  # not to Cancel: a second Enter would be one
        self._enable(False)
        self._job.start()

    def _progressed(self, share: float, text: str) -> None:
        self.progress.setValue(round(1000 * share))
        self.result.say(text, "")

    def _succeeded(self, exported: Exported) -> None:
        files, warnings = exported.files, list(exported.warnings)
        holes = self._exported_holes()
        if len(holes) and files:
            player = self._player
            first, last = (player.in_frame, player.out_frame) if self.part.isChecked() else (0, player.n_frames - 1)
            length_s = float(player.times_s[last] - player.times_s[first])
            warnings.append(f"{words(holes, length_s)} …_holes.csv says where.")
        count = "One file" if len(files) == 1 else f"{len(files)} files"
        written = f"{count} written, read back and equal." if files else ""
        if exported.record is not None:
            written = f"{written[:-1]}; …_export.json says what they are."
        failed = "\n".join(dict.fromkeys(map(str, exported.failed.values())))
        self.result.show_result(failed, "problem", warnings, exported.notes, written, files)
        self._finished()
        self.open_folder.setVisible(bool(files))
        if files and not failed:
            self.cancel.setFocus()

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
        self._said(words, "problem")

    def _said(self, text: str, level: str) -> None:
        self.result.say(text, level)
        self._finished()

    def _finished(self) -> None:
        self._job = None
        self.progress.hide()
        self._enable(True)
        self.start.setFocus()
        self._make_room()
        QTimer.singleShot(0, self, self._make_room)  # once more when all that is new has its final size

    def _make_room(self) -> None:
        """As high as what is said needs, and never beyond the screen: there the result scrolls. Qt's own way stops at
        two thirds of the screen."""
        layout, screen = self.layout(), self.screen().availableGeometry()
        layout.activate()
        frame = self.frameGeometry().height() - self.height()
        missing = self.result.sizeHint().height() - self.result.height()
        wanted = max(self.height() + max(missing, 0), self.minimumSizeHint().height())
        self.resize(self.width(), min(wanted, screen.height() - frame))
        below = self.frameGeometry().bottom() - screen.bottom()
        if below > 0:
            self.move(self.x(), max(self.y() - below, screen.top()))

    def _enable(self, able: bool) -> None:
        for widget in (*self.formats.values(), self.whole, self.folder, self.browse, self.replace):
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
        self.reason.setText(reason if self._job is None else "")
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
            self.result.say("Cancelling…", "")
            self._job.cancel()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802 (Qt's name)
        """Page keys scroll the result, which takes no focus."""
        pages = {Qt.Key.Key_PageDown: 1, Qt.Key.Key_PageUp: -1}.get(Qt.Key(event.key()), 0)
        if pages:
            self.result.scroll_page(pages)
        else:
            super().keyPressEvent(event)

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
