"""Another shape or size for a prop there is."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtWidgets import QDialog, QDialogButtonBox, QWidget

from app.lights import label
from app.panels.panel import column
from app.props.shape_form import ShapeForm
from app.texts import window_title
from core.props.define import modelled
from core.props.prop import Prop
from core.props.rigid import aligned


class ShapeDialog(QDialog):
    """After it was accepted, `prop` is the prop with its new model, its markers where they were to each other."""

    def __init__(self, prop: Prop, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle(window_title(f"Shape of {prop.name}"))
        self._before = prop
        self.prop: Prop | None = None
        self.form = ShapeForm(prop.name, lambda shape: modelled(prop.markers_m, shape)[1].size_m)
        self.form.name.setEnabled(False)
        self.form.choose(prop.model.shape, prop.model.size_m)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        layout = column(self, 16, 10)
        layout.addWidget(self.form)
        layout.addWidget(label("Another shape is laid about the middle of the markers anew.", "small", wrap=True))
        layout.addWidget(buttons)
        self.setMinimumWidth(320)

    def accept(self) -> None:
        """Take the shape; the same one keeps its place on the markers."""
        model = self.form.model
        if model.shape == self._before.model.shape:
            self.prop = replace(self._before, model=model)
        else:
            markers_m, _ = modelled(self._before.markers_m, model.shape, model.size_m)
            home = self._before.home
            if home is not None:
                home = home @ aligned(markers_m, self._before.markers_m)[:3, :3]
            self.prop = replace(self._before, markers_m=markers_m, model=model, home=home)
        super().accept()
