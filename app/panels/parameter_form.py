"""A form made from a device's parameters: ranges, units and help come from the device, not from here."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QFileDialog,
    QFormLayout,
    QLineEdit,
    QSpinBox,
    QToolButton,
    QWidget,
)

from app.lights import label, set_property
from app.panels.panel import row
from core.errors import DeviceError
from devices.device import Parameter, Value

FILE_NAMES = ("file", "path")
MOTION_FILES = "Motion files (*.mcap *.trc *.c3d *.tsv *.csv);;All files (*)"
_BOUND = 2_000_000_000


class ParameterForm(QWidget):
    """One editor per parameter. `edited` is sent when an operator has finished a change that is valid."""

    edited = Signal(str, object)

    def __init__(self, parameters: Sequence[Parameter], values: Mapping[str, Value]) -> None:
        super().__init__()
        self._parameters = {parameter.name: parameter for parameter in parameters}
        self._editors: dict[str, QWidget] = {}
        self._values = dict(values)
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
            self._editors[parameter.name] = editor
            field = editor
            if parameter.name in FILE_NAMES and isinstance(editor, QLineEdit):
                field = self._with_browse(parameter, editor)
            name = label(parameter.label, "muted")
            name.setToolTip(tip)
            if isinstance(editor, QCheckBox):
                editor.setText(parameter.label)
                form.addRow(editor)
            else:
                form.addRow(name, field)
        self.set_values(values)

    def editor(self, name: str) -> QWidget:
        """The widget of one parameter."""
        return self._editors[name]

    def set_values(self, values: Mapping[str, Value]) -> None:
        """Show these values; nothing is sent."""
        self._values = dict(values)
        for name, editor in self._editors.items():
            value = self._values.get(name, self._parameters[name].default)
            editor.blockSignals(True)
            if isinstance(editor, QCheckBox):
                editor.setChecked(bool(value))
            elif isinstance(editor, QComboBox):
                editor.setCurrentText(str(value))
            elif isinstance(editor, QSpinBox):
                editor.setValue(int(value))
            elif isinstance(editor, QDoubleSpinBox):
                editor.setValue(float(value))
            elif isinstance(editor, QLineEdit) and editor.text() != str(value):
                editor.setText(str(value))
            editor.blockSignals(False)

    def set_recording(self, recording: bool) -> None:
        """Lock what may not change while a take is written."""
        for name, editor in self._editors.items():
            editor.setEnabled(not (recording and self._parameters[name].locked_while_recording))

    def _make_editor(self, parameter: Parameter) -> QWidget:
        name, kind = parameter.name, type(parameter.default)
        if kind is bool:
            check = QCheckBox()
            check.toggled.connect(lambda value: self._finish(name, value))
            return check
        if parameter.choices:
            combo = QComboBox()
            combo.addItems(parameter.choices)
            combo.currentTextChanged.connect(lambda text: self._finish(name, text))
            return combo
        if kind is int:
            spin = QSpinBox()
            spin.setRange(int(max(parameter.minimum, -_BOUND)), int(min(parameter.maximum, _BOUND)))
            spin.setSingleStep(max(int(parameter.step), 1))
            spin.setGroupSeparatorShown(False)
            self._finish_spin(spin, parameter)
            spin.editingFinished.connect(lambda: self._finish(name, spin.value()))
            return spin
        if kind is float:
            number = QDoubleSpinBox()
            number.setRange(max(parameter.minimum, -_BOUND), min(parameter.maximum, _BOUND))
            step = parameter.step or 0.1
            number.setSingleStep(step)
            number.setDecimals(max(0, min(6, math.ceil(-math.log10(step)))) if step < 1 else 1)
            self._finish_spin(number, parameter)
            number.editingFinished.connect(lambda: self._finish(name, number.value()))
            return number
        line = QLineEdit()
        line.editingFinished.connect(lambda: self._finish(name, line.text().strip()))
        return line

    @staticmethod
    def _finish_spin(spin: QAbstractSpinBox, parameter: Parameter) -> None:
        spin.setKeyboardTracking(False)
        if parameter.unit and isinstance(spin, QSpinBox | QDoubleSpinBox):
            spin.setSuffix(f" {parameter.unit}")

    def _with_browse(self, parameter: Parameter, editor: QLineEdit) -> QWidget:
        browse = QToolButton(text="Browse…")
        browse.clicked.connect(lambda: self._browse(parameter, editor))
        field = QWidget()
        field.setLayout(row(editor, browse))
        return field

    def _browse(self, parameter: Parameter, editor: QLineEdit) -> None:
        path, _ = QFileDialog.getOpenFileName(self, parameter.label, editor.text(), MOTION_FILES)
        if path:
            editor.setText(path)
            self._finish(parameter.name, path)

    def _finish(self, name: str, value: Value) -> None:
        editor = self._editors[name]
        try:
            checked = self._parameters[name].check(value)
        except DeviceError as error:
            set_property(editor, "wrong", True)
            editor.setToolTip(str(error))
            return
        set_property(editor, "wrong", False)
        editor.setToolTip(describe(self._parameters[name]))
        if checked != self._values.get(name):
            self._values[name] = checked
            self.edited.emit(name, checked)


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
