"""Making a labelling network for the glove in use: asked, followed, and put to use."""

from __future__ import annotations

import json
import math
import os
import tempfile
import threading
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDoubleSpinBox,
    QFileDialog,
    QGridLayout,
    QLineEdit,
    QProgressBar,
    QPushButton,
    QSpinBox,
    QWidget,
)

from app.commands.train import missing_packages
from app.editing import leave_wheel_to_panel
from app.lights import elided, label, set_property
from app.panels.panel import column, row
from app.review.job import Job, Report
from app.settings import Settings
from app.training.process import TrainingProgress, train
from core.errors import PhalanxError
from core.labelling.network import SHIPPED
from core.profile import Profile

MINUTES, THREADS, DATA = "training/minutes", "training/threads", "training/data"
INSTALL = "python -m pip install 'phalanx[train]'"
SHORT_MINUTES = 10.0


class TrainingDialog(QDialog):
    """Beside the window, not before it: one goes on capturing. Closing it hides it, and training goes on."""

    use_asked = Signal(object)
    """The operator wants the network in this file (Path) to be used, None: the one of Phalanx."""
    told = Signal(str, str, bool)
    """To be read by whoever does not look here: what, what to do, and whether it is good news."""

    def __init__(
        self, profile: Callable[[], Profile], folder: Path, settings: Settings, parent: QWidget | None = None
    ) -> None:
        """profile: the one in use. folder: where the network goes at first."""
        super().__init__(parent)
        self.setWindowTitle("Train a labelling network")
        self._profile, self._settings, self._folder = profile, settings, folder
        self._job: Job | None = None
        self._stop, self._drop = threading.Event(), threading.Event()
        self.written: Path | None = None
        self.layout_name = elided("", "heading")
        self.minutes, self.threads = leave_wheel_to_panel(QDoubleSpinBox()), leave_wheel_to_panel(QSpinBox())
        self.data, self.out = QLineEdit(), QLineEdit()
        self.again = QCheckBox("Go on from the network of Phalanx")
        self.progress, self.figures, self.said = QProgressBar(), label("", "small"), label("", "small", wrap=True)
        self.start, self.stop, self.close_ = (
            QPushButton("Train"),
            QPushButton("Stop, keep the best"),
            QPushButton("Close"),
        )
        self.use = QPushButton("Use it")
        self.in_use, self.other, self.shipped = (
            elided("", mode=Qt.TextElideMode.ElideMiddle),
            QPushButton("Choose…"),
            QPushButton("Back to that of Phalanx"),
        )
        self._fill()
        self._arrange()
        self._enable()

    # What there is.

    def _fill(self) -> None:
        cores = os.cpu_count() or 1
        self.minutes.setRange(0.5, 600.0)
        self.minutes.setDecimals(1)
        self.minutes.setSuffix(" min")
        self.minutes.setValue(self._settings.get(MINUTES, SHORT_MINUTES))
        self.minutes.setToolTip(
            f"Going on from the network of Phalanx, {SHORT_MINUTES:g} minutes do; from nothing, 40 or more."
        )
        self.threads.setRange(1, cores)
        self.threads.setValue(self._settings.get(THREADS, max(cores - 1, 1)))
        self.threads.setToolTip(f"Of the {cores} of this machine. While you capture, leave two or more to it.")
        self.data.setText(self._settings.get(DATA, ""))
        self.data.setPlaceholderText("None: made hands alone")
        self.data.setToolTip(
            "A folder of your own labelled recordings of this layout (TRC, C3D, TSV, CSV, NPZ): half of what is\n"
            "learnt from are then your frames. Whether you may pass the network on depends on their licence."
        )
        self.out.setToolTip("The network, an .onnx file; its card is written beside it.")
        self.again.setChecked(True)
        self.again.setToolTip("Minutes then make a network that knows this glove; without it, it begins from nothing.")
        self.progress.setRange(0, 1000)
        self.progress.setTextVisible(False)
        self.said.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.start.setDefault(True)
        for button, do in (
            (self.start, self.begin), (self.stop, self.end_early), (self.close_, self.close),
            (self.use, lambda: self.written is not None and self.use_asked.emit(self.written)),
            (self.other, self._choose_network), (self.shipped, lambda: self.use_asked.emit(None)),
        ):  # fmt: skip
            button.clicked.connect(do)
            button.setAutoDefault(button is self.start)

    def _arrange(self) -> None:
        choose_data, choose_out = QPushButton("Choose…"), QPushButton("Choose…")
        choose_data.clicked.connect(self._choose_data)
        choose_out.clicked.connect(self._choose_out)
        self._fields: list[QWidget] = [
            self.minutes, self.threads, self.data, self.out, self.again, choose_data, choose_out,
        ]  # fmt: skip
        for button in (choose_data, choose_out):
            button.setAutoDefault(False)
        grid = QGridLayout()
        grid.setHorizontalSpacing(12)
        grid.setVerticalSpacing(8)
        in_use_buttons = QWidget()
        in_use_buttons.setLayout(row(self.shipped, self.other))
        lines: list[tuple[str, QWidget, QWidget | None]] = [
            ("Network in use", self.in_use, in_use_buttons), ("Layout", self.layout_name, None),
            ("Time", self.minutes, None), ("Threads", self.threads, None), ("", self.again, None),
            ("Own recordings", self.data, choose_data), ("Write to", self.out, choose_out),
        ]  # fmt: skip
        for i, (heading, field, button) in enumerate(lines):
            grid.addWidget(label(heading, "muted"), i, 0)
            if button is not None:
                grid.addWidget(field, i, 1)
                grid.addWidget(button, i, 2)
            else:
                grid.addWidget(field, i, 1, 1, 2, Qt.AlignmentFlag.AlignLeft)
        for spin in (self.minutes, self.threads):
            spin.setFixedWidth(96)
        grid.setColumnStretch(1, 1)
        layout = column(self, 16, 10)
        words = (
            "A network that names the markers of this one glove best. It is trained beside capture, at low priority."
        )
        layout.addWidget(label(words, "small", wrap=True))
        layout.addLayout(grid)
        layout.addWidget(self.progress)
        layout.addWidget(self.figures)
        layout.addWidget(self.said)
        layout.addStretch(1)
        layout.addLayout(row(None, self.close_, self.stop, self.use, self.start))
        self.setMinimumWidth(560)
        self.minutes.setFocus()

    @property
    def training(self) -> bool:
        """Whether a network is being trained."""
        return self._job is not None

    def open_again(self) -> None:
        """Show it, for the profile that is in use now."""
        if not self.training and self.written is None and not self.isVisible():  # where one may be typing
            name = self._profile().layout.name
            self.layout_name.setText(name)
            self.out.setText(str(self._folder / f"{name}.onnx"))
        self._enable()
        self.show_used()
        self.show()
        self.raise_()
        self.activateWindow()

    # What is done.

    def begin(self) -> None:
        """Train as is asked for."""
        if self._job is not None:
            return
        layout, out = self._profile().layout, Path(self.out.text().strip()).expanduser()
        self.layout_name.setText(layout.name)
        for name, value in ((MINUTES, self.minutes.value()), (THREADS, self.threads.value()), (DATA, self.data.text())):
            self._settings.set(name, value)
        data, again = self.data.text().strip(), self.again.isChecked()
        words = ["labeller", "--minutes", str(self.minutes.value()), "--threads", str(self.threads.value())]
        words += ["--out", str(out)]
        words += ["--data", str(Path(data).expanduser())] if data else []
        words += ["--from", str(files("resources") / "networks" / SHIPPED)] if again else []

        def work(report: Report) -> dict[str, Any]:
            if out.parent == self._folder:
                out.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix="phalanx-training-") as folder:
                worn = Path(folder) / "layout.json"
                worn.write_text(json.dumps(layout.to_dict()), encoding="utf-8")
                return train([*words, "--layout", str(worn)], report.give, self._stop.is_set, self._drop.is_set)

        self.written = None
        self._out = out
        self._stop.clear()
        self._job = Job("Training", work, self)
        self._job.given.connect(self._progressed)
        self._job.succeeded.connect(self._succeeded)
        self._job.failed.connect(self._failed)
        self.progress.setRange(0, 0)
        self._say("Making postures to learn from…", "")
        self._enable()
        self._job.start()

    def end_early(self) -> None:
        """Stop; the best network so far is kept."""
        if self._job is not None:
            self.stop.setEnabled(False)
            self._say("Stopping: the best so far is written…", "")
            self._stop.set()

    def end(self) -> None:
        """The application ends: training ends at once, and what was best so far stays on disk."""
        if self._job is not None:
            self._drop.set()
            self._job.join()
            self._job = None

    def _progressed(self, progress: TrainingProgress) -> None:
        self.progress.setRange(0, 1000)
        self.progress.setValue(round(1000 * progress.share))
        self.figures.setText(
            f"{100.0 * progress.share:.0f} % · {progress.clouds:,} clouds · "
            f"{100.0 * progress.accuracy:.1f} % of validation points named right · {_minutes(progress.left_s)} left"
        )
        if self.stop.isEnabled():
            self._say("", "")

    def _succeeded(self, card: dict[str, Any]) -> None:
        self._job = None
        self.written = self._out
        right = next(iter(card["validation"].values()))
        words = f"{self._out.name} is written: {100.0 * right:.1f} % of the points of made hands named right."
        self._say(words, "good")
        self._enable()
        if not self.isVisible():
            self.told.emit(words, "Use it from Session > Train a labelling network.", True)

    def _failed(self, error: Exception) -> None:
        self._job = None
        words = str(error) if isinstance(error, PhalanxError) else f"Training failed: {error or type(error).__name__}."
        self._say(words, "problem")
        self._enable()
        if not self.isVisible():
            self.told.emit(words, "", False)

    def show_used(self) -> None:
        """Which network the profile names."""
        network = self._profile().network
        self.in_use.setText("The network of Phalanx" if network is None else Path(network).name)
        self.in_use.setToolTip("It goes with the profile, also when a take is solved again." if network else "")
        self.shipped.setVisible(network is not None)
        if self.written is not None and network == str(self.written.absolute()):
            self._say(f"{self.written.name} is in use. It goes with the profile.", "good")
            self.use.setEnabled(False)

    def _enable(self) -> None:
        missing = missing_packages()
        for field in self._fields:
            field.setEnabled(not self.training and not missing)
        self.start.setEnabled(not self.training and not missing)
        self.start.setVisible(not self.training and self.written is None)
        self.stop.setVisible(self.training)
        self.stop.setEnabled(self.training)
        self.use.setVisible(self.written is not None)
        self.use.setEnabled(self.written is not None)
        self.close_.setText("Go on in the background" if self.training else "Close")
        self.progress.setVisible(self.training)
        self.figures.setVisible(self.training)
        if missing:
            self._say(f"Training needs {' and '.join(missing)}, not installed here. Run: {INSTALL}", "warning")
        self.adjustSize()

    def _say(self, text: str, level: str) -> None:
        self.said.setText(text)
        set_property(self.said, "level", level)

    def _choose_network(self) -> None:
        path, _ = QFileDialog.getOpenFileName(self, "Use a network", str(self._folder), "Networks (*.onnx)")
        if path:
            self.use_asked.emit(Path(path))

    def _choose_data(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Own recordings", self.data.text())
        if chosen:
            self.data.setText(chosen)

    def _choose_out(self) -> None:
        path, _ = QFileDialog.getSaveFileName(self, "Write the network to", self.out.text(), "Networks (*.onnx)")
        if path:
            self.out.setText(path if path.endswith(".onnx") else f"{path}.onnx")

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802 (Qt's name)
        """A network that was looked at is done with: the next time another is asked for."""
        if not self.training:
            self.written = None
            self._say("", "")
        super().closeEvent(event)


def _minutes(seconds: float) -> str:
    minutes = math.ceil(seconds / 60.0)
    return "less than a minute" if seconds < 60.0 else f"{minutes} minutes"
