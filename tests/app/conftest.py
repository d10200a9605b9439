"""Fixtures of the tests that draw."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication

from tests.app.drawn import viewport

__all__ = ["viewport"]


@pytest.fixture(autouse=True)
def windows_go() -> Iterator[None]:
    """A window that was closed goes with its test. The session freezes what lives when it starts, so that nobody else
    would collect it, and hundreds of windows would be looked at whenever anything changes for all."""
    yield
    application = QApplication.instance()
    if not isinstance(application, QApplication):
        return
    for widget in application.topLevelWidgets():
        if type(widget).__name__ == "MainWindow" and not widget.isVisible():
            widget.deleteLater()
    application.sendPostedEvents(None, QEvent.Type.DeferredDelete)
