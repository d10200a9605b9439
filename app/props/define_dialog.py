"""Making a prop of picked points: its name and shape, and whether it is rigid."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import QCheckBox, QDialog, QProgressBar, QPushButton, QWidget

from app import theme
from app.lights import label, set_property
from app.panels.panel import column, keep_room, row
from app.props.examined import Examined
from app.props.shape_form import ShapeForm
from app.review.job import Job, Report
from core.errors import PhalanxError
from core.props.define import RIGID_M
from core.props.prop import Prop, Shape


class DefineDialog(QDialog):
    """Examines the points as soon as it opens; after it was accepted, `prop` is what was made.

    examine: the work. taken: names of props there are; one that is chosen again is replaced. solve: offer to solve the
    take again with the prop.
    """

    def __init__(
        self,
        examine: Callable[[Report], Examined],
        name: str,
        taken: tuple[str, ...],
        solve: bool,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Make a prop")
        self.examined: Examined | None = None
        self.prop: Prop | None = None
        self._taken = taken
        self.form = ShapeForm(name, self._usual_m)
        self.name = self.form.name
        self.name.selectAll()
        self.name.setFocus()
        self.solve = QCheckBox("Solve this take again with it")
        self.solve.setToolTip("The take's own solution stays; the new one is shown beside it.")
        self.solve.setChecked(solve)
        self.figures = label("", "small", wrap=True)
        self.said = label("", "small", wrap=True, lines=1)
        self.plot = pg.PlotWidget()
        self.progress = QProgressBar()
        self.make, self.cancel = QPushButton("Add the prop"), QPushButton("Cancel")
        self._arrange(solve)
        self.name.textChanged.connect(lambda _: self._check())
        self.make.clicked.connect(self.accept)
        self.cancel.clicked.connect(self.reject)
        self._job = Job("Examining the points", examine, self)
        self._job.progressed.connect(self._progressed)
        self._job.succeeded.connect(self._succeeded)
        self._job.failed.connect(self._failed)
        self._job.start()

    def _arrange(self, solve: bool) -> None:
        right = column(None, 0, 6)
        right.addWidget(label("How rigid it is", "section"))
        right.addWidget(self.plot, 1)
        right.addWidget(self.figures)
        self._style_plot()
        halves = row(spacing=18)
        halves.addWidget(self.form, 2)
        halves.addLayout(right, 3)
        keep_room(self.progress)
        self.progress.setRange(0, 1000)
        self.progress.setTextVisible(False)
        layout = column(self, 16, 10)
        layout.addLayout(halves, 1)
        layout.addWidget(self.progress)
        layout.addWidget(self.said)
        layout.addLayout(row(*((self.solve,) if solve else ()), None, self.cancel, self.make))
        self.make.setDefault(True)
        self.cancel.setAutoDefault(False)
        self.make.setEnabled(False)
        self.resize(720, 420)

    def _style_plot(self) -> None:
        self.plot.setBackground(theme.GROUND)
        self.plot.setMinimumHeight(170)
        self.plot.setMouseEnabled(x=False, y=False)
        self.plot.hideButtons()
        self.plot.setMenuEnabled(False)
        self.plot.setToolTip("How far its markers stray from their places, over the frames (root mean square).")
        for side, text in (("left", "mm"), ("bottom", "s")):
            axis = self.plot.getAxis(side)
            axis.setPen(theme.STRONG_LINE)
            axis.setTextPen(theme.MUTED)
            axis.setLabel(text, color=theme.MUTED)
        self.curve = self.plot.plot(pen=pg.mkPen(theme.GOOD, width=1.4), connect="finite")
        self.plot.addItem(
            pg.InfiniteLine(
                1e3 * RIGID_M, angle=0, pen=pg.mkPen(theme.PROBLEM, width=1, style=Qt.PenStyle.DashLine),
                label="no longer rigid",
                labelOpts={"color": theme.PROBLEM, "position": 0.12, "anchors": [(0, 1), (0, 1)]},
            )
        )  # fmt: skip
        self.plot.setYRange(0.0, 1.2e3 * RIGID_M)

    # What the points are.

    def _progressed(self, share: float, text: str) -> None:
        self.progress.setValue(round(1000 * share))
        self._say(f"{text}…", "")

    def _failed(self, error: Exception) -> None:
        self.progress.hide()
        words = str(error) if isinstance(error, PhalanxError) else f"The points cannot be examined: {error}."
        self._say(words, "problem")
        self.cancel.setText("Close")

    def _succeeded(self, examined: Examined) -> None:
        self.examined = examined
        self.progress.hide()
        made, seen = examined.definition, examined.followed
        times_s = seen.times_s - (seen.times_s[0] if len(seen.times_s) else 0.0)
        self.curve.setData(times_s, 1e3 * seen.rms_m)
        worst_mm = 1e3 * float(np.nanmax(np.append(seen.rms_m, 0.0)))
        self.plot.setYRange(0.0, max(1.2e3 * RIGID_M, 1.1 * worst_mm))
        self.figures.setText(
            f"{len(made.prop.markers_m)} markers stray {1e3 * made.rms_m:.2f} mm (root mean square) and at most "
            f"{1e3 * made.worst_m:.2f} mm, over {made.frames:,} frames. All were followed for "
            f"{examined.stretch_s:.1f} s about this moment; tracked as a prop in "
            f"{100.0 * seen.tracked_share:.1f} % of the frames."
        )
        self._say("\n".join(examined.warnings), "warning")
        if self.form.chosen:  # what somebody chose meanwhile stays
            self.form.refresh()
        else:
            self.form.choose(examined.usual_shape)
        self._check()

    def _usual_m(self, shape: Shape) -> tuple[float, ...]:
        return self.examined.usual_size_m(shape) if self.examined is not None else ()

    def _check(self) -> None:
        name = self.name.text().strip()
        again = name in self._taken
        self.make.setText("Replace the prop" if again else "Add the prop")
        self.make.setEnabled(self.examined is not None and bool(name))
        self.make.setToolTip("" if name else "A prop needs a name.")

    def _say(self, text: str, level: str) -> None:
        self.said.setText(text)
        set_property(self.said, "level", level)

    # The end.

    def accept(self) -> None:
        """Make the prop as it is described."""
        if self.examined is None:
            return
        model = self.form.model
        try:
            self.prop = self.examined.prop(self.name.text().strip(), model.shape, model.size_m)
        except PhalanxError as error:
            self._say(str(error), "problem")
            return
        super().accept()

    def reject(self) -> None:
        """Stop examining and close."""
        self._job.cancel()
        super().reject()

    def closeEvent(self, event: QCloseEvent) -> None:  # noqa: N802 (Qt's name)
        """As Cancel."""
        self._job.cancel()
        super().closeEvent(event)

    def stop(self) -> None:
        """Cancel and wait: the application ends."""
        self._job.cancel()
        self._job.join()
        super().reject()
