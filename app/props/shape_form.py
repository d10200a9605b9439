"""Shape and size of a prop, to choose."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QComboBox, QDoubleSpinBox, QGridLayout, QLineEdit, QWidget

from app.editing import leave_wheel_to_panel
from app.lights import label
from core.props.prop import FARTHEST_M, N_LENGTHS, PropModel, Shape

SHAPES: tuple[tuple[Shape, str, tuple[str, ...]], ...] = (
    ("cylinder", "Cylinder", ("Diameter", "Length")),
    ("sphere", "Sphere", ("Diameter",)),
    ("box", "Box", ("Height", "Width", "Length")),
    ("none", "None: its markers alone", ()),
)
"""Key, title, and the lengths that a shape has, in the order of PropModel."""

_LENGTHS = 3


class ShapeForm(QWidget):
    """Name, shape and lengths. usual_m: the lengths at first, [m], of a shape chosen; () while they are not known."""

    def __init__(self, name: str, usual_m: Callable[[Shape], tuple[float, ...]]) -> None:
        super().__init__()
        self._usual_m = usual_m
        self.name = QLineEdit(name)
        self.shape = leave_wheel_to_panel(QComboBox())
        for shape, title, _ in SHAPES:
            self.shape.addItem(title, shape)
        self.shape.setToolTip("What is drawn and exported. Tracking goes by the markers alone.")
        self.headings = [label("", "muted") for _ in range(_LENGTHS)]
        self.lengths = [leave_wheel_to_panel(QDoubleSpinBox()) for _ in range(_LENGTHS)]
        for spin in self.lengths:
            spin.setRange(1.0, 1e3 * FARTHEST_M)
            spin.setDecimals(1)
            spin.setSuffix(" mm")
            spin.setToolTip("At first the smallest that holds the centres of the markers.")
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(10)
        grid.setVerticalSpacing(8)
        fields = [(label("Name", "muted"), self.name), (label("Shape", "muted"), self.shape)]
        for i, (heading, field) in enumerate((*fields, *zip(self.headings, self.lengths, strict=True))):
            grid.addWidget(heading, i, 0)
            grid.addWidget(field, i, 1)
        grid.setColumnMinimumWidth(0, 64)
        grid.setColumnStretch(1, 1)
        grid.setRowStretch(len(fields) + _LENGTHS, 1)
        self.chosen = False
        """Somebody has chosen the shape."""
        self.shape.activated.connect(lambda _: setattr(self, "chosen", True))
        self.shape.currentIndexChanged.connect(lambda _: self.refresh())
        self.refresh()

    @property
    def model(self) -> PropModel:
        """As it is chosen."""
        shape: Shape = self.shape.currentData()
        return PropModel(shape, tuple(spin.value() / 1e3 for spin in self.lengths[: N_LENGTHS[shape]]))

    def choose(self, shape: Shape, size_m: tuple[float, ...] = ()) -> None:
        """Choose a shape; () for its usual lengths."""
        self.shape.setCurrentIndex(self.shape.findData(shape))
        self.refresh()
        for spin, length_m in zip(self.lengths, size_m, strict=False):
            spin.setValue(1e3 * length_m)

    def refresh(self) -> None:
        """Show the lengths of the shape chosen, at first the usual ones."""
        shape, _, titles = SHAPES[self.shape.currentIndex()]
        usual_m = self._usual_m(shape)
        for i, (heading, spin) in enumerate(zip(self.headings, self.lengths, strict=True)):
            there = i < len(titles)
            heading.setVisible(there)
            spin.setVisible(there)
            spin.setEnabled(bool(usual_m))
            heading.setText(titles[i] if there else "")
            if there and usual_m:
                spin.setValue(1e3 * usual_m[i])
