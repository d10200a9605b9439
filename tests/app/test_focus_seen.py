"""What the keyboard acts on is seen: every widget that takes the focus looks different with it, and clearly so."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QCheckBox, QLineEdit, QPlainTextEdit, QToolButton, QWidget

from app.review.timeline import Timeline
from tests.app.stage import server
from tests.app.takes import write_take
from tests.app.test_window import Desk

CLEAR = 150
"""Sum of the differences of red, green and blue that a pixel of a ring has at least."""
RING_PIXELS = 24


def picture(widget: QWidget) -> np.ndarray:
    image = widget.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    data = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine() // 4, 4)
    return data[:, : image.width(), :3].astype(int)


def reached_by_tab(window: QWidget) -> list[QWidget]:
    """What the Tab key stops at, in its order."""
    found, widget = [], window.nextInFocusChain()
    while widget is not window:
        stop = bool(widget.focusPolicy() & Qt.FocusPolicy.TabFocus) and widget.focusProxy() is None
        if stop and widget.isEnabled() and widget.window() is window and not widget.visibleRegion().isEmpty():
            found.append(widget)
        widget = widget.nextInFocusChain()
    return found


def unseen(desk, window: QWidget) -> list[str]:
    """Widgets that take the focus and do not show it."""
    bad = []
    for widget in reached_by_tab(window):
        window.setFocus()
        desk.qtbot.wait(30)
        without = picture(widget)
        widget.setFocus(Qt.FocusReason.TabFocusReason)
        if window.focusWidget() is not widget:
            continue
        desk.qtbot.wait(30)
        having = picture(widget)
        if having.shape != without.shape:
            bad.append(f"{type(widget).__name__} changes its size")
        elif (np.abs(having - without).sum(axis=2) > CLEAR).sum() < RING_PIXELS:
            bad.append(f"{type(widget).__name__} {widget.property('text')} {widget.objectName()}")
    return bad


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    made.window.raise_()
    made.window.activateWindow()
    made.until(made.window.isActiveWindow, "the window to be active")
    yield made
    made.close()


def test_focus_is_seen_in_the_live_room(desk):
    with server() as simulator:
        desk.add(simulator)
        desk.card.show_settings(True)
        desk.window.docks["messages"].raise_()
        desk.qtbot.wait(200)
        kinds = {type(widget) for widget in reached_by_tab(desk.window)}
        assert {QToolButton, QLineEdit} <= kinds
        assert unseen(desk, desk.window) == []


def test_focus_is_seen_in_review(desk):
    folder = desk.window.plan.folder
    folder.mkdir(parents=True)
    desk.window.review_take(write_take(folder, "first", 60))
    room = desk.window._review
    desk.until(lambda: room.document is not None and room.document.analysis is not None, "the take")
    desk.qtbot.wait(200)
    kinds = {type(widget) for widget in reached_by_tab(desk.window)}
    assert Timeline in kinds and any(issubclass(kind, QPlainTextEdit) for kind in kinds)
    assert unseen(desk, desk.window) == []
    room.export_take()
    dialog = room._dialog
    dialog.activateWindow()
    desk.until(dialog.isActiveWindow, "the dialog")
    assert QCheckBox in {type(widget) for widget in reached_by_tab(dialog)}
    assert unseen(desk, dialog) == []
    dialog.reject()
