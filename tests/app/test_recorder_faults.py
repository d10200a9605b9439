"""The recorder when its disk hangs, is full, fails at the start, or its file is taken away: what it says is so."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from app import recording
from app.recording import DISK_HANGS, Recorder
from app.take_summary import TakeSummary
from core.errors import PhalanxError, TakeError
from core.level import Level
from core.profile import load_profile
from core.takes.reader import open_take
from core.takes.safekeeping import Notice
from core.takes.take import DAMAGED, TakeInfo
from tests.app.stage import until
from tests.core.takes.frames import plain_frame, plain_solved
from tests.hanging_disk import HangingDisk

RATE_HZ = 120.0


class Take:
    """A recorder fed by hand."""

    def __init__(self, path: Path, **options: object) -> None:
        self.notices: list[Notice] = []
        self.faults: list[PhalanxError] = []
        self.recorder = Recorder(
            path, TakeInfo(path.stem, rate_hz=RATE_HZ), (load_profile("han19"),),
            on_fault=self.fault, on_notice=self.notices.append, **options,  # type: ignore[arg-type]
        )  # fmt: skip
        self.n = 0

    def fault(self, error: PhalanxError) -> None:
        self.faults.append(error)
        self.recorder.stop()

    def feed(self, frames: int) -> None:
        for _ in range(frames):
            if self.recorder.raw("", plain_frame(self.n)):
                self.recorder.solved(plain_solved(self.n))
            self.n += 1

    def feed_until(self, condition, what: str) -> None:
        """Frames at the device's rate, meanwhile."""

        def fed() -> bool:
            self.feed(1)
            return bool(condition())

        until(fed, what, poll=lambda _: time.sleep(1 / RATE_HZ))

    def written(self, frames: int) -> None:
        self.feed(frames)
        until(lambda: self.recorder.numbers().solved >= self.n, "the frames to be written")

    def end(self) -> TakeSummary:
        summary = self.recorder.stop().result(60)
        balanced(summary)
        return summary


def balanced(summary: TakeSummary) -> None:
    assert summary.received == summary.written + sum(summary.dropped.values())
    assert summary.received == summary.solved + sum(summary.unsolved.values())


def kept(summary: TakeSummary) -> None:
    """Every frame that came is in the take, and it is sealed."""
    assert summary.sealed and not summary.dropped and summary.received == summary.written > 0


@pytest.fixture(autouse=True)
def data_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(recording, "rescued_folder", lambda: tmp_path / "data")
    return tmp_path / "data"


# The file is taken away.


@pytest.mark.skipif(sys.platform == "win32", reason="Windows itself keeps an open file where it is")
def test_a_deleted_file_is_noticed_within_a_second_and_nothing_is_lost(tmp_path: Path) -> None:
    path = tmp_path / "takes" / "a.mcap"
    take = Take(path)
    take.written(60)
    path.unlink()
    begun = time.monotonic()
    take.feed_until(lambda: take.notices, "a word")
    assert time.monotonic() - begun < 3.0  # 1 s, on a machine that is busy
    assert take.notices[0].level is Level.PROBLEM and "was deleted" in take.notices[0].what
    take.feed_until(lambda: len(take.notices) == 2, "the rescue")
    rescued = path.with_name("a_rescued.mcap")
    numbers = take.recorder.numbers()
    assert numbers.path == rescued and "rescued" in numbers.trouble and numbers.level is Level.WARNING
    take.feed(60)
    summary = take.end()
    kept(summary)
    assert summary.path == rescued and summary.received == take.n
    verdict = summary.verdict  # red where this machine was held up, and the frames came with a hole between
    assert verdict.level is not Level.GOOD and str(rescued) in " ".join(verdict.texts)
    with open_take(rescued) as opened:
        assert opened.sealed and opened.complete and len(opened.raw) == len(opened.solved) == take.n
    assert not path.exists()


