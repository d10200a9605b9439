"""Names that act where they are shown, or look like markup: in the whole window, live and in review."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QAbstractItemModel, QAbstractListModel, QModelIndex, QPoint, Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QAbstractItemView,
    QApplication,
    QComboBox,
    QLabel,
    QLineEdit,
    QMessageBox,
    QPlainTextEdit,
    QPushButton,
    QToolTip,
    QWidget,
)

from app.main_window import MainWindow
from app.review.export_dialog import ExportDialog
from app.texts import on_button, window_title
from core.frames import RigidBody
from core.printable import MOST_OF_TEXT
from core.profile import Profile
from devices.natnet.client import NatNetDevice
from devices.natnet.simulator import NatNetSimulator
from tests.app.evil import EVIL, EVIL_FILE, SHOWN, acting, assert_calm, evil_profile, evil_take
from tests.app.stage import performance, settings_for
from tests.app.test_window import Desk

HOLDS_A_PATH = ("folder",)
"""Editors of a path hold the path itself."""


@pytest.fixture
def server() -> Iterator[NatNetSimulator]:
    body = RigidBody(7, EVIL, np.zeros(3), np.array([1.0, 0, 0, 0]), True)
    frames = [replace(frame, rigid_bodies=(body,)) for frame in performance()]
    with NatNetSimulator(frames, 120.0, command_port=0, data_port=0, loop=True, name=EVIL) as simulator:
        simulator.start()
        yield simulator


@pytest.fixture
def desk(qtbot, tmp_path: Path, server: NatNetSimulator) -> Iterator[MainWindow]:
    """A window on such a profile, such a server, and a folder of such a name with such a take."""
    folder = tmp_path / EVIL_FILE.replace("\udce9", "")  # settings remember text
    evil_take(folder)
    made = Desk(qtbot, folder, profiles=[Profile.from_dict(evil_profile().to_dict())] * 2)
    made.window.wait = made.until
    yield made.window
    made.close()


def texts_of(root: QWidget) -> Iterator[tuple[str, str]]:
    """Where and what, of everything that a window says, in and beside its widgets."""
    for widget in (root, *root.findChildren(QWidget)):
        where = f"{type(widget).__name__} {widget.objectName()}"
        for said in ("windowTitle", "toolTip", "statusTip", "whatsThis", "accessibleName"):
            yield f"{where} {said}", getattr(widget, said)()
        if isinstance(widget, QLineEdit):
            if not Path(widget.text()).is_absolute():
                yield where, widget.text()
            yield where, widget.placeholderText()
        elif isinstance(widget, QPlainTextEdit):
            yield where, widget.toPlainText().replace("\n", " ")  # notes have lines
        elif isinstance(widget, QComboBox):
            for i in range(widget.count()):
                yield where, widget.itemText(i)
                yield where, str(widget.itemData(i, Qt.ItemDataRole.ToolTipRole) or "")
        elif isinstance(widget, QAbstractItemView) and widget.model() is not None:
            yield from ((where, text) for text in cells_of(widget.model()))
        elif callable(getattr(widget, "text", None)):
            yield where, str(widget.text())
    for action in root.findChildren(QAction):
        yield "action", action.text()
        yield "action tip", action.toolTip()


def cells_of(model: QAbstractItemModel, parent: QModelIndex | None = None) -> Iterator[str]:
    parent = parent or QModelIndex()
    columns = 1 if isinstance(model, QAbstractListModel) else model.columnCount(parent)
    for i in range(model.rowCount(parent)):
        for k in range(columns):
            for role in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.ToolTipRole):
                yield str(model.index(i, k, parent).data(role) or "")


def assert_calm_window(root: QWidget) -> str:
    """Nothing in it acts, nothing is taken for markup. Returns all that it says."""
    all_texts = []
    for where, text in texts_of(root):
        assert not acting(text), f"{where}: {text!a}"
        assert len(text) < 10 * MOST_OF_TEXT, where
        all_texts.append(text)
    for label in root.findChildren(QLabel):
        label.ensurePolished()
        if label.property("rich"):
            assert "<b>" not in label.text()
        else:
            assert label.textFormat() == Qt.TextFormat.PlainText, label.text()
    said = "\n".join(all_texts)
    assert_calm(said)
    return said


def test_live(desk: MainWindow, server: NatNetSimulator) -> None:
    stream = desk.worker.add_device(NatNetDevice, settings_for(server))
    desk.worker.connect_device(stream)
    desk.wait(lambda: stream.health().received > 50, "frames")
    desk.wait(lambda: desk.record_action.isEnabled(), "the record button")
    desk.worker.notifications.problem(EVIL, EVIL, EVIL)
    desk.record_action.trigger()
    desk.wait(lambda: desk.worker.session.recording, "a take")
    desk.wait(lambda: "●" in desk.windowTitle(), "the title")
    said = assert_calm_window(desk)
    assert said.count(r"\x1b[2J\nFORGED\t<b>x</b>") > 5, "the names are shown, as they are written"
    desk.record_action.trigger()
    desk.wait(lambda: not desk.worker.session.recording, "the end")
    assert_calm_window(desk)


def test_in_review(desk: MainWindow) -> None:
    desk.show_review(True)
    review = desk._review
    (path,) = desk.plan.folder.glob("*.mcap")
    review.open_take(path)
    desk.wait(lambda: review.document is not None and review.document.analysis is not None, "the take")
    said = assert_calm_window(desk)
    assert SHOWN in said
    for point in (QPoint(200, 200), QPoint(50, 80)):
        assert not acting(review.viewport.text_at(point) or "")
    dialog = ExportDialog(review.document, review.player, desk.settings, desk)
    assert_calm_window(dialog)
    dialog.close()


def test_boxes_and_tips_take_nothing_for_markup(desk: MainWindow, qtbot) -> None:
    for text in ("<b>x</b>", "&amp;", "<img src=x>"):
        desk.worker.notifications.problem(text, text)
        qtbot.wait(50)
        desk.messages.show_details(desk.worker.notifications.history[-1])
        (box,) = desk.messages.findChildren(QMessageBox)
        box.ensurePolished()
        assert_calm_window(box)
        assert [label for label in box.findChildren(QLabel) if label.text() == text]
        box.close()
        box.setParent(None)
        button = QPushButton("x", desk)
        QToolTip.showText(button.mapToGlobal(QPoint(1, 1)), text, button)
        qtbot.wait(20)
        (tip,) = (one for one in QApplication.topLevelWidgets() if one.inherits("QTipLabel") and one.isVisible())
        assert tip.text() == text
        assert tip.textFormat() == Qt.TextFormat.PlainText
        QToolTip.hideText()
        qtbot.wait(400)


def test_an_ampersand_is_no_key_and_a_star_no_change(qtbot) -> None:
    button = QPushButton(on_button("R&D"))
    qtbot.addWidget(button)
    assert button.shortcut().isEmpty()
    widget = QWidget()
    qtbot.addWidget(widget)
    widget.setWindowTitle(window_title("a[*]b"))
    assert widget.windowTitle() == "a[*][*]b"
    assert not widget.isWindowModified()


def test_a_name_of_a_million_characters_does_not_stop_the_window(desk: MainWindow, qtbot) -> None:
    desk.worker.notifications.problem("x" * 10**6, "y" * 10**6, "z" * 10**6)
    profile = desk.worker.session.profiles[0]
    desk.worker.set_profile(replace(profile, performer="Anna" * 250_000), 0)
    qtbot.wait(300)
    assert_calm_window(desk)
