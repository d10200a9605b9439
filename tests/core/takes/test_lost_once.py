"""Each loss of a take is said once, with its true reason: what came and was lost is no silence of the device."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from core.profile import load_profile
from core.takes.checked import check
from core.takes.reader import open_take
from core.takes.recover import recover
from core.takes.scan import missing_numbers
from core.takes.take import DAMAGED, TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.core.takes.frames import plain_frame, plain_solved
from tests.some import some

N = 400
RATE = 120


def record(writer: TakeWriter, begin: int, end: int) -> None:
    for i in range(begin, end):
        writer.raw("", plain_frame(i))
        writer.solved(plain_solved(i))


def begun(path: Path) -> TakeWriter:
    return TakeWriter(path, TakeInfo("take", rate_hz=RATE), load_profile("han19"), refuge=path.parent)


def said(path: Path) -> tuple[list[str], list[str]]:
    """Every sentence of `verify` and of the verdict."""
    report = verify(path)
    with open_take(path, check=False) as take:
        assert take.verdict.level is report.verdict.level and take.verdict.texts == report.verdict.texts
    return [finding.text for finding in report.findings], list(report.verdict.texts)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_frames_that_were_cut_off_while_recording_are_not_also_a_silence(tmp_path: Path, share: float) -> None:
    path = tmp_path / "take.mcap"
    writer = begun(path)
    record(writer, 0, N // 2)
    os.truncate(path, int(share * path.stat().st_size))
    writer.safety.look()
    record(writer, N // 2, N)
    assert writer.safety.find_out()
    readable = writer.readable()
    lost = N - readable.raw
    assert lost > 10
    first_s = plain_frame(0).times.host_s if share else plain_frame(N // 2).times.host_s
    gone_s = first_s - plain_frame(0).times.host_s
    counts = TakeCounts(
        N, readable.raw, {DAMAGED: lost}, 0, 0, readable.solved, {DAMAGED: N - readable.solved},
        length_s=N / RATE, first_s=gone_s,
    )  # fmt: skip
    writer.seal(counts)
    found, verdict = said(writer.path)
    assert [text for text in found if "frame" in text and str(lost) in text] == [
        f"{lost} frames were lost from the file: it was damaged."
    ]
    assert verdict[0] == f"{lost} frames lost from the file: it was damaged."
    for text in found + verdict:
        assert "without frames" not in text and "recovered" not in text and "no raw frame" not in text, text


def test_a_whole_take_that_is_cut_says_what_cannot_be_read_and_no_silence(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    writer = begun(path)
    record(writer, 0, 4 * N)
    writer.seal(TakeCounts(4 * N, 4 * N, solved=4 * N, length_s=4 * N / RATE, first_s=0.0))
    os.truncate(path, path.stat().st_size // 2)
    with open_take(path) as take:
        lost, lost_solved = 4 * N - len(take.raw), 4 * N - len(take.solved)
    assert 0 < lost < 4 * N
    sentence = f"{lost:,} raw and {lost_solved:,} solved frames cannot be read."
    for texts in said(path):
        assert sentence in texts
        assert [text for text in texts if "without frames" in text or "It should hold" in text] == []
    recovered = recover(path).path
    assert recovered is not None
    found, verdict = said(recovered)
    assert f"{lost:,} frames lost from the file: it was damaged." in verdict
    assert [text for text in found + verdict if "without frames" in text] == []


def test_a_silence_beside_lost_frames_is_said_all_the_same(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    writer = begun(path)
    record(writer, 0, N // 2)
    os.truncate(path, path.stat().st_size // 3)
    writer.safety.look()
    for i in range(N // 2, N):
        writer.raw("", plain_frame(i))
    record(writer, N + 600, 2 * N + 600)  # 5 s in which nothing came
    writer.safety.find_out()
    readable = writer.readable()
    came = 2 * N
    writer.seal(TakeCounts(came, readable.raw, {DAMAGED: came - readable.raw}, 600, solved=readable.solved))
    for texts in some(said(writer.path)):
        (silence,) = (text for text in texts if "without frames" in text)
        assert silence.startswith("5.0 s without frames, about 600")


def test_frames_that_were_not_written_are_no_silence_unless_the_device_counted_on(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    writer = begun(path)
    record(writer, 0, N)
    record(writer, N + 240, 2 * N)  # 2 s of frames for which the disk had no time
    kept = 2 * N - 240
    writer.seal(TakeCounts(2 * N, kept, {"disk did not answer": 240}, solved=kept))
    found, verdict = said(path)
    assert "240 frames were dropped while recording: 240 disk did not answer." in found
    assert [text for text in found + verdict if "without frames" in text] == []


def test_a_number_that_is_damaged_itself_is_no_missing_record() -> None:
    numbers = np.arange(50)
    numbers[20] += 1 << 20
    assert missing_numbers(numbers) == 0
    assert missing_numbers(np.delete(np.arange(50), [7, 8, 30])) == 3


def test_as_many_are_missing_as_the_counts_say_whatever_their_numbers_are(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    writer = begun(path)
    record(writer, 0, 4 * N)
    writer.seal(TakeCounts(4 * N, 4 * N, solved=4 * N))
    with open_take(path) as take:
        chunks = take.index.chunks
    data = bytearray(path.read_bytes())
    data[chunks[1].offset + 50 : chunks[1].offset + 1000] = bytes(950)
    path.write_bytes(data)
    with open_take(path) as take:
        checked = check(take)
        assert checked.take.lost_solved > 0
        assert [text for text in checked.take.faults if "by their numbers" in text] == []
    texts = [finding.text for finding in verify(path).findings]
    assert any("raw and" in text and "cannot be read." in text for text in texts)
    assert [text for text in texts if "account for" in text] == []
