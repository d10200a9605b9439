"""Editors that are refreshed from elsewhere: an operator who is at one goes before what would be written into it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QLineEdit,
    QPlainTextEdit,
    QSpinBox,
    QTextEdit,
    QWidget,
)

from app.lights import set_property
from core.errors import PhalanxError

Editor = QLineEdit | QPlainTextEdit | QSpinBox | QDoubleSpinBox | QComboBox | QCheckBox
TAKE_LETTERS = (QLineEdit, QPlainTextEdit, QTextEdit, QAbstractSpinBox)
ENTER = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
T = TypeVar("T", bound=QWidget)


class Field(QObject):
    """An editor with the value it shows. Nothing is written into it while an operator is at it.

    Text and numbers are being edited while they have the focus, or differ from what was shown and are not taken yet;
    a list while it is open. Enter and leaving take what was entered, Escape puts back what was there.

    take: called once with what was entered. It may raise PhalanxError: what was typed then stays, marked as wrong.
    """

    typed = Signal(object)
    """The value after every key."""
    confirmed = Signal()
    """Enter was pressed and what the field holds was taken."""
    refused = Signal(str)
    """Why what was typed is wrong; empty when that is mended."""

    def __init__(self, editor: Editor, take: Callable[[Any], object]) -> None:
        super().__init__(editor)
        self.editor, self._take = editor, take
        self._wanted: Any = self.value
        self._keep()
        self._wrong = False
        editor.installEventFilter(self)
        if isinstance(editor, QAbstractSpinBox | QComboBox):
            leave_wheel_to_panel(editor)
        if isinstance(editor, QLineEdit):
            editor.textEdited.connect(lambda _: self.typed.emit(self.value))
            editor.editingFinished.connect(self.take_up)
        elif isinstance(editor, QAbstractSpinBox):
            editor.editingFinished.connect(self.take_up)
        elif isinstance(editor, QPlainTextEdit):
            editor.textChanged.connect(lambda: self.typed.emit(self.value))
        elif isinstance(editor, QComboBox):
            editor.view().installEventFilter(self)
            editor.currentTextChanged.connect(lambda _: self.take_up())
        else:
            editor.toggled.connect(lambda _: self.take_up())

    @property
    def value(self) -> Any:
        """What the editor holds."""
        editor = self.editor
        if isinstance(editor, QLineEdit):
            return editor.text().strip()
        if isinstance(editor, QSpinBox | QDoubleSpinBox):
            return editor.value()
        return self._content()

    @property
    def edited(self) -> bool:
        """Something was entered that is not taken yet."""
        return self._content() != self._kept

    @property
    def busy(self) -> bool:
        """An operator is at it."""
        if isinstance(self.editor, QComboBox):
            return list_open(self.editor)
        return not isinstance(self.editor, QCheckBox) and (self._chosen or self.edited)

    def show(self, value: Any) -> None:
        """What it should show, at once or as soon as nobody is at it."""
        self._wanted = value
        if not self.busy:
            self._write()

    def reset(self, value: Any) -> None:
        """Show this whoever is at it: the field is about another thing from here on."""
        self._wanted = value
        self._mark("")
        self._write()

    def take_up(self) -> bool:
        """Take what was entered, as if the field had been left. False if it is refused."""
        if self.edited:
            if isinstance(self.editor, QAbstractSpinBox):
                self.editor.interpretText()
            before, value = self._wanted, self.value
            if value != self._taken:
                self._wanted = value
                try:
                    self._take(value)
                except PhalanxError as error:
                    self._wanted = before
                    self._mark(str(error))
                    return False
            self._mark("")
            self._keep()
        if not self.busy:
            self._write()
        return True

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: D102, N802
        kind = event.type()
        if watched is not self.editor:
            if kind == QEvent.Type.Hide:  # the list of a combo box; the choice made in it comes first
                QTimer.singleShot(0, self, lambda: self.show(self._wanted))
        elif kind == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            return self._key(event)
        elif isinstance(self.editor, TAKE_LETTERS) and _left_by(event):
            self.take_up()
        return False

    def _key(self, event: QKeyEvent) -> bool:
        editor, key = self.editor, event.key()
        if not isinstance(editor, TAKE_LETTERS):
            return False
        lines = isinstance(editor, QPlainTextEdit)
        if key == Qt.Key.Key_Escape:
            if not lines:  # many words are not thrown away by one key
                self.reset(self._wanted)
                self.typed.emit(self.value)
            editor.clearFocus()
            return True
        if key in ENTER and (not lines or event.modifiers() & Qt.KeyboardModifier.ControlModifier):
            if self.take_up():
                self.confirmed.emit()
                editor.clearFocus()
            return True
        return False

    @property
    def _chosen(self) -> bool:
        """It has the focus of its window, also while another application is in front."""
        return self.editor.window().focusWidget() is self.editor

    def _content(self) -> Any:
        editor = self.editor
        if isinstance(editor, QPlainTextEdit):
            return editor.toPlainText()
        if isinstance(editor, QCheckBox):
            return editor.isChecked()
        return editor.currentText() if isinstance(editor, QComboBox) else editor.text()

    def _write(self) -> None:
        editor, value = self.editor, self._wanted
        blocked = editor.blockSignals(True)
        if isinstance(editor, QCheckBox):
            editor.setChecked(bool(value))
        elif isinstance(editor, QComboBox):
            editor.setCurrentText(str(value))
        elif isinstance(editor, QSpinBox | QDoubleSpinBox):
            editor.setValue(value)
        elif self._content() != str(value):  # writing moves the cursor and forgets the undo of the text
            editor.setPlainText(str(value)) if isinstance(editor, QPlainTextEdit) else editor.setText(str(value))
        editor.blockSignals(blocked)
        self._keep()

    def _keep(self) -> None:
        """What the editor holds now was entered by nobody, or is taken."""
        self._kept, self._taken = self._content(), self.value

    def _mark(self, reason: str) -> None:
        if reason or self._wrong:
            self._wrong = bool(reason)
            set_property(self.editor, "wrong", self._wrong)
            self.refused.emit(reason)


def _left_by(event: QEvent) -> bool:
    """Whether the focus has gone elsewhere, and not to a menu of the editor's own."""
    return isinstance(event, QFocusEvent) and event.lostFocus() and event.reason() != Qt.FocusReason.PopupFocusReason


def take_up_typing(window: QWidget) -> None:
    """What was typed in any field of the window and not left counts from here on."""
    for field in window.findChildren(Field):
        field.take_up()


def list_open(choice: QComboBox) -> bool:
    """Whether somebody is choosing from it now."""
    return choice.view().isVisible()


def leave_wheel_to_panel(editor: T) -> T:
    """The wheel changes an editor only while it has the focus, and never gives it: else it scrolls what is around."""
    if editor.focusPolicy() == Qt.FocusPolicy.WheelFocus:
        editor.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    editor.installEventFilter(_WHEEL)
    return editor


class _Wheel(QObject):
    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        if event.type() == QEvent.Type.Wheel and isinstance(watched, QWidget) and not watched.hasFocus():
            event.ignore()
            return True
        return False


_WHEEL = _Wheel()
