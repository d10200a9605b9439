"""Takes of several streams under review: which there are, what is in each, and which was solved."""

from __future__ import annotations

import pytest

from app.review.take_row import read_row
from app.review.take_streams import stream_rows
from core.level import Level
from core.takes.reader import open_take
from core.takes.take import StreamCounts, TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.app.hand_frames import profile
from tests.app.stage import own_threads
from tests.app.takes import write_take
from tests.app.test_review import a_room
from tests.core.takes.frames import GLOVE, OPTICAL, OTHER, plain_bones
from tests.core.takes.several import record


@pytest.fixture
def room(tmp_path, qtbot):
    record(tmp_path / "several.mcap", 120, sealed=True)
    write_take(tmp_path, "one", 30)
    write_glove(tmp_path / "glove.mcap")
    with a_room(tmp_path, qtbot) as made:
        yield made
    assert own_threads() == []


def write_glove(path) -> None:
    """Twenty frames at 100 Hz of which the recorder counts three more that never arrived."""
    writer = TakeWriter(path, TakeInfo(path.stem), profile(), (GLOVE,), "")
    for i in range(20):
        writer.raw(GLOVE.key, plain_bones(i, 3))
    writer.seal(TakeCounts(0, 0, others={GLOVE.key: StreamCounts(20, 20, lost=3)}))


def shown(room, name: str):
    room.open_take(room.browser.folder / f"{name}.mcap")
    room.wait(lambda: room.document is not None and room.document.path.stem == name, f"{name} to open")
    return room.inspector


def test_each_stream_has_a_line_with_its_frames_and_what_it_lacks(room):
    inspector = shown(room, "several")
    solved, glove, other = room.document.streams
    assert (solved.name, glove.name, other.name) == (OPTICAL.key, GLOVE.key, OTHER.key)
    assert [one.solved for one in (solved, glove, other)] == [True, False, False]
    assert inspector.streams.isVisible() and inspector.streams.lines[0].startswith(
        f"{OPTICAL.key} solved: Motive 3.1 · 120"
    )
    assert "bones" in glove.tip and "Received 60 = written 60 + dropped 0" in glove.tip
    assert "Device" not in inspector.facts.text()
    room.player.seek_frame(60)
    assert room.player.frame == 60 and not room.viewport.message


def test_a_take_of_one_stream_says_no_more_than_before(room):
    inspector = shown(room, "one")
    assert room.document.streams == () and not inspector.streams.isVisible()
    assert "Device: test" in inspector.facts.text() and "Received 30 =" in inspector.facts.text()


def test_a_take_of_which_nothing_was_solved_says_so_and_what_it_holds(room):
    inspector = shown(room, "glove")
    (glove,) = inspector.streams.lines
    assert glove.startswith(f"{GLOVE.key} recorded: {GLOVE.title} · 20 frames, 3 never arrived")
    assert room.document.streams[0].level is Level.WARNING is inspector.light.level
    assert "none of its streams was solved" in inspector.facts.text()
    assert room.viewport.message.startswith("No stream of this take was solved")
    assert read_row(room.document.path).frames == 20
    with open_take(room.document.path) as take:
        assert stream_rows(take) == room.document.streams
