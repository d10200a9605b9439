"""The wheel over lists and numbers: it scrolls what is around them, unless one of them was chosen."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractSpinBox, QComboBox, QScrollArea, QSlider, QWidget

from app.application import DemoDevice
from app.props.shape_form import ShapeForm
from app.review.solve_dialog import SolveDialog
from app.settings import Settings
from app.training.dialog import TrainingDialog
from core.profile import load_profile
from devices.natnet.client import NatNetDevice
from tests.app.test_window import Desk

NOTCHES = (-120, 120)


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    made.window.raise_()
    made.window.activateWindow()
    made.until(made.window.isActiveWindow, "the window to be active")
    yield made
    made.close()


def turn(widget, notch):
    """The wheel, with the pointer on a widget that can be seen."""
    area, window = around(widget), widget.window()
    if area is not None:
        area.ensureWidgetVisible(widget)
    place = widget.mapTo(window, QPoint(min(widget.width() // 2, 30), widget.height() // 2))
    under = window.childAt(place)
    assert under is widget or widget.isAncestorOf(under), (widget, under)
    QTest.wheelEvent(window.windowHandle(), QPointF(place), QPoint(0, notch))


def around(widget):
    while widget is not None and not isinstance(widget, QScrollArea):
        widget = widget.parentWidget()
    return widget


def editors(root):
    """Every list and number that can be seen."""
    return [
        w for kind in (QComboBox, QAbstractSpinBox, QSlider) for w in root.findChildren(kind) if w.isVisibleTo(root)
    ]


def shown(editor):
    return editor.currentText() if isinstance(editor, QComboBox) else editor.text()


def check_stays(root):
    found = editors(root)
    for editor in found:
        editor.clearFocus()
        assert not editor.focusPolicy() & Qt.FocusPolicy.WheelFocus & ~Qt.FocusPolicy.StrongFocus, editor
        before = shown(editor)
        for notch in NOTCHES:
            turn(editor, notch)
            assert shown(editor) == before and not editor.hasFocus(), editor
    return len(found)


def test_it_changes_nothing_in_the_window_and_scrolls_its_panels(desk):
    window = desk.window
    window.resize(1600, 700)
    for kind in (NatNetDevice, DemoDevice):
        window.devices.add(kind, {})
    desk.worker.set_profiles((load_profile("han19"), load_profile("qualisys13")))
    QTest.qWait(500)
    before = [stream.settings for stream in desk.session.receivers], desk.session.profiles, desk.window.undo.count()
    assert check_stays(window) >= 3 + 3 + 5 + 2 * 2 + 2  # of two devices, two performers, look-ahead and the plots
    assert ([s.settings for s in desk.session.receivers], desk.session.profiles, desk.window.undo.count()) == before
    scrolled = 0
    for editor in editors(window):
        area = around(editor)
        if area is None or not area.verticalScrollBar().maximum():
            continue
        area.ensureWidgetVisible(editor)
        at = area.verticalScrollBar().value()
        turn(editor, 120 if at else -120)
        assert area.verticalScrollBar().value() != at, editor
        scrolled += 1
    assert scrolled >= 10


def test_it_changes_what_was_chosen(desk):
    desk.window.devices.add(NatNetDevice, {})
    QTest.qWait(500)  # until what the card says has been laid out
    for name in ("bitstream", "command_port"):
        editor = desk.card.form.editor(name)
        before = shown(editor)
        editor.setFocus()
        turn(editor, -120)
        assert shown(editor) != before


def test_it_changes_nothing_in_review_and_the_dialogs(desk, qtbot):
    desk.window.show_review(True)
    review = desk.window._review
    assert check_stays(review) >= 2
    profile = load_profile("han19")
    dialogs: list[QWidget] = [
        SolveDialog(profile, profile, desk.window),
        TrainingDialog(lambda: profile, desk.window.plan.folder, Settings(None), desk.window),
        ShapeForm("pen", lambda shape: (0.01, 0.02, 0.03)),
    ]
    for dialog in dialogs:
        qtbot.addWidget(dialog)
        dialog.show()
        assert check_stays(dialog) >= 1
