"""What is said of the stream that was solved is said of each: every loss once, with its true reason, and frames of
unknown time."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path

import pytest

from core.frames import Standstill
from core.profile import load_profile
from core.takes.checked import check
from core.takes.reader import open_take
from core.takes.recover import recover
from core.takes.seal import seal_take
from core.takes.take import DAMAGED, StreamCounts, TakeCounts, TakeInfo, counts_to_text, stream_counts_to_text
from core.takes.verify import verify
from core.takes.writer import ReadableFrames, TakeWriter
from tests.core.takes.crafted import Crafted, metadata
from tests.core.takes.frames import GLOVE, OPTICAL, plain_bones, plain_frame, plain_solved
from tests.core.takes.test_lost_once import said
from tests.core.takes.test_streams_damaged import FIVE, bones, of

N = 400
RATE = 120
STREAM = f"Stream {GLOVE.key}: "
FOUR = StreamCounts(4, 4)


def begun(path: Path) -> TakeWriter:
    """Of an optical system at 120 Hz, which is solved, and a glove at 60 Hz."""
    info, streams = TakeInfo("take", rate_hz=RATE), (GLOVE, OPTICAL)
    return TakeWriter(path, info, load_profile("han19"), streams, OPTICAL.key, refuge=path.parent)


def record(writer: TakeWriter, begin: int, end: int, unknown: range = range(0)) -> None:
    """unknown: frames of the glove of which nothing tells when they were taken."""
    for i in range(begin, end):
        writer.raw(OPTICAL.key, plain_frame(i))
        writer.solved(plain_solved(i))
        if i % 2 == 0:
            bones = plain_bones(i // 2)
            nobody_knows = replace(bones, times=replace(bones.times, host_s=math.nan))
            writer.raw(GLOVE.key, nobody_knows if i // 2 in unknown else bones)


def counted(n: int, glove: StreamCounts) -> TakeCounts:
    return TakeCounts(n, n, solved=n, length_s=n / RATE, first_s=0.0, others={GLOVE.key: glove})


@pytest.mark.parametrize("untimed", [3, 0])
def test_frames_of_unknown_time_are_told_of_their_stream(tmp_path: Path, untimed: int) -> None:
    """Also where their recorder did not count them."""
    path, words = tmp_path / "take.mcap", f"{GLOVE.key}: 3 of unknown time"
    writer = begun(path)
    record(writer, 0, 120, unknown=range(20, 23))
    readable = writer.readable()
    assert (readable.raw, readable.untimed, readable.beside) == (120, 0, {GLOVE.key: ReadableFrames(60, 3)})
    writer.seal(counted(120, StreamCounts(60, 60, untimed=untimed)))
    with open_take(path) as take:
        assert take.untimed == {OPTICAL.key: 0, GLOVE.key: untimed}
        assert take.verdict.headline == (words if untimed else "120 frames, none lost")
        assert check(take).take.verdict.headline == words
    report = verify(path)
    assert report.ok and report.verdict.headline == words
    assert [one.text for one in report.findings] == [f"{STREAM}3 frames have a time that is not a number."]
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[:-50])
    recovered = recover(cut).path
    assert recovered is not None
    with open_take(recovered) as take:
        assert take.counts == counted(120, StreamCounts(60, 60, untimed=3)) and take.verdict.headline == words


def test_whoever_seals_a_take_counts_its_frames_of_unknown_time(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    writer = begun(path)
    record(writer, 0, 120, unknown=range(20, 23))
    writer.close()
    recovered = recover(path).path
    assert recovered is not None
    seal_take(path)
    for one in (path, recovered):
        with open_take(one) as take:
            assert take.counts is not None and take.counts.untimed == 0
            assert take.counts.others == {GLOVE.key: StreamCounts(60, 60, untimed=3)}


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_frames_that_were_cut_off_while_recording_are_not_also_a_silence(tmp_path: Path, share: float) -> None:
    path = tmp_path / "take.mcap"
    writer = begun(path)
    record(writer, 0, N // 2)
    os.truncate(path, int(share * path.stat().st_size))
    writer.safety.look()
    record(writer, N // 2, N)
    assert writer.safety.find_out()
    readable = writer.readable()
    glove = readable.beside[GLOVE.key].frames
    lost, lost_bones = N - readable.raw, N // 2 - glove
    assert lost > lost_bones > 5
    of_glove = StreamCounts(N // 2, glove, {DAMAGED: lost_bones})
    writer.seal(
        replace(
            counted(N, of_glove), written=readable.raw, dropped={DAMAGED: lost}, solved=readable.solved,
            unsolved={DAMAGED: N - readable.solved},
        )
    )  # fmt: skip
    found, verdict = said(writer.path)
    dropped = f"{lost_bones} frames were lost from the file: it was damaged."
    assert [text for text in found if text.startswith(STREAM)] == [STREAM + dropped]
    assert [text for text in verdict if text.startswith(STREAM)] == [
        f"{STREAM}{lost_bones} frames lost from the file: it was damaged."
    ]
    for text in found + verdict:
        assert "without frames" not in text and "missing" not in text and "no raw frame" not in text, text
    with open_take(writer.path) as take:
        assert all(take.holes_in(key).came.tolist() == [True] for key in (OPTICAL.key, GLOVE.key))


def test_a_whole_take_that_is_cut_says_what_cannot_be_read_and_no_silence(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    writer = begun(path)
    record(writer, 0, 4 * N)
    writer.seal(counted(4 * N, StreamCounts(2 * N, 2 * N)))
    os.truncate(path, path.stat().st_size // 2)
    with open_take(path) as take:
        lost = 2 * N - len(take.streams[GLOVE.key].frames)
    assert 0 < lost < 2 * N
    for texts in said(path):
        about = [text for text in texts if GLOVE.key in text]
        assert about == [f"{lost} frames of stream {GLOVE.key} cannot be read."]
        assert [text for text in texts if "without frames" in text or "It should hold" in text] == []
    recovered = recover(path).path
    assert recovered is not None
    found, verdict = said(recovered)
    assert f"{STREAM}{lost} frames lost from the file: it was damaged." in verdict
    assert [text for text in found + verdict if "without frames" in text] == []


def test_frames_that_were_not_written_are_no_silence_of_their_stream(tmp_path: Path) -> None:
    """Two seconds of the glove, while the other stream was written."""
    path = tmp_path / "take.mcap"
    writer = begun(path)
    for i in range(N):
        writer.raw(OPTICAL.key, plain_frame(i))
        writer.solved(plain_solved(i))
        if i % 2 == 0 and not 60 <= i // 2 < 180:
            writer.raw(GLOVE.key, plain_bones(i // 2))
    writer.seal(counted(N, StreamCounts(N // 2, N // 2 - 120, {"queue full": 120})))
    found, verdict = said(path)
    assert found == [f"{STREAM}120 frames were dropped while recording: 120 queue full."]
    assert verdict == [f"{STREAM}120 frames dropped: queue full."]
    with open_take(path) as take:
        assert take.holes_in(GLOVE.key).came.tolist() == [True] and len(take.holes_in(OPTICAL.key)) == 0


def test_a_standstill_is_one_of_the_streams_that_say_so(tmp_path: Path) -> None:
    """Two seconds are missing of both: one was not read meanwhile, and the other sent nothing."""
    path = tmp_path / "take.mcap"
    writer = begun(path)
    record(writer, 0, 120)
    record(writer, 360, 480)
    still = Standstill(1.0, 3.0, 2.0, 120)
    glove = StreamCounts(120, 120, {}, 120, standstills=(still,))
    writer.seal(
        TakeCounts(240, 240, solved=240, length_s=4.0, first_s=0.0, others={GLOVE.key: glove}, lost=240)
    )  # fmt: skip
    with open_take(path) as take:
        assert take.holes_in(GLOVE.key).own.tolist() == [True] and take.holes.own.tolist() == [False]
    found, verdict = said(path)
    for texts in (found, verdict):
        (of_glove,) = (text for text in texts if text.startswith(STREAM))
        assert "Phalanx stood still for 2.0 s" in of_glove and "120 frames of that time are lost" in of_glove
        (silence,) = (text for text in texts if "without frames" in text)
        assert silence.startswith("2.0 s without frames, about 240")


def test_as_many_are_missing_as_the_counts_say_whatever_their_numbers_are(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    writer = begun(path)
    record(writer, 0, 4 * N)
    writer.seal(counted(4 * N, StreamCounts(2 * N, 2 * N)))
    with open_take(path) as take:
        chunk = take.index.chunks[1]
    data = bytearray(path.read_bytes())
    data[chunk.offset + 50 : chunk.offset + 1000] = bytes(950)
    path.write_bytes(data)
    with open_take(path) as take:
        checked = check(take)
        assert checked.take.streams[GLOVE.key].lost > 0
        assert [text for text in checked.take.faults if "by their numbers" in text] == []
    texts = [finding.text for finding in verify(path).findings]
    assert any(f"of stream {GLOVE.key} cannot be read." in text for text in texts)
    assert [text for text in texts if "account for" in text or "without frames" in text] == []


def test_a_number_that_is_damaged_itself_is_no_missing_frame_of_its_stream(tmp_path: Path) -> None:
    """One of four cannot be read, and the number of another tells of seven that never were."""
    about = of({"key": "a", "what": "inertial"})
    counts = (("phalanx.counts", counts_to_text(TakeCounts(5, 5))), ("phalanx.counts.2", stream_counts_to_text(FOUR)))
    made = [about, *(metadata(*one) for one in counts), FIVE, bones(0), bones(1), bones(9)]
    path = tmp_path / "take.mcap"
    path.write_bytes(Crafted(made, {"version": "3", "name": "x", "streams": "2"}).sealed())
    with open_take(path) as take:
        assert check(take).take.streams["a"].lost == 1
        assert [text for text in take.problems if "by their numbers" in text] == []
        assert "1 frame of stream a cannot be read." in take.problems
