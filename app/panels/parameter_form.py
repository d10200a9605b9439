"""A form made from a device's parameters: ranges, units and help come from the device, not from here."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QFileDialog,
    QFormLayout,
    QLabel,
    QLineEdit,
    QSpinBox,
    QToolButton,
    QWidget,
)

from app.editing import Editor, Field
from app.lights import label
from app.panels.offered_choice import OfferedChoice
from app.panels.panel import row
from devices.parameter import Parameter, Value

FILE_NAMES = ("file", "path")
MOTION_FILES = "Motion files (*.mcap *.trc *.c3d *.tsv *.csv *.bvh);;All files (*)"
_BOUND = 2_000_000_000


class ParameterForm(QWidget):
    """One editor per parameter. `edited` is sent when an operator has finished a change that is valid."""

    edited = Signal(str, object)
    confirmed = Signal()
    """Enter was pressed in a field, and what it holds is valid and was sent."""

    def __init__(
        self,
        parameters: Sequence[Parameter],
        values: Mapping[str, Value],
        check: Callable[[Mapping[str, Value]], object] = lambda changed: None,
    ) -> None:
        """check: raises PhalanxError for what no parameter by itself can tell is wrong."""
        super().__init__()
        self._parameters = {parameter.name: parameter for parameter in parameters}
        self._fields: dict[str, Field] = {}
        self.browse: dict[str, QToolButton] = {}
        self._check = check
        self.problems: dict[str, QLabel] = {}
        self._offered: dict[str, OfferedChoice] = {}
        form = QFormLayout(self)
        form.setContentsMargins(0, 0, 0, 0)
        form.setHorizontalSpacing(8)
        form.setVerticalSpacing(5)
        form.setLabelAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        form.setRowWrapPolicy(QFormLayout.RowWrapPolicy.WrapLongRows)
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        for parameter in parameters:
            editor = self._make_editor(parameter)
            tip = describe(parameter)
            editor.setToolTip(tip)
            editor.setAccessibleName(parameter.label)
            self._fields[parameter.name] = self._field(parameter, editor)
            field: QWidget = editor
            if parameter.name in FILE_NAMES and isinstance(editor, QLineEdit):
                field = self._with_browse(parameter, editor)
            name = label(parameter.label, "muted")
            name.setToolTip(tip)
            if isinstance(editor, QCheckBox):
                editor.setText(parameter.label)
                form.addRow(editor)
            else:
                form.addRow(name, field)
            problem = self.problems[parameter.name] = label("", "small", wrap=True)
            problem.setProperty("level", "problem")
            problem.hide()
            form.addRow(problem)
            if isinstance(editor, OfferedChoice):
                self._offered[parameter.name] = editor
                editor.looked.connect(self._say_missing)
        self.set_values(values)

    def editor(self, name: str) -> Editor:
        """The widget of one parameter."""
        return self._fields[name].editor

    def set_values(self, values: Mapping[str, Value]) -> None:
        """Show these values, but for a field that somebody is at; nothing is sent."""
        for name, field in self._fields.items():
            field.show(values.get(name, self._parameters[name].default))
        self._say_missing()

    def set_recording(self, recording: bool) -> None:
        """Lock what may not change while a take is written."""
        for name, field in self._fields.items():
            able = not (recording and self._parameters[name].locked_while_recording)
            field.editor.setEnabled(able)
            if name in self.browse:
                self.browse[name].setEnabled(able)

    def _field(self, parameter: Parameter, editor: Editor) -> Field:
        field = Field(editor, lambda value: self._take(parameter, value))
        field.confirmed.connect(self.confirmed)
        field.refused.connect(lambda reason: self._refused(parameter, reason))
        return field

    def _make_editor(self, parameter: Parameter) -> Editor:
        kind = type(parameter.default)
        if kind is bool:
            return QCheckBox()
        if callable(parameter.choices):
            return OfferedChoice(parameter.choices)
        if parameter.choices:
            combo = QComboBox()
            combo.addItems(parameter.choices)
            return combo
        if kind is int:
            spin = QSpinBox()
            spin.setRange(int(max(parameter.minimum, -_BOUND)), int(min(parameter.maximum, _BOUND)))
            spin.setSingleStep(max(int(parameter.step), 1))
            spin.setGroupSeparatorShown(False)
            self._finish_spin(spin, parameter)
            return spin
        if kind is float:
            number = QDoubleSpinBox()
            number.setRange(max(parameter.minimum, -_BOUND), min(parameter.maximum, _BOUND))
            step = parameter.step or 0.1
            number.setSingleStep(step)
            number.setDecimals(max(0, min(6, math.ceil(-math.log10(step)))) if step < 1 else 1)
            self._finish_spin(number, parameter)
            return number
        return QLineEdit()

    def _say_missing(self) -> None:
        """What is chosen and was not there when it was last looked for."""
        for name, choice in self._offered.items():
            if not choice.property("wrong"):  # then it is said what is
                gone = f"{choice.currentText()} is not there now. Connect it, or choose another."
                self.problems[name].setText(gone if choice.missing else "")
                self.problems[name].setVisible(choice.missing)

    @staticmethod
    def _finish_spin(spin: QAbstractSpinBox, parameter: Parameter) -> None:
        spin.setKeyboardTracking(False)
        if parameter.unit and isinstance(spin, QSpinBox | QDoubleSpinBox):
            spin.setSuffix(f" {parameter.unit}")

    def _with_browse(self, parameter: Parameter, editor: QLineEdit) -> QWidget:
        browse = self.browse[parameter.name] = QToolButton(text="Browse…")
        browse.clicked.connect(lambda: self._browse(parameter, editor))
        field = QWidget()
        field.setLayout(row(editor, browse))
        return field

    def _browse(self, parameter: Parameter, editor: QLineEdit) -> None:
        path, _ = QFileDialog.getOpenFileName(self, parameter.label, editor.text(), MOTION_FILES)
        if path:
            editor.setText(path)
            self._fields[parameter.name].take_up()

    def _take(self, parameter: Parameter, value: Value) -> None:
        checked = parameter.check(value)
        self._check({parameter.name: checked})
        self.edited.emit(parameter.name, checked)

    def _refused(self, parameter: Parameter, reason: str) -> None:
        self.problems[parameter.name].setText(reason)
        self.problems[parameter.name].setVisible(bool(reason))
        self.editor(parameter.name).setToolTip(reason or describe(parameter))


def describe(parameter: Parameter) -> str:
    """The tooltip: what it is, its range and unit, its default, whether recording locks it."""
    parts = [parameter.help or parameter.label]
    low, high = parameter.minimum, parameter.maximum
    unit = f" {parameter.unit}" if parameter.unit else ""
    if math.isfinite(low) and math.isfinite(high):
        parts.append(f"{low:g} to {high:g}{unit}.")
    if parameter.default != "" and not isinstance(parameter.default, bool):
        parts.append(f"Default: {parameter.default}{unit}.")
    if parameter.locked_while_recording:
        parts.append("Locked while recording.")
    return "\n".join(parts)
