"""Takes of several streams that are cut at any byte, have holes, or have lost what says what their streams are."""

from __future__ import annotations

import os
import struct
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from mcap.opcode import Opcode

from core.errors import PhalanxError, TakeError
from core.takes.container import TOPICS, clock_topic, frames_topic
from core.takes.reader import open_take
from core.takes.records import RECORD_HEAD
from core.takes.recover import recover
from core.takes.seal import seal_take
from core.takes.take import DAMAGED, StreamCounts, TakeCounts
from core.takes.verify import verify
from tests.core.takes import crafted
from tests.core.takes.crafted import Crafted, message, metadata
from tests.core.takes.frames import GLOVE, OPTICAL, OTHER, bits, plain_bones, plain_frame
from tests.core.takes.several import N_BONES, Written, begin, events, first_of, held, n_events, n_records, record, write
from tests.core.takes.test_one_verdict import said_alike
from tests.some import some


def test_a_recording_cut_at_any_byte_gives_every_record_before(tmp_path: Path) -> None:
    _, sizes = record(tmp_path / "take.mcap", 6)
    data = (tmp_path / "take.mcap").read_bytes()[: sizes[-1]]
    cut = tmp_path / "cut.mcap"
    for end in some(range(sizes[0], len(data) + 1)):
        cut.write_bytes(data[:end])
        n = sum(size <= end for size in sizes[1:])
        with open_take(cut) as take:
            assert n_records(take) == n and held(take) == first_of(n).bits
            assert take.complete == (end in sizes) and not take.sealed
            assert bits(tuple(one.info for one in take.streams.values())) == bits((OPTICAL, GLOVE, OTHER))
            assert take.profile.layout.name == "schroeder6"
    for end in some(range(0, sizes[0], 7)):
        cut.write_bytes(data[:end])
        try:
            with open_take(cut) as take:
                assert n_records(take) == 0
        except PhalanxError as error:
            assert str(cut) in str(error)


