"""Recording under bad conditions: names that are taken, disks that are full, sealing that is interrupted."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from core.errors import TakeError
from core.profile import load_profile
from core.takes import seal
from core.takes.reader import open_take
from core.takes.recover import recover
from core.takes.seal import seal_take, update_info
from core.takes.take import Mark, TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.core.takes.frames import bits, plain_frame, plain_solved

PROFILE = load_profile("han19")


def begin(path: Path, n: int = 50) -> TakeWriter:
    writer = TakeWriter(path, TakeInfo(path.stem, rate_hz=120), PROFILE)
    for i in range(n):
        writer.raw("", plain_frame(i))
        writer.solved(plain_solved(i))
    writer.mark(Mark(0.1, "clap"))
    return writer


def holds(path: Path, n: int = 50) -> None:
    with open_take(path) as take:
        assert bits(tuple(take.raw)) == bits(tuple(plain_frame(i) for i in range(n)))
        assert bits(tuple(take.solved)) == bits(tuple(plain_solved(i) for i in range(n)))


@pytest.mark.parametrize("content", [b"", b"somebody's"])
def test_never_overwrites(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "take.mcap"
    path.write_bytes(content)
    with pytest.raises(TakeError, match="exists already"):
        TakeWriter(path, TakeInfo("take"), PROFILE)
    assert path.read_bytes() == content


def test_places_where_no_take_can_be(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for path in (tmp_path / "take.txt", tmp_path / "file" / "take.mcap", tmp_path / ("x" * 300 + ".mcap")):
        with pytest.raises(TakeError) as caught:
            TakeWriter(path, TakeInfo("take"), PROFILE)
        assert path.name[:40] in str(caught.value) and caught.value.action
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_frame_too_large_is_refused_and_the_next_one_is_not(tmp_path: Path) -> None:
    writer = begin(tmp_path / "take.mcap", 3)
    with pytest.raises(TakeError, match="too large"):
        writer.raw("", plain_frame(3, n=200_000))
    writer.raw("", plain_frame(3))
    writer.solved(plain_solved(3))
    writer.seal(TakeCounts(5, 4, {"too large": 1}, solved=4))
    holds(writer.path, 4)
    assert verify(writer.path).ok


def test_a_closed_take_takes_no_more(tmp_path: Path) -> None:
    writer = begin(tmp_path / "take.mcap")
    writer.close()
    with pytest.raises(TakeError, match="not being recorded"):
        writer.raw("", plain_frame(50))
    assert writer.acknowledged == 50
    holds(writer.path)


@contextlib.contextmanager
def file_size_limit(size: int) -> Iterator[None]:
    """No file of this process may grow beyond a size, as on a full disk."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_what_is_written_before_the_disk_is_full_stays_readable(tmp_path: Path) -> None:
    writer = begin(tmp_path / "take.mcap", 0)
    size = writer.bytes_written
    refused = 0
    with file_size_limit(size + 3001):
        for i in range(40):
            try:
                writer.raw("", plain_frame(i))
            except TakeError as error:
                refused += 1
                assert str(writer.path) in error.what and "space" in error.action
    written = writer.acknowledged
    assert 0 < written < 40 and written + refused == 40
    assert writer.bytes_written == writer.path.stat().st_size <= size + 3001
    with open_take(writer.path) as take:  # still recording
        assert take.complete and len(take.raw) == written
    writer.raw("", plain_frame(40))  # there is room again
    with file_size_limit(1000), pytest.raises(TakeError, match=r"sealed copy .* cannot be written"):
        writer.seal(TakeCounts(41, written + 1, {"disk full": refused}))
    with open_take(writer.path) as take:
        assert not take.sealed and take.complete and len(take.raw) == written + 1
    writer.seal(TakeCounts(41, written + 1, {"disk full": refused}))
    with open_take(writer.path) as take:
        assert take.sealed and take.complete
        assert [frame.sequence for frame in take.raw] == [*range(written), 40]
    assert verify(writer.path).ok
    assert [path.name for path in tmp_path.iterdir()] == ["take.mcap"]


def test_no_room_for_the_first_byte_leaves_no_file(tmp_path: Path) -> None:
    with file_size_limit(100), pytest.raises(TakeError, match="cannot be written"):
        TakeWriter(tmp_path / "take.mcap", TakeInfo("take"), PROFILE)
    assert list(tmp_path.iterdir()) == []


