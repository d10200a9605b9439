"""Which solution of the take is shown, and what can be done with it."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QComboBox, QPushButton, QWidget

from app.editing import leave_wheel_to_panel
from app.lights import label, set_property
from app.panels.panel import column, keep_room, row
from app.review.document import ReviewDocument, Solved
from app.texts import give_way

_SAVE_TIP = "Write the raw frames with this solution as a new take."


class SolutionBox(QWidget):
    """The recorded solution and those made since, of the take that is open."""

    chosen = Signal(object)
    """Solved."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._solutions: list[Solved] = []
        self.choice = leave_wheel_to_panel(give_way(QComboBox()))
        self.choice.setToolTip("Which solution is shown and exported.")
        self.choice.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.choice.activated.connect(lambda i: self.chosen.emit(self._solutions[i]))
        self.solve = QPushButton("Solve again…")
        self.solve.setToolTip("Solve the raw frames anew, with this or another profile. The file is not changed.")
        self.save = QPushButton("Save as take")
        self.export = QPushButton("Export…")
        self.export.setToolTip("Write C3D, TRC, CSV, BVH or glTF (Ctrl+E).")
        set_property(self.export, "primary", True)
        for button in (self.solve, self.save, self.export):
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        keep_room(self.choice, self.save)
        layout = column(self, 10, 6)
        layout.addWidget(label("Solution", "section"))
        layout.addWidget(self.choice)
        layout.addLayout(row(self.solve, self.save))
        layout.addWidget(self.export)
        self.show_take(None)

    def show_take(self, document: ReviewDocument | None) -> None:
        """What there is of the take, and what of it is shown."""
        self._solutions = list(document.solutions) if document is not None else []
        self.choice.clear()
        self.choice.addItems([solved.title for solved in self._solutions])
        solved = document.solved if document is not None else None
        for i, known in enumerate(self._solutions):
            if known is solved:
                self.choice.setCurrentIndex(i)
        self.choice.setVisible(len(self._solutions) > 1)
        self.save.setVisible(solved is not None and solved.again is not None)
        written = document.saved_as(solved) if document is not None and solved is not None else None
        self.save.setEnabled(written is None)
        self.save.setText("Save as take" if written is None else "Saved")
        self.save.setToolTip(_SAVE_TIP if written is None else f"Saved as {written.name}.")
        for button in (self.solve, self.export):
            button.setEnabled(document is not None)
