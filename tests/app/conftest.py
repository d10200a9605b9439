"""Fixtures of the tests that draw or need the whole window."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication

from app import settings as names
from app import theme
from app.main_window import MainWindow
from app.session import Session
from app.settings import Settings
from app.worker import SessionWorker
from core.profile import load_profile
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


@pytest.fixture
def window(qtbot, tmp_path) -> Iterator[MainWindow]:
    """A window that is not shown, with one performer in han19 and no device."""
    settings = Settings(None)
    settings.set(names.TAKE_FOLDER, str(tmp_path))
    theme.apply(QApplication.instance())
    made = MainWindow(SessionWorker(Session(load_profile("han19")), 30), settings)
    qtbot.addWidget(made)
    yield made
    made.stop_and_close()
