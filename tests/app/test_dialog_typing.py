"""What somebody chose or typed in a dialog stays while its work goes on and when it is asked for again."""

from __future__ import annotations

import threading

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from app.props.define_dialog import DefineDialog
from app.props.examined import examine
from app.settings import Settings
from app.training import dialog as dialogs
from app.training.dialog import TrainingDialog
from core.frames import MarkerFrame, Times
from tests.app.hand_frames import profile
from tests.app.stage import until


def frames(n: int = 240) -> list[MarkerFrame]:
    """Four points of a thing that drifts and turns."""
    thing_m = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.0, 0.08, 0.0], [0.02, 0.03, 0.06]])
    made = []
    for i in range(n):
        turn = 0.01 * i
        about_y = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
        points_m = thing_m @ about_y.T + [0.001 * i, 1.0, 0.0]
        made.append(MarkerFrame(i, Times(i / 120, i / 120, i / 120), points_m, np.arange(1, 5), np.full(4, np.nan)))
    return made


def test_a_shape_chosen_while_the_points_are_examined_stays(qtbot):
    go = threading.Event()

    def work(report):
        go.wait(60)
        return examine(frames(), 0, range(4), report)

    dialog = DefineDialog(work, "prop", (), False)
    qtbot.addWidget(dialog)
    dialog.show()
    qtbot.waitExposed(dialog)
    dialog.name.setFocus()
    dialog.name.selectAll()
    QTest.keyClicks(dialog.name, "pen")
    shape = dialog.form.shape
    usual = shape.currentData()
    shape.setFocus()
    QTest.keyClick(shape, Qt.Key.Key_End)  # the last in the list
    chosen = shape.currentData()
    assert chosen != usual
    go.set()
    until(
        lambda: dialog.examined is not None or dialog.said.property("level"),
        "the points to be examined",
        lambda s: qtbot.wait(20),
    )
    assert dialog.examined is not None, dialog.said.text()
    assert shape.currentData() == chosen and dialog.name.text() == "pen" and dialog.focusWidget() is shape
    dialog.stop()


def test_where_to_write_a_network_stays_when_the_dialog_is_asked_for_again(qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr(dialogs, "missing_packages", list)
    dialog = TrainingDialog(profile, tmp_path, Settings(None))
    qtbot.addWidget(dialog)
    dialog.open_again()
    qtbot.waitExposed(dialog)
    dialog.out.setFocus()
    dialog.out.selectAll()
    QTest.keyClicks(dialog.out, "/data/mine")
    dialog.open_again()
    assert dialog.out.text() == "/data/mine"