def test_a_sealed_take_cut_at_any_byte_gives_a_prefix_of_every_stream(tmp_path: Path) -> None:
    record(tmp_path / "take.mcap", 500, sealed=True)
    data = (tmp_path / "take.mcap").read_bytes()
    n, cut, seen = n_events(500), tmp_path / "cut.mcap", set()
    for end in [*range(3000, len(data), len(data) // 80), len(data)]:
        cut.write_bytes(data[:end])
        try:
            take = open_take(cut)
        except PhalanxError as error:
            assert str(cut) in str(error)
            continue
        with take:
            found = n_records(take)
            assert held(take) == first_of(found).bits
            assert take.sealed == (end == len(data)) and (found == n or not take.complete)
            if take.damage and take.counts:
                lost = take.lost_raw + take.lost_solved + take.lost_beside
                uncounted = sum(len(one.clock) for one in take.streams.values())
                assert found - uncounted + lost == n - sum(map(len, first_of(n).clock.values()))
            seen.add(found)
    assert {0, n} <= seen and len(seen) > 2


@pytest.mark.parametrize("sealed", [False, True])
@pytest.mark.parametrize("seed", range(12))
def test_a_hole_costs_only_what_was_in_it(tmp_path: Path, sealed: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    written, sizes = record(tmp_path / "take.mcap", 400, sealed)
    data = bytearray((tmp_path / "take.mcap").read_bytes())
    size = int(rng.choice([1, 8, 300]))
    start = int(rng.integers(sizes[0], len(data) - size - (2500 if sealed else 0)))
    for i in range(start, start + size):
        data[i] ^= int(rng.integers(1, 256))
    hole = tmp_path / "hole.mcap"
    hole.write_bytes(data)
    with open_take(hole) as take:
        left = {key: _numbers(take.streams[key].frames, frames) for key, frames in written.frames.items()}
        assert all(numbers == sorted(set(numbers)) for numbers in some(left.values()))
        found, lost = n_records(take), take.lost_raw + take.lost_solved + take.lost_beside
        if not sealed:
            assert n_events(400) - found <= 3
        if not take.damage:
            assert not sealed and found == n_events(400)  # a number or a time, which has no checksum while recording
        assert (lost > 0) <= (not take.complete)
        before = held(take)
    said_alike(hole)
    result = recover(hole)
    assert result.path is not None
    assert result.recovered + result.recovered_solved + result.beside == found
    with open_take(result.path) as take:
        assert take.sealed and take.complete and held(take) == before
        assert take.counts is not None and take.counts.balanced
        assert all(one.balanced for one in some(take.counts.others.values()))
    assert recover(result.path).path is None


def _numbers(read: object, recorded: list[object]) -> list[int]:
    """Which of the recorded frames were read; each is one of them, bit for bit."""
    known = {bits(frame).__repr__(): i for i, frame in enumerate(recorded)}
    return [known[bits(frame).__repr__()] for frame in read]  # type: ignore[attr-defined]


def overwritten(data: bytes, *which: Callable[[int, bytes], bool]) -> bytes:
    """A recorded file in which records of these kinds are garbage."""
    out, position = bytearray(data), 8
    while position + 9 <= len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, position)
        body = data[position + 9 : position + 9 + length]
        if any(one(opcode, body) for one in which):
            out[position : position + 9 + length] = bytes([0xEE]) * (9 + length)
        position += 9 + length
    return bytes(out)


def channels(opcode: int, body: bytes) -> bool:
    return opcode in (Opcode.CHANNEL, Opcode.SCHEMA)


def streams(opcode: int, body: bytes) -> bool:
    return opcode == Opcode.METADATA and b"phalanx.stream." in body[:30]


def info(opcode: int, body: bytes) -> bool:
    return opcode == Opcode.METADATA and body[4:16] == b"phalanx.take"


@pytest.mark.parametrize("lost", [(channels,), (streams,), (channels, streams), (channels, streams, info)])
def test_every_record_is_found_where_nothing_says_what_it_is(
    tmp_path: Path, lost: tuple[Callable[[int, bytes], bool], ...]
) -> None:
    written, _ = record(tmp_path / "take.mcap", 60)
    data = overwritten((tmp_path / "take.mcap").read_bytes(), *lost)
    (tmp_path / "damaged.mcap").write_bytes(data)
    path: Path | None = tmp_path / "damaged.mcap"
    for recovered in (False, True):
        assert path is not None
        with open_take(path) as take:
            keys = [OPTICAL.key, GLOVE.key, OTHER.key] if streams not in lost else ["stream 1", "stream 2", "stream 3"]
            assert list(take.streams) == keys and take.complete == recovered
            found = {
                key: bits((tuple(one.frames), tuple(one.clock)))
                for key, one in zip((OPTICAL.key, GLOVE.key, OTHER.key), take.streams.values(), strict=True)
            }
            assert (found, bits(tuple(take.solved))) == written.bits
            assert [one.info.what for one in take.streams.values()] == ["markers", "inertial", "markers"]
            if streams in lost and not recovered:
                for key in keys:
                    assert f"What it says of {key} cannot be read." in take.damage
        if not recovered:
            with pytest.raises(TakeError, match="damaged"):
                seal_take(path)
            path = recover(path).path
    assert path is not None and verify(path).ok


def test_a_stream_of_which_nothing_can_be_read_is_missed(tmp_path: Path) -> None:
    """The take names it by its number, so that it does not go silently."""
    record(tmp_path / "take.mcap", 60)
    others = {3 * n + k for n in (2, 3) for k in (-1, 0, 1)}

    def of_others(opcode: int, body: bytes) -> bool:
        return opcode == Opcode.MESSAGE and struct.unpack_from("<H", body)[0] in others

    path = tmp_path / "damaged.mcap"
    path.write_bytes(overwritten((tmp_path / "take.mcap").read_bytes(), streams, of_others))
    with open_take(path) as take:
        assert {"What it says of stream 2 cannot be read.", "What it says of stream 3 cannot be read."} < set(
            take.damage
        )
        assert list(take.streams) == ["stream 1", "stream 2", "stream 3"] and len(take.raw) == 60


FIVE = b"".join(crafted.raw(i) for i in range(5))


def bones(i: int, topic: str = frames_topic(2, "inertial")) -> bytes:
    from core.takes.codec import encode_inertial

    return message(encode_inertial(plain_bones(i, N_BONES)), i, TOPICS[topic])


def of(words: dict[str, str], number: int = 2) -> bytes:
    return metadata(f"phalanx.stream.{number}", words)


ODD: dict[str, tuple[list[bytes], dict[str, str], list[str], str]] = {
    "two of one name": (
        [of({"key": "a", "what": "inertial"}, 1), of({"key": "a", "what": "inertial"}), bones(0)],
        {"streams": "1 2"}, ["a", "a (2)"], "Stream a holds frames of another kind",
    ),
    "no name": ([of({"what": "inertial"}), bones(0)], {"streams": "2"}, ["", "stream 2"], ""),
    "another kind": (
        [of({"key": "a", "what": "markers"}), bones(0)], {}, ["", "a"], "Stream a holds frames of another kind",
    ),
    "two kinds": (
        [of({"key": "a", "what": "inertial"}), bones(0),
         message(crafted.encode_raw(plain_frame(0)), 0, TOPICS[frames_topic(2, "markers")])],
        {}, ["", "a"], "1 frame of stream a cannot be read.",
    ),
    "words of a later version": (
        [of({"key": "a", "what": "sound", "ids": "tattoo", "rate_hz": "much", "sides": "third left", "clock_hz": ""}),
         bones(0)],
        {}, ["", "a"], "",
    ),
    "numbers that are none": ([], {"streams": "0 2 99 ٣"}, [""], ""),
    "too many": ([], {"streams": "65 99"}, [""], ""),
    "counts that are none": (
        [of({"key": "a", "what": "inertial"}), bones(0), metadata("phalanx.counts.2", {"received": "-1"})],
        {}, ["", "a"], "The counts of stream a cannot be read.",
    ),
    "counts of one that is not there": ([metadata("phalanx.counts.7", {"received": "1"})], {}, [""], ""),
}  # fmt: skip
"""Records, what the take says of itself, the streams that are read, and what is wrong."""


@pytest.mark.parametrize("sealed", [False, True])
@pytest.mark.parametrize("name", ODD)
def test_what_no_writer_writes(tmp_path: Path, name: str, sealed: bool) -> None:
    made, words, keys, wrong = ODD[name]
    take = Crafted([*made, FIVE], {"version": "3", "name": "x", "rate_hz": "120", **words})
    path = tmp_path / "take.mcap"
    path.write_bytes(take.sealed() if sealed else take.data())
    with open_take(path) as opened:
        assert list(opened.streams) == keys and len(opened.raw) == 5
        assert (any(wrong in text for text in opened.damage)) if wrong else not opened.damage
        for stream in opened.streams.values():
            assert len([stream.frames[i] for i in range(len(stream.frames))]) == (5 if stream.solved else 1)
        if name == "words of a later version":
            said = opened.streams["a"].info
            assert (said.what, said.ids, said.sides) == ("inertial", "none", ("left",)) and np.isnan(said.rate_hz)
    said_alike(path)


def test_frames_that_cannot_be_read_are_left_out(tmp_path: Path) -> None:
    """Their checksums are right, and they are no frames."""
    bad = message(crafted.signed(b"\x2a\x01a"), 1, TOPICS[frames_topic(2, "inertial")])
    clock = message(crafted.signed(b"\x09"), 0, TOPICS[clock_topic(2)])
    about = of({"key": "a", "what": "inertial"})
    path = tmp_path / "take.mcap"
    path.write_bytes(Crafted([about, bones(0), bad, bones(2), clock, FIVE], {"version": "3", "streams": "2"}).data())
    report = verify(path)
    texts = [finding.text for finding in report.findings]
    assert not report.ok and report.streams == {"a": 2} and report.raw == 5
    assert "1 a frame cannot be read: A record holds 0 numbers as rotations_wxyz, not 4." in texts
    assert any("1 a clock frame cannot be read" in text for text in texts)
    recovered = recover(path)
    assert (recovered.recovered, recovered.beside, recovered.lost_beside) == (5, 2, 2) and recovered.path is not None
    lost = "0 raw and 0 solved frames and 1 of other streams and 1 clock sample lost"
    assert f"and 2 frames of other streams recovered, {lost}" in str(recovered)
    with open_take(recovered.path) as take:
        assert [frame.sequence for frame in take.streams["a"].frames] == [0, 2] and take.complete
        assert take.counts == TakeCounts(5, 5, others={"a": StreamCounts(3, 2, {"damaged file": 1})})


def cut_anywhere(data: bytes) -> Iterator[bytes]:
    for end in np.linspace(0, len(data) - 1, 40).astype(int):
        yield data[:end]


@pytest.mark.parametrize("sealed", [False, True])
def test_everyone_says_the_same_of_a_take_that_is_cut_or_changed(tmp_path: Path, sealed: bool) -> None:
    record(tmp_path / "take.mcap", 60, sealed)
    data, path, rng = (tmp_path / "take.mcap").read_bytes(), tmp_path / "changed.mcap", np.random.default_rng(3)
    conditions = set()
    flipped = (data[:at] + bytes([data[at] ^ 4]) + data[at + 1 :] for at in rng.integers(0, len(data), 30))
    for changed in (*cut_anywhere(data), *flipped):
        path.write_bytes(changed)
        conditions.add(said_alike(path))
    assert len(conditions) > 2


@pytest.mark.skipif(sys.platform == "win32", reason="Windows itself keeps an open file where it is")
@pytest.mark.parametrize("befall", ["deleted", "cut"])
def test_a_take_that_is_taken_away_while_it_is_recorded_is_recorded_on(tmp_path: Path, befall: str) -> None:
    """With every stream: all of it where its file was deleted; what is left of it where that was cut, and all after."""
    writer, written = begin(tmp_path / "take.mcap"), Written()
    for k, (stream, one) in enumerate(events(200)):
        if k == 400 and befall == "deleted":
            writer.path.unlink()
        elif k == 400:
            os.truncate(writer.path, writer.bytes_written // 2)
        if k % 50 == 0:
            writer.safety.look()
        writer.safety.rescue_on()
        write(writer, stream, one)
        written.add(stream, one)
    assert writer.safety.find_out() == (befall == "cut")
    readable = writer.readable()
    left = {OPTICAL.key: readable.raw, **{key: one.frames for key, one in readable.beside.items()}}

    def counted(key: str) -> StreamCounts:
        n, dropped = len(written.frames[key]), len(written.frames[key]) - left[key]
        return StreamCounts(n, left[key], {DAMAGED: dropped} if dropped else {})

    others, own = {key: counted(key) for key in (GLOVE.key, OTHER.key)}, counted(OPTICAL.key)
    writer.seal(TakeCounts(own.received, own.written, own.dropped, solved=readable.solved, others=others))
    with open_take(writer.path) as take:
        assert take.sealed and take.complete and take.counts is not None and take.counts.others == others
        assert bits(tuple(one.info for one in take.streams.values())) == bits((OPTICAL, GLOVE, OTHER))
        if befall == "deleted":
            assert held(take) == written.bits
        for key, frames in some(written.frames.items()):
            numbers = _numbers(take.streams[key].frames, frames)
            after = len(first_of(400).frames[key])
            assert set(numbers) >= set(range(after, len(frames))) and numbers == sorted(numbers)
            assert (len(numbers) < len(frames)) == (befall == "cut")
    assert verify(writer.path).ok
