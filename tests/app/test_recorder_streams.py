"""The recorder of several streams, fed by hand: where every frame goes, and that no stream costs another its place."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app import recording
from app.recording import DISK_HANGS, QUEUE_FULL, UNWRITABLE, Recorder
from app.take_summary import TakeSummary
from core.frames import MarkerFrame, Standstill, Times, TrackedFrame
from core.level import Level
from core.profile import load_profile
from core.streams import ClockSample, Record, StreamInfo
from core.takes.reader import open_take
from core.takes.safekeeping import Notice
from core.takes.take import DAMAGED, TakeInfo
from core.takes.verify import verify
from devices.common.clock import host_clock
from devices.device import Health
from tests.app.stage import until
from tests.core.takes.frames import GLOVE, OPTICAL, OTHER, plain_bones, plain_frame, plain_solved
from tests.core.takes.several import STREAMS, Written, events, held
from tests.hanging_disk import HangingDisk
from tests.some import some


class Take:
    """A recorder of an optical system that is solved, another one, and a glove."""

    def __init__(
        self, path: Path, streams: tuple[StreamInfo, ...] = STREAMS, solving: str = OPTICAL.key, **options: object
    ) -> None:
        self.notices: list[Notice] = []
        info = TakeInfo(path.stem, rate_hz=OPTICAL.rate_hz)
        self.recorder = Recorder(
            path, info, (load_profile("schroeder6"),), streams, solving, on_notice=self.notices.append,
            **options,  # type: ignore[arg-type]
        )  # fmt: skip
        self.written = Written()
        self.owed = 0

    def put(self, stream: str, record: Record | TrackedFrame) -> None:
        if isinstance(record, TrackedFrame):
            assert self.owed
            self.recorder.solved(record)
            self.owed -= 1
        else:
            owed = self.recorder.raw(stream, record)
            assert owed == (stream == OPTICAL.key and isinstance(record, MarkerFrame))
            self.owed += owed
        self.written.add(stream, record)

    def until_written(self) -> None:
        until(lambda: self.recorder.numbers().queue_depth == 0, "the queue to be written")

    def end(self, meanwhile: dict[str, Health] | None = None) -> TakeSummary:
        summary = self.recorder.stop(meanwhile).result(60)
        for one in some(summary.streams.values()):
            assert one.received == one.written + one.dropped_total
        return summary


@pytest.fixture(autouse=True)
def data_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording, "rescued_folder", lambda: tmp_path / "data")


def said_alike(summary: TakeSummary) -> None:
    """Whoever recorded it says of it what its file says."""
    with open_take(summary.path) as take:
        assert take.sealed and take.complete and take.counts is not None
        assert take.verdict == summary.verdict
        assert list(take.streams) == list(summary.streams)
        for key, one in some(take.streams.items()):
            mine = summary.streams[key]
            assert one.counts is not None and len(one.frames) == mine.written and len(one.clock) == mine.clock
            for name in ("received", "written", "dropped", "lost", "rejected", "late", "repeated", "untimed"):
                assert getattr(one.counts, name) == getattr(mine, name), (key, name)
            assert one.counts.standstills == mine.standstills
            assert take.holes_in(key).from_s.tolist() == mine.holes.from_s.tolist()


def test_every_stream_is_written_as_it_came_and_counted(tmp_path: Path) -> None:
    take = Take(tmp_path / "take.mcap")
    for stream, record in events(120):
        take.put(stream, record)
    take.until_written()
    numbers = take.recorder.numbers({GLOVE.key: Health(lost=7)})
    assert (numbers.solving, numbers.received, numbers.solved) == (OPTICAL.key, 120, 120)
    assert {key: one.received for key, one in numbers.streams.items()} == {
        OPTICAL.key: 120, GLOVE.key: 60, OTHER.key: 40,
    }  # fmt: skip
    assert numbers.streams[GLOVE.key].lost == 7 and numbers.streams[GLOVE.key].clock == 20
    time.sleep(1.1)  # as long as its frames say
    still = Standstill(host_clock(), host_clock() + 1.0, 1.0, 3)
    summary = take.end(
        {
            OPTICAL.key: Health(lost=2, late=1, repeated=4),
            GLOVE.key: Health(lost=9, rejected=5, standstills=(still,)),
            OTHER.key: Health(),
        }
    )
    assert summary.sealed and (summary.received, summary.written, summary.solved) == (120, 120, 120)
    assert (summary.lost, summary.late, summary.repeated, summary.rejected) == (2, 1, 4, 0)
    glove, other = summary.streams[GLOVE.key], summary.streams[OTHER.key]
    assert (glove.written, glove.lost, glove.rejected, glove.unread, glove.clock) == (60, 9, 5, 3, 20)
    assert (other.written, other.lost, other.clock) == (40, 0, 0)
    said_alike(summary)
    with open_take(summary.path) as opened:
        assert held(opened) == take.written.bits
    assert f"{GLOVE.key}: received 60 = written 60 + dropped 0; Phalanx stood still for 1.0 s" in summary.line
    assert f"{OTHER.key}: received 40 = written 40 + dropped 0" in summary.line
    texts = " ".join(summary.verdict.texts)
    assert f"Stream {GLOVE.key}: 5 packets could not be read." in texts and OTHER.key not in texts


def test_of_a_take_of_which_nothing_is_solved_no_pose_is_missing(tmp_path: Path) -> None:
    take = Take(tmp_path / "take.mcap", (GLOVE,), "")
    began_s = host_clock()
    for i in range(60):
        record = replace(plain_bones(i), times=Times(i / 60, began_s + i / 60, began_s + i / 60))
        assert not take.recorder.raw(GLOVE.key, record)
    time.sleep(0.1)
    take.until_written()
    mark = take.recorder.mark("here")
    numbers = take.recorder.numbers()
    assert numbers.solving is None and numbers.received == numbers.written == 60
    summary = take.end()
    assert summary.solving is None and summary.received == 60 and not summary.unsolved and summary.marks == 1
    said_alike(summary)
    with open_take(summary.path) as opened:
        assert opened.marks == (mark,) and 0.1 <= mark.time_s < 60.0


def test_what_the_take_has_no_place_for_is_neither_counted_nor_owed(tmp_path: Path) -> None:
    take = Take(tmp_path / "take.mcap", (OPTICAL,))
    assert take.recorder.raw(OPTICAL.key, plain_frame(0))
    assert not take.recorder.raw(GLOVE.key, plain_bones(0))
    take.recorder.unsolved("not asked for")
    summary = take.end()
    assert list(summary.streams) == [OPTICAL.key] and summary.received == summary.written == 1
    assert not take.recorder.raw(OPTICAL.key, plain_frame(1))


@pytest.fixture
def disk() -> Iterator[HangingDisk]:
    made = HangingDisk(lambda: False)
    yield made
    made.restore()


def test_a_stream_that_is_too_much_for_the_disk_costs_no_other_a_frame(tmp_path: Path, disk: HangingDisk) -> None:
    take = Take(tmp_path / "take.mcap", queue_frames=20)
    disk.hangs = lambda: True
    take.put(GLOVE.key, plain_bones(0))
    until(lambda: take.recorder.numbers().queue_depth == 0, "the disk to hang")
    for i in range(200):
        take.put(OTHER.key, plain_frame(i))
        take.recorder.raw(OTHER.key, ClockSample(0.0, 0.0, 0.0))
    for i in range(1, 15):
        take.put(GLOVE.key, plain_bones(i))
        take.put(OPTICAL.key, plain_frame(i))
        take.put("", plain_solved(i))
    until(lambda: take.recorder.sealing.stalled_s >= 2.0, "the hang to be seen")
    take.put(OTHER.key, plain_frame(200))
    until(lambda: take.notices, "a word")
    take.recorder.give_up()
    given_up = take.recorder.finished.result(0)
    others = {key: one for key, one in given_up.streams.items() if key != OTHER.key}
    assert [one.dropped for one in others.values()] == [{DISK_HANGS: 14}, {DISK_HANGS: 15}]
    for one in some(given_up.streams.values()):
        assert one.received == one.written + one.dropped_total
    disk.answer()
    until(lambda: "finished" in take.notices[-1].what, "the end after all")
    with open_take(given_up.path) as opened:
        counts = opened.counts
        assert opened.sealed and counts is not None and counts.balanced and counts.received == counts.written == 14
        assert len(opened.solved) == 12 and counts.unsolved == {QUEUE_FULL: 2}
        glove, other = counts.others[GLOVE.key], counts.others[OTHER.key]
        assert glove.received == glove.written == 15 and not glove.dropped
        assert other.written == 20 and sum(other.dropped.values()) == 181 and other.dropped[DISK_HANGS] == 1
        assert len(opened.streams[OTHER.key].clock) == 20


def test_a_frame_that_no_take_can_hold_is_told_and_costs_nothing_else(tmp_path: Path) -> None:
    take = Take(tmp_path / "take.mcap")
    n = 200_000
    huge = replace(
        plain_frame(5), points_m=np.zeros((n, 3)), ids=np.zeros(n, np.int64), residuals_m=np.zeros(n)
    )  # fmt: skip
    for i in range(10):
        take.put(GLOVE.key, plain_bones(i))
        take.put(OTHER.key, huge)
        take.put(OPTICAL.key, plain_frame(i))
        take.put("", plain_solved(i))
    take.put(OTHER.key, plain_frame(11))
    summary = take.end()
    assert summary.sealed and not summary.problem and summary.written == summary.solved == 10
    assert summary.streams[GLOVE.key].written == 10
    assert summary.streams[OTHER.key].dropped == {UNWRITABLE: 10} and summary.streams[OTHER.key].written == 1
    (notice,) = take.notices
    assert notice.level is Level.PROBLEM and OTHER.key in notice.what and "too large" in notice.what
    assert not summary.verdict.whole and f"{OTHER.key}: 10 dropped" in summary.verdict.headline
    said_alike(summary)


def test_of_a_file_that_is_cut_every_stream_counts_what_it_lost(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    take = Take(path)
    for stream, record in events(60):
        take.put(stream, record)
    take.until_written()
    until(lambda: take.recorder.numbers().written == 60, "the last frame")
    os.truncate(path, 9000)
    summary = take.end()
    assert summary.sealed and summary.path.name == "take_rescued.mcap"
    lost = {key: one.dropped for key, one in summary.streams.items()}
    with open_take(summary.path) as opened:
        left = {key: len(one.frames) for key, one in opened.streams.items()}
    assert lost == {
        OPTICAL.key: {DAMAGED: 60 - left[OPTICAL.key]}, GLOVE.key: {DAMAGED: 30 - left[GLOVE.key]},
        OTHER.key: {DAMAGED: 20 - left[OTHER.key]},
    }  # fmt: skip
    assert not summary.verdict.whole and verify(summary.path).verdict.whole is False


def test_silence_is_said_of_the_stream_that_is_silent(tmp_path: Path) -> None:
    take = Take(tmp_path / "take.mcap", (OPTICAL, GLOVE))
    began_s, n = host_clock(), 0
    while host_clock() - began_s < 1.5:
        now_s = host_clock()
        if take.recorder.raw(OPTICAL.key, replace(plain_frame(n), times=Times(now_s, now_s, now_s))):
            take.recorder.solved(replace(plain_solved(n), times=Times(now_s, now_s, now_s)))
        if not 0.3 < now_s - began_s < 1.2:
            take.recorder.raw(GLOVE.key, replace(plain_bones(n), times=Times(now_s, now_s, now_s)))
        n += 1
        time.sleep(1 / OPTICAL.rate_hz)
        if 0.8 < now_s - began_s < 1.2:
            assert take.recorder.numbers().streams[GLOVE.key].silent_s > 0.4
    numbers = take.recorder.numbers()
    assert numbers.streams[GLOVE.key].holes.seconds > 0.6
    summary = take.end()
    said_alike(summary)
    assert summary.streams[GLOVE.key].holes.longest_s > 0.6
    assert f"{GLOVE.key}: " in summary.verdict.headline and "without frames" in summary.verdict.headline


@pytest.mark.parametrize("comes", [True, False])
def test_marks_count_from_the_first_frame_that_is_solved_or_else_from_the_first_of_all(
    tmp_path: Path, comes: bool
) -> None:
    """One is set while only the glove sends."""
    take, began_s = Take(tmp_path / "take.mcap", (OPTICAL, GLOVE)), host_clock()
    take.recorder.raw(GLOVE.key, replace(plain_bones(0), times=Times(0.0, began_s, began_s)))
    time.sleep(0.3)
    assert take.recorder.mark("early").time_s >= 0.2
    now_s = host_clock()
    if comes and take.recorder.raw(OPTICAL.key, replace(plain_frame(0), times=Times(0.0, now_s, now_s))):
        take.recorder.unsolved("not asked for")
    take.until_written()
    time.sleep(0.2)
    take.recorder.mark("late")
    summary = take.end()
    assert summary.marks == 2
    with open_take(summary.path) as opened:
        early, late = opened.marks
        assert (early.text, late.text) == ("early", "late")
        assert early.time_s == 0.0 if comes else 0.3 <= early.time_s < 60.0
        assert 0.2 <= late.time_s - (0.0 if comes else 0.3) < 60.0
