"""Where the keys go. Single letters are shortcuts: no text field has the focus unless an operator chose it."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, Qt, Slot
from PySide6.QtWidgets import QApplication, QDockWidget, QMainWindow, QWidget

from app.editing import take_up_typing


class Focus(QObject):
    """Gives it to the 3D view that is shown wherever Qt would pass it on to the next field or button.

    Qt does so when what has the focus is locked, hidden or removed, and when a window without any is activated.
    A click on what takes no keys goes to the window itself, and so leaves a field. Panels that float belong to it all.
    """

    def __init__(self, window: QMainWindow, view: Callable[[], QWidget]) -> None:
        super().__init__(window)
        self._window, self._view = window, view
        window.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        view().setFocus()
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        application.focusChanged.connect(self._moved)

    def leave_fields(self) -> None:
        """Take up what was typed; the keys go to the 3D view."""
        take_up_typing(self._window)
        self._to_view()

    def activated(self) -> None:
        """The window has come to the front."""
        if self._window.focusWidget() is None:
            self._view().setFocus()

    def _to_view(self) -> None:
        if self._floating(QApplication.activeWindow()):
            self._window.activateWindow()
        self._view().setFocus()

    def _floating(self, active: QWidget | None) -> bool:
        return isinstance(active, QDockWidget) and active.parentWidget() is self._window

    @Slot(QWidget, QWidget)
    def _moved(self, old: QWidget | None, now: QWidget | None) -> None:
        active = QApplication.activeWindow()
        ours = active is self._window or self._floating(active)
        if ours and (now is None or _gone(old, now)):
            self._to_view()


def _gone(old: QWidget | None, now: QWidget) -> bool:
    """Whether the focus was passed on because its holder cannot have it any more."""
    return old is not None and old.window() is now.window() and not (old.isEnabled() and old.isVisible())
