"""Texts of any length, in the real window and in every dialog: none makes it wider, none is lost."""

from __future__ import annotations

from dataclasses import replace

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QComboBox, QLabel, QWidget

from app.panels.axes import round_step
from app.review.export_dialog import ExportDialog
from app.review.solve_dialog import SolveDialog
from app.settings import Settings
from app.stream_figures import StreamFigures
from app.take_summary import TakeSummary
from app.texts import BREAK, ElidedLabel, WrappedLabel, give_way
from core.markers.layout import load_layout
from core.profile import load_profile
from core.props.prop import Prop
from core.takes.take import Mark
from tests.app.stage import server
from tests.app.takes import write_take
from tests.app.test_window import Desk

WORD = "Bartholomew_Featherstonehaugh_of_the_second_unit_in_the_grand_hall_take_eighty_x"
assert len(WORD) == 80
SMALL = (1366, 768)


def cast(n: int):
    """Performers with long names, on a layout with a long name."""
    worn = replace(load_layout("han19"), name=f"layout_{WORD}")
    return tuple(replace(load_profile("han19"), performer=f"{i}_{WORD}", layout=worn) for i in range(n))


def type_into(desk, field, text: str) -> None:
    """As an operator: select all, type, leave."""
    field.setFocus()
    field.selectAll()
    desk.qtbot.keyClicks(field, text)
    desk.qtbot.keyClick(field, Qt.Key.Key_Tab)


def wide_words(window: QWidget) -> list[str]:
    """Every widget whose least width is that of a text it shows, where the text is a long one."""
    return [
        f"{type(widget).__name__}: {text[:30]}"
        for widget in window.findChildren(QWidget)
        if (text := shown_text(widget)) and WORD in text and widget.minimumSizeHint().width() > 200
    ]


def shown_text(widget: QWidget) -> str:
    if isinstance(widget, QComboBox):
        return widget.currentText()
    return widget.text() if hasattr(widget, "text") and callable(widget.text) else ""


@pytest.fixture
def long_desk(qtbot, tmp_path):
    folder = tmp_path / WORD / WORD
    folder.parent.mkdir()
    desk = Desk(qtbot, folder)
    desk.window.setWindowState(Qt.WindowState.WindowNoState)
    desk.window.resize(*SMALL)
    desk.window.raise_()
    desk.window.activateWindow()
    desk.until(desk.window.isActiveWindow, "the window to be active")
    yield desk
    desk.close()


def test_no_text_widens_the_live_room(long_desk):
    desk, window = long_desk, long_desk.window
    desk.worker.set_profiles(cast(3))
    with server() as simulator:
        stream = desk.add(simulator)
        stream.device_class = type("Long", (stream.device_class,), {"title": f"Device {WORD}"})
        type_into(desk, window.recorder.shot, WORD)
        type_into(desk, window.recorder.performer, WORD)
        lent = Prop(f"prop_{WORD}", load_profile("han19").hand.skeleton.joint_positions_m[1:5])
        desk.worker.set_profile(replace(desk.session.profiles[0], props=(lent,)))
        notes = desk.worker.notifications
        notes.problem(f"The folder {WORD}/{WORD} cannot be written.", f"Choose another than {WORD}.")
        window.recorder.add_mark(Mark(1.0, WORD))
        desk.qtbot.wait(1200)  # the panels refresh ten times a second
        assert WORD in window.deck.take.text() and WORD in window.recorder.name.text()
        assert window.minimumSizeHint().width() <= SMALL[0] and window.minimumSizeHint().height() <= SMALL[1] - 40
        assert (window.width(), window.height()) == SMALL
        assert wide_words(window) == []
        assert window.deck.take.toolTip().startswith(window.deck.take.text()), "the whole name"
        assert window.deck.take.shown.endswith("_001"), "the number is what one looks for"
        assert window.strip.message.text() in window.strip.message.toolTip()
        for number in range(3):
            box = window.tracking.performers.blocks[number].profile
            assert WORD in box.toolTip() and box.width() < 400