def test_a_real_disk_that_is_full(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = (
        subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disk)], capture_output=True, check=False
        )
        if sys.platform == "linux"
        else None
    )
    if mounted is None or mounted.returncode:
        pytest.skip("needs the right to mount a small disk")
    try:
        writer = begin(disk / "take.mcap", 0)
        with pytest.raises(TakeError, match="No space left on device"):
            for i in range(5000):
                writer.raw("", plain_frame(i))
        n = writer.acknowledged
        with pytest.raises(TakeError, match="No space left on device"):
            writer.seal(TakeCounts(n + 1, n, {"disk full": 1}))
        writer.close()
        with open_take(writer.path) as take:
            assert take.complete and len(take.raw) == n > 100
        assert os.listdir(disk) == ["take.mcap"]  # noqa: PTH208
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_cancelled_at_any_moment_sealing_changes_nothing_and_can_be_repeated(tmp_path: Path) -> None:
    writer = begin(tmp_path / "take.mcap", 2000)
    writer.close()
    before = writer.path.read_bytes()
    counts = TakeCounts(2000, 2000, solved=2000)

    class CancelledError(Exception):
        pass

    calls: list[float] = []
    seal_take(tmp_path / "take.mcap", counts, calls.append)
    assert calls == sorted(calls) and calls[-1] == 1.0 and calls[0] >= 0
    assert len(calls) > 20
    for stop in range(0, len(calls), 5):
        writer.path.write_bytes(before)
        left = [stop]

        def progress(share: float, left: list[int] = left) -> None:
            if not left[0]:
                raise CancelledError
            left[0] -= 1

        with pytest.raises(CancelledError):
            seal_take(writer.path, counts, progress)
        if stop < len(calls) - 1:
            assert writer.path.read_bytes() == before
        assert [path.name for path in tmp_path.iterdir()] == ["take.mcap"]
    for _ in range(2):
        seal_take(writer.path, counts)
        holds(writer.path, 2000)


def test_a_copy_that_does_not_read_back_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = begin(tmp_path / "take.mcap")
    before = writer.path.read_bytes()
    monkeypatch.setattr(seal, "_digest_of", lambda target, progress: 1)
    with pytest.raises(TakeError, match="did not read back"):
        writer.seal(TakeCounts(50, 50, solved=50))
    assert writer.path.read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.skipif(sys.platform == "win32", reason="Windows itself keeps an open file")
def test_nobody_seals_or_recovers_a_take_that_is_being_recorded(tmp_path: Path) -> None:
    writer = begin(tmp_path / "take.mcap")
    for act in (seal_take, recover, lambda path: update_info(path, TakeInfo("other"))):
        with pytest.raises(TakeError, match="being recorded"):
            act(writer.path)
    writer.raw("", plain_frame(50))
    with open_take(writer.path) as take:
        assert len(take.raw) == 51
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("sealed", [False, True])
def test_notes_rating_and_marks_change_and_nothing_else(tmp_path: Path, sealed: bool) -> None:
    writer = begin(tmp_path / "take.mcap")
    counts = TakeCounts(53, 50, {"queue full": 3}, 1, 2, 50)
    if sealed:
        writer.seal(counts)
    else:
        writer.close()
    with open_take(writer.path) as take:
        old, libraries = take.info, take.libraries
    new = TakeInfo(old.name, "Bea", old.created_utc, old.rate_hz, old.device, "good one", "A")
    update_info(writer.path, new)
    with open_take(writer.path) as take:
        assert take.info == new and take.marks == (Mark(0.1, "clap"),) and take.libraries == libraries
        assert take.counts == (counts if sealed else TakeCounts(50, 50, solved=50))
    update_info(writer.path, new, [Mark(0.2, "b"), Mark(0.1, "a"), Mark(0.3, "c")])
    with open_take(writer.path) as take:
        assert [mark.text for mark in take.marks] == ["b", "a", "c"]
        assert take.profile.to_json() == PROFILE.to_json()
    update_info(writer.path, new, [])
    assert open_take(writer.path).marks == ()
    holds(writer.path)
    assert verify(writer.path).ok


def test_no_room_to_recover_leaves_nothing_behind(tmp_path: Path) -> None:
    begin(tmp_path / "take.mcap").close()
    with file_size_limit(1000), pytest.raises(TakeError, match="cannot be written"):
        recover(tmp_path / "take.mcap")
    assert [path.name for path in tmp_path.iterdir()] == ["take.mcap"]
    result = recover(tmp_path / "take.mcap")
    assert result.path is not None and result.complete and result.verdict.whole
    holds(result.path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["take.mcap", "take_recovered.mcap"]


def test_notes_written_while_recording_count_from_the_last_on(tmp_path: Path) -> None:
    writer = begin(tmp_path / "take.mcap", 20)
    for n, notes in ((35, "slow"), (50, "slow thumb, ↯")):
        writer.set_info(replace(writer.info, notes=notes))
        for i in range(n - 15, n):
            writer.raw("", plain_frame(i))
            writer.solved(plain_solved(i))
        with open_take(writer.path) as take:  # as if this process had been killed now
            assert take.info == writer.info and take.info.notes == notes and take.complete
    writer.close()
    (tmp_path / "killed.mcap").write_bytes(writer.path.read_bytes()[:-3])
    rescued = recover(tmp_path / "killed.mcap").path
    seal_take(writer.path)
    for path in (writer.path, rescued):
        assert path is not None and verify(path).ok
        with open_take(path) as take:
            assert take.info == writer.info and take.sealed
    holds(writer.path)


def test_notes_that_found_no_room_are_in_the_sealed_take(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = begin(tmp_path / "take.mcap")
    with monkeypatch.context() as disk:
        disk.setattr(writer._file, "write", full)
        with pytest.raises(TakeError):
            writer.set_info(replace(writer.info, notes="late"))
    writer.seal(TakeCounts(50, 50, solved=50))
    with open_take(writer.path) as take:
        assert take.info.notes == "late"
    holds(writer.path)


def full(data: bytes) -> None:
    raise TakeError("The disk is full.", "Free some space.")
