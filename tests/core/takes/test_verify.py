from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.errors import PhalanxError
from core.frames import MarkerFrame, Standstill, Times
from core.profile import load_profile
from core.takes import records
from core.takes.reader import open_take
from core.takes.recover import recover
from core.takes.take import TakeCounts, TakeInfo
from core.takes.verify import Finding, verify
from core.takes.writer import TakeWriter
from tests.core.takes.frames import bits, plain_frame, plain_solved


def write(
    path: Path, counts: TakeCounts | None, n: int = 60, change: Callable[[int, MarkerFrame], MarkerFrame] | None = None
) -> Path:
    writer = TakeWriter(path, TakeInfo(path.stem, rate_hz=120), load_profile("han19"))
    for i in range(n):
        frame = plain_frame(i)
        writer.raw("", change(i, frame) if change else frame)
        writer.solved(plain_solved(i))
    if counts:
        writer.seal(counts)
    else:
        writer.close()
    return path


def test_nothing_is_found_in_a_good_take(tmp_path: Path) -> None:
    shares: list[float] = []
    report = verify(write(tmp_path / "take.mcap", TakeCounts(60, 60, solved=60)), shares.append)
    assert report.findings == () and report.ok and report.sealed
    assert (report.raw, report.solved, report.marks) == (60, 60, 0)
    assert shares == sorted(shares) and shares[-1] == 1.0


@pytest.mark.parametrize(
    ("counts", "level", "words"),
    [
        (None, "warning", "the file was shortened since"),
        (TakeCounts(61, 60, solved=60), "problem", "do not balance: received 61, written 60, dropped 0"),
        (TakeCounts(61, 61, solved=60), "problem", "should hold 61 raw frames and holds 60"),
        (TakeCounts(60, 60, solved=59), "problem", "should hold 59 solved frames and holds 60"),
        (TakeCounts(63, 60, {"queue full": 3}, solved=60), "warning", "3 frames were dropped while recording: 3 queue"),
        (TakeCounts(60, 60, lost=2, solved=60), "warning", "2 frames of the device never arrived"),
        (TakeCounts(60, 60, rejected=1, solved=60), "warning", "1 packet could not be read"),
        (
            TakeCounts(60, 60, lost=9, solved=60, standstills=(Standstill(0.1, 2.1, 2.0, 9),)),
            "warning",
            "Phalanx stood still for 2.0 s (the computer slept, or the program was halted): 9 frames of that time are",
        ),
    ],
)
def test_counts(tmp_path: Path, counts: TakeCounts | None, level: str, words: str) -> None:
    report = verify(write(tmp_path / "take.mcap", counts))
    finding = report.findings[0]
    assert finding.level == level and words in finding.text
    assert {one.level for one in report.findings} == {level}
    assert report.ok == (level != "problem")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda i, f: replace(f, sequence=i + 7 * (i >= 30)), "numbers skip 7 frames; lost and dropped account for 0"),
        (lambda i, f: replace(f, sequence=i % 30), "counted its frames anew, or the same again, 1 time."),
        (lambda i, f: replace(f, times=Times(0, float("nan"), 1)) if i in (5, 9) else f, "2 raw frames have a time"),
        (lambda i, f: replace(f, times=Times(0, 0, 1)) if i == 5 else f, "does not advance at 1 raw frame."),
        (
            lambda i, f: replace(f, times=Times(0, i / 120 - max(i - 30, 0) / 240, 1)),
            "as 120 Hz and is 160 Hz by its times",
        ),
        (lambda i, f: replace(f, points_m=f.points_m + [[2e7], [0], [0], [np.nan], [0]]), "123 gaps (3 at 0 0 0, 60"),
    ],
)
def test_what_the_device_did(tmp_path: Path, change: Callable[[int, MarkerFrame], MarkerFrame], words: str) -> None:
    report = verify(write(tmp_path / "take.mcap", TakeCounts(60, 60, solved=60), change=change))
    assert report.ok
    assert words in " ".join(finding.text for finding in report.findings if finding.level == "warning")


def test_a_swapped_index_is_found(tmp_path: Path) -> None:
    """An index that leads to the wrong records, under checksums that are right: made by a faulty program."""
    path = write(tmp_path / "take.mcap", TakeCounts(60, 60, solved=60))
    data = bytearray(path.read_bytes())
    index_head = struct.pack("<BQHI", 7, 6 + 16 * 60, 1, 16 * 60)
    at = data.index(index_head) + len(index_head)
    entry = struct.unpack_from("<Q", data, at + 8)[0]
    struct.pack_into("<Q", data, at + 8, entry + 1)
    path.write_bytes(data)
    assert not verify(path).ok  # as the file stands, by its checksum
    (summary_start,) = struct.unpack_from("<Q", data, len(data) - 8 - 20)
    struct.pack_into("<I", data, summary_start - 4, zlib.crc32(data[: summary_start - 13]))
    path.write_bytes(data)
    report = verify(path)
    assert Finding("problem", "The index of /raw does not agree with its records.") in report.findings
    with open_take(path) as take, pytest.raises(Exception, match="damaged"):
        take.raw[0]


def test_a_recovered_take_says_what_it_lacks(tmp_path: Path) -> None:
    path = write(tmp_path / "take.mcap", None)
    data = bytearray(path.read_bytes())
    at = data.index(np.full(15, 30.0).tobytes())
    data[at] ^= 1
    path.write_bytes(data)
    broken = verify(path)
    assert not broken.ok and "damaged" in broken.findings[0].text
    result = recover(path)
    assert (result.recovered, result.lost, result.recovered_solved, result.lost_solved) == (59, 1, 60, 0)
    assert result.path is not None and not result.complete and not result.verdict.whole
    assert "59 raw and 60 solved frames recovered, 1 raw and 0 solved frames lost" in str(result)
    report = verify(result.path)
    assert report.ok and report.counts == TakeCounts(60, 59, {"damaged file": 1}, 0, 0, 60)
    (said,) = (finding.text for finding in report.findings if "1 " in finding.text)  # once
    assert said == "1 frame was lost from the file: it was damaged."
    again = recover(path)
    assert again.path is not None and again.path.name == "take_recovered2.mcap"


def test_where_the_system_has_no_pread(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(records, "HAS_PREAD", False)
    path = write(tmp_path / "take.mcap", TakeCounts(60, 60, solved=60))
    with open_take(path) as take:
        assert bits(tuple(take.raw)) == bits(tuple(plain_frame(i) for i in range(60)))
    assert verify(path).findings == ()
    (tmp_path / "empty.mcap").touch()
    with pytest.raises(Exception, match="empty"):
        open_take(tmp_path / "empty.mcap")


def test_a_list_of_takes_need_not_read_them_through(tmp_path: Path) -> None:
    path = write(tmp_path / "take.mcap", TakeCounts(60, 60, solved=60))
    data = bytearray(path.read_bytes())
    at = data.index(struct.pack("<BQHI", 7, 6 + 16 * 60, 1, 16 * 60)) - 300  # in the chunk, towards its end
    data[at : at + 8] = bytes(byte ^ 0xFF for byte in data[at : at + 8])
    with open_take(path, check=False) as take:
        assert take.sealed and take.complete and take.counts == TakeCounts(60, 60, solved=60)
        assert bits(tuple(take.raw)) == bits(tuple(plain_frame(i) for i in range(60)))
    path.write_bytes(data)
    with open_take(path, check=False) as take, pytest.raises(PhalanxError, match="damaged"):
        list(take.raw)
        list(take.solved)
    with open_take(path) as take:
        assert not take.complete