def test_how_the_last_take_ended_widens_nothing(long_desk, tmp_path):
    desk, window = long_desk, long_desk.window
    summary = TakeSummary(
        name=f"{WORD}_001", path=tmp_path / "x.mcap", streams={"": StreamFigures(100, 100)}, solved=97,
        unsolved={f"because of {WORD}": 3}, bytes=1000, duration_s=1.0, sealed=True, problem=f"{WORD} {WORD}",
    )  # fmt: skip
    before = window.deck.record.geometry()
    desk.worker.take_finished.emit(summary)
    desk.qtbot.wait(400)
    assert window.minimumSizeHint().width() <= SMALL[0] and wide_words(window) == []
    assert window.deck.record.geometry() == before
    assert f"{summary.name}: {summary.verdict.headline}" in window.deck.frames.toolTip().splitlines()
    assert window.recorder.last.title.toolTip().startswith(f"{WORD}_001")


def test_no_text_widens_review_or_its_dialogs(long_desk, qtbot):
    desk, window = long_desk, long_desk.window
    folder = desk.window.plan.folder
    folder.mkdir(parents=True)
    worn = replace(load_profile("han19"), performer=WORD)
    whole = write_take(folder, WORD, 60, worn=worn, notes=WORD, network_loss=3)
    write_take(folder, f"{WORD}_cut", 40, seal=False)
    window.review_take(whole)
    room = window._review
    desk.until(lambda: room.document is not None and room.document.analysis is not None, "the take")
    room.words.name_mark(0, WORD)
    room.document.solutions.append(replace(room.document.solved, title=WORD))
    room.solutions.show_take(room.document)
    qtbot.wait(300)
    assert window.width() == SMALL[0] and window.minimumSizeHint().width() <= SMALL[0]
    assert wide_words(window) == []
    assert room.inspector.name.toolTip().startswith(WORD)
    for dialog in (
        SolveDialog(cast(3), cast(3), room),
        ExportDialog(room.document, room.player, Settings(None), room),
    ):
        qtbot.addWidget(dialog)
        if isinstance(dialog, ExportDialog):
            file = folder / f"{WORD}.c3d"
            dialog.result.show_result(f"{file} cannot be written.", "problem", [f"{file} has gaps."], [], "", [file])
        dialog.show()
        qtbot.waitExposed(dialog)
        assert dialog.width() <= 640 and wide_words(dialog) == [], dialog


def test_an_elided_text_is_whole_in_its_tooltip_and_only_then(qtbot):
    made = ElidedLabel(WORD)
    qtbot.addWidget(made)
    made.setToolTip("What it is.")
    made.resize(120, 20)
    made.show()
    assert made.text() == WORD and made.shown.endswith("…") and made.toolTip() == f"{WORD}\nWhat it is."
    made.resize(1200, 20)
    assert made.shown == WORD and made.toolTip() == "What it is."
    made.setText("short")
    assert made.toolTip() == "What it is." and made.minimumSizeHint().width() <= 40
    narrow = ElidedLabel("A")
    qtbot.addWidget(narrow)
    assert narrow.minimumSizeHint().width() < 20, "no wider than its text"


def test_long_words_are_broken_and_copied_whole(qtbot):
    path = f"/home/{WORD}/{WORD}.mcap"
    made = WrappedLabel(f"The file {path} is gone.")
    qtbot.addWidget(made)
    assert made.text() == f"The file {path} is gone." and BREAK in QLabel.text(made)
    assert made.minimumSizeHint().width() < 130
    made.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    made.resize(200, 200)
    made.show()
    made.setFocus()
    made.setSelection(0, len(QLabel.text(made)))
    qtbot.keyClick(made, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    assert QGuiApplication.clipboard().text() == f"The file {path} is gone."
    assert WrappedLabel("short words stay as they are").text() == QLabel.text(
        WrappedLabel("short words stay as they are")
    )


def test_lines_kept_free_hold_their_room(qtbot):
    made = WrappedLabel("", lines=2)
    qtbot.addWidget(made)
    empty = made.heightForWidth(200)
    made.setText("one line")
    assert made.heightForWidth(200) == empty
    made.setText("two lines of words that do not fit into one")
    assert made.heightForWidth(200) == empty


def test_a_combo_gives_way(qtbot):
    combo = give_way(QComboBox())
    qtbot.addWidget(combo)
    combo.addItems([WORD, "b"])
    assert combo.minimumSizeHint().width() < 200 and combo.sizeHint().width() < 200


def test_steps_of_an_axis():
    assert [round_step(x) for x in (0.9, 1.0, 1.1, 3.0, 7.0, 20.1)] == [1.0, 1.0, 2.0, 5.0, 10.0, 50.0]
    assert round_step(0.0) == round_step(float("nan")) == 0.0