def test_of_a_file_that_is_cut_all_is_kept_that_came_after_it(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    take = Take(path)
    take.written(60)
    os.truncate(path, 4096)
    take.feed_until(lambda: len(take.notices) == 2, "the rescue")
    numbers = take.recorder.numbers()
    assert numbers.path.name == "a_rescued.mcap" and numbers.level is Level.PROBLEM
    assert "frames may be lost" in numbers.trouble
    take.feed(60)
    summary = take.end()
    assert summary.sealed and summary.dropped == {DAMAGED: 60} and summary.written == take.n - 60
    assert summary.verdict.level is Level.PROBLEM and summary.verdict.readable and not summary.verdict.whole
    with open_take(summary.path) as opened:
        assert opened.sealed and opened.complete and opened.counts is not None and opened.counts.balanced
        assert [frame.sequence for frame in opened.raw] == list(range(60, take.n))


def test_of_a_file_that_is_cut_at_its_end_nothing_is_left_and_the_hints_say_so(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    take = Take(path)
    take.written(60)
    os.truncate(path, 4096)
    summary = take.end()
    assert summary.dropped == {DAMAGED: 60} and not summary.written and not summary.verdict.readable
    texts = " ".join(summary.verdict.texts)
    assert "None of the 60 frames that came is in it. Record it again." in texts
    assert "room" not in texts and "Check in Devices" not in texts


def test_of_a_file_that_is_cut_while_it_is_sealed_what_is_left_is_sealed(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    take = Take(path)
    take.written(600)
    cut: list[float] = []

    def sealed_part(share: float) -> None:
        if not cut and share > 0.35:  # the copy is begun
            cut.append(share)
            os.truncate(path, 80_000)

    take.recorder._sealed_part = sealed_part  # type: ignore[method-assign]
    summary = take.end()
    assert cut and summary.sealed and 0 < summary.written < 600
    with open_take(summary.path) as opened:
        assert opened.sealed and opened.complete and len(opened.raw) == summary.written
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.mcap", "a_rescued.mcap"]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows itself keeps an open file where it is")
def test_a_stranger_is_never_sealed(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    take = Take(path)
    take.written(30)
    stranger = tmp_path / "b.mcap"
    other = Take(stranger)
    other.written(5)
    other.end()
    before = stranger.read_bytes()
    stranger.replace(path)
    summary = take.end()
    assert path.read_bytes() == before
    kept(summary)
    assert summary.path == tmp_path / "a_rescued.mcap"
    with open_take(summary.path) as opened:
        assert opened.sealed and len(opened.raw) == 30


@pytest.mark.skipif(sys.platform == "win32", reason="Windows itself keeps an open file where it is")
def test_what_could_not_be_rescued_is_called_lost(tmp_path: Path, data_folder: Path) -> None:
    data_folder.write_bytes(b"in the way")
    folder = tmp_path / "takes"
    take = Take(folder / "a.mcap")
    take.written(30)
    (folder / "a.mcap").unlink()
    folder.rmdir()
    take.feed_until(lambda: len(take.notices) == 2, "words")
    assert take.recorder.numbers().level is Level.PROBLEM
    summary = take.end()
    assert summary.written == summary.solved == 0 and sum(summary.dropped.values()) == summary.received == take.n
    verdict = summary.verdict
    assert verdict.level is Level.PROBLEM and not summary.sealed
    assert "are lost" in " ".join(verdict.texts) and "Every frame" not in " ".join(verdict.texts)


# The disk hangs.


@pytest.fixture
def disk() -> Iterator[HangingDisk]:
    made = HangingDisk(lambda: False)
    yield made
    made.restore()


def hang(disk: HangingDisk) -> None:
    disk.hangs = lambda: True


def test_a_disk_that_hangs_is_said_and_what_waited_is_written_when_it_answers(
    tmp_path: Path, disk: HangingDisk
) -> None:
    take = Take(tmp_path / "a.mcap")
    take.written(10)
    assert take.recorder.numbers().stalled_s == 0.0 and take.recorder.numbers().level is Level.GOOD
    hang(disk)
    take.feed_until(lambda: take.notices, "a word")
    numbers = take.recorder.numbers()
    assert numbers.stalled_s >= 2.0 and "has not answered" in numbers.trouble and numbers.level is Level.PROBLEM
    assert take.notices[0].level is Level.PROBLEM and str(tmp_path) in take.notices[0].what
    disk.answer()
    until(lambda: take.recorder.numbers().written == take.n, "what waited")
    assert take.notices[1:] and "answers again" in take.notices[1].what and len(take.notices) == 2
    assert take.recorder.numbers().trouble == ""
    kept(take.end())


def test_what_does_not_fit_into_memory_meanwhile_is_counted(tmp_path: Path, disk: HangingDisk) -> None:
    take = Take(tmp_path / "a.mcap", queue_frames=20)
    take.feed_until(lambda: take.recorder.numbers().written >= 5, "some frames")
    hang(disk)
    take.feed_until(lambda: take.notices, "a word")
    take.feed(50)
    disk.answer()
    until(lambda: len(take.notices) == 2, "the end of it")
    assert "lost meanwhile" in take.notices[1].what and take.notices[1].level is Level.WARNING
    summary = take.end()
    assert summary.dropped[DISK_HANGS] > 0
    with open_take(summary.path) as opened:
        assert len(opened.raw) == summary.written


def test_stopping_can_be_given_up_and_says_what_is_on_disk(tmp_path: Path, disk: HangingDisk) -> None:
    path = tmp_path / "a.mcap"
    take = Take(path)
    take.written(40)
    hang(disk)
    take.feed(20)
    finished = take.recorder.stop()
    until(lambda: take.recorder.sealing.stalled_s >= 2.0, "the hang to be seen")
    assert not finished.done()
    take.recorder.give_up()
    summary = finished.result(0)
    balanced(summary)
    assert summary.written == 40 and summary.dropped == {DISK_HANGS: 20} and not summary.sealed
    text = " ".join(summary.verdict.texts)
    assert "40 frames are in" in text and "the last 20 are not" in text and summary.verdict.level is Level.PROBLEM
    with open_take(path) as opened:
        assert len(opened.raw) == 40
    take.recorder.give_up()  # once is enough
    disk.answer()
    until(lambda: take.notices, "the end after all")
    assert "finished" in take.notices[-1].what
    with open_take(path) as opened:
        assert opened.sealed and opened.complete and len(opened.raw) == 60


# The start fails.


@pytest.mark.parametrize("size", [0, 50, 400, 2000])
def test_no_room_at_the_start_leaves_no_file(tmp_path: Path, size: int) -> None:
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        with pytest.raises(TakeError):
            Take(tmp_path / "a.mcap")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert os.listdir(tmp_path) == []  # noqa: PTH208
    Take(tmp_path / "a.mcap").end()


def test_an_error_that_nobody_thought_of_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("core.takes.writer.begin", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        Take(tmp_path / "a.mcap")
    assert os.listdir(tmp_path) == []  # noqa: PTH208


def test_no_thread_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_thread(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", no_thread)
    with pytest.raises(TakeError, match="start new thread"):
        Take(tmp_path / "a.mcap")
    assert os.listdir(tmp_path) == []  # noqa: PTH208


def test_a_disk_that_takes_no_frame_leaves_no_empty_take(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    path = tmp_path / "a.mcap"
    take = Take(path)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 10, hard))
    try:
        take.feed(5)
        until(lambda: take.recorder.finished.done(), "the end")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    summary = take.end()
    assert summary.written == 0 and summary.problem and not summary.sealed
    # It ends by itself, perhaps before the last came.
    assert 1 <= summary.received == sum(summary.dropped.values()) <= 5
    assert not path.exists() and "no file is left" in " ".join(summary.verdict.texts)


def test_a_take_that_never_began_leaves_no_file_and_one_with_frames_does(tmp_path: Path) -> None:
    take = Take(tmp_path / "a.mcap")
    assert not take.recorder.discard().result(60).sealed
    assert os.listdir(tmp_path) == []  # noqa: PTH208
    take = Take(tmp_path / "a.mcap")
    take.written(3)
    summary = take.recorder.discard().result(60)
    assert summary.sealed and summary.path.exists()
