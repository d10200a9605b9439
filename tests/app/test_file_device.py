"""A file that is played: what its reader found amiss is among the messages."""

from __future__ import annotations

from pathlib import Path

from app.file_device import FileDevice
from app.notifications import NotificationCentre, Severity
from app.session import Session
from core.profile import load_profile
from tests.app.stage import own_threads, until
from tests.app.takes import write_take
from tests.app.test_window import Desk


def test_warnings_of_the_reader_are_messages_once(tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    rows = [
        f"{i},{i / 100},{k},0.{k + 1},0.2,{'2e4' if (i, k) == (2, 1) else '0.3'}" for i in range(9) for k in range(3)
    ]
    path.write_text("\n".join(["frame,time_s,id,x_m,y_m,z_m", *rows]) + "\n")
    centre = NotificationCentre()
    session = Session(load_profile("han19"), notifications=centre)
    try:
        stream = session.add_device(FileDevice, {"file": str(path)})
        assert stream.device.warnings == ()
        session.connect(stream)
        stream.wait_connected(30)
        until(lambda: stream.finished, "the end of the file")
        (note,) = [note for note in centre.history if note.severity is Severity.WARNING]
        assert note.text == (
            "walk.csv: 1 point lies beyond 1000 m and is left out as a gap, in frame 3: point 2 at z = 20000 m."
        )
        assert note.count == 1 and "walk.csv" in note.source
    finally:
        session.close()
    assert own_threads() == []


def test_the_end_of_a_file_is_no_missing_device(qtbot, tmp_path: Path) -> None:
    path = write_take(tmp_path, "short", 300)
    desk = Desk(qtbot, tmp_path / "takes")
    try:
        window = desk.window
        stream = desk.worker.add_device(FileDevice, {"file": str(path)})
        desk.until(lambda: desk.session.ready, "the solver")
        desk.worker.connect_device(stream)
        desk.until(window.record_action.isEnabled, "the record button")
        window.record_action.trigger()
        desk.until(lambda: stream.finished, "the end of the file")
        desk.until(lambda: "played to its end" in window.viewport.message, "the words")
        assert "Stop ends the take" in window.viewport.message and desk.session.recording
        window.record_action.trigger()
        desk.until(lambda: desk.finished, "the take")
        desk.until(lambda: "Connect plays it again" in window.viewport.message, "the words after it")
        assert window.deck.device.text() == f"{stream.title}: played to its end"
    finally:
        desk.close()
