"""What is no take, or cannot be read or written: one clear error each, and nothing else."""

from __future__ import annotations

import os
import struct
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.writer import Writer

from core.errors import FormatError, PhalanxError, TakeError
from core.profile import load_profile
from core.takes import container
from core.takes.container import MAGIC
from core.takes.reader import open_take
from core.takes.recover import recover
from core.takes.take import TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.core.takes.frames import plain_frame
from tests.some import some

READERS: tuple[Callable[[Path], object], ...] = (open_take, recover, verify)


def refused(path: Path, kind: type[PhalanxError], *words: str) -> None:
    for read in READERS:
        with pytest.raises(kind) as caught:
            read(path)
        for word in (str(path), *words):
            assert word in str(caught.value)
        assert caught.value.action


def test_no_file(tmp_path: Path) -> None:
    refused(tmp_path / "absent.mcap", TakeError, "no take")


def test_a_name_that_no_file_can_have() -> None:
    for read in READERS:
        with pytest.raises(TakeError, match=r"null (byte|character)"):
            read(Path("a\0b.mcap"))
    with pytest.raises(TakeError, match=r"cannot be opened|no take"):
        open_take(Path("x" * 5000))


def test_a_folder(tmp_path: Path) -> None:
    refused(tmp_path, TakeError, "folder")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.mcap")
    refused(tmp_path / "pipe.mcap", TakeError, "not a file")


def test_an_empty_file(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").touch()
    refused(tmp_path / "a.mcap", FormatError, "empty")


@pytest.mark.parametrize("data", [b"x", b"PK\x03\x04" + bytes(1000), b"\x89MCAP1\r\n" + bytes(100), os.urandom(5000)])
def test_garbage(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "a.mcap").write_bytes(data)
    refused(tmp_path / "a.mcap", FormatError, "not a take")


@pytest.mark.parametrize("n", [1, 7, 8, 9, 12, 20])
def test_only_the_beginning_of_a_beginning(tmp_path: Path, n: int) -> None:
    TakeWriter(tmp_path / "a.mcap", TakeInfo("a"), load_profile("han19")).close()
    (tmp_path / "b.mcap").write_bytes((tmp_path / "a.mcap").read_bytes()[:n])
    refused(tmp_path / "b.mcap", FormatError, "not a take")


def test_a_take_without_frames_opens_and_has_nothing_to_recover(tmp_path: Path) -> None:
    TakeWriter(tmp_path / "a.mcap", TakeInfo("a"), load_profile("han19")).close()
    with open_take(tmp_path / "a.mcap") as take:
        assert len(take.raw) == len(take.solved) == len(take.marks) == 0 and take.duration_s == 0
    with pytest.raises(TakeError, match="no readable frame"):
        recover(tmp_path / "a.mcap")
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("chunked", [False, True])
def test_an_mcap_file_of_another_program(tmp_path: Path, chunked: bool) -> None:
    path = tmp_path / "robot.mcap"
    writer = Writer(str(path), use_chunking=chunked)
    writer.start("ros2", "libmcap 1.3")
    channel = writer.register_channel("/tf", "cdr", writer.register_schema("tf", "ros2msg", b"float64 x"))
    writer.add_message(channel, 1, b"12345678", 1)
    writer.finish()
    refused(path, FormatError, "'ros2'", "libmcap 1.3")


def test_an_unreadable_file(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.touch()
    path.chmod(0)
    if os.access(path, os.R_OK):
        pytest.skip("whoever runs this test may read everything")
    refused(path, TakeError, "cannot be opened")


@pytest.mark.parametrize("sealed", [False, True])
def test_a_take_of_a_newer_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sealed: bool) -> None:
    path = tmp_path / "new.mcap"
    text = container.info_to_text
    monkeypatch.setattr(container, "info_to_text", lambda *about: {**text(*about), "version": "4"})
    monkeypatch.setattr(container, "program_version", lambda: "9.9.9")
    writer = TakeWriter(path, TakeInfo("new"), load_profile("han19"))
    writer.raw("", plain_frame(0))
    if sealed:
        with pytest.raises(FormatError):  # nothing here reads it, so it stays as it is
            writer.seal(TakeCounts(1, 1))
    writer.close()
    monkeypatch.undo()
    refused(path, FormatError, "version 4 ", "phalanx 9.9.9", "versions up to 3", "Update")


def chunk(compression: str, data: bytes, size: int) -> bytes:
    body = struct.pack("<QQQI", 0, 0, size, 0)
    body += struct.pack("<I", len(compression)) + compression.encode() + struct.pack("<Q", len(data)) + data
    return struct.pack("<BQ", 6, len(body)) + body


def test_hostile_sizes_end_in_a_report(tmp_path: Path) -> None:
    """Lengths of every kind beyond the file, and small chunks that claim or hold gigabytes."""
    good = tmp_path / "good.mcap"
    writer = TakeWriter(good, TakeInfo("good"), load_profile("han19"))
    writer.raw("", plain_frame(0))
    writer.close()
    zeros = bytes(1 << 28)
    evils = [struct.pack("<BQ", opcode, n) + bytes(40) for opcode in range(256) for n in (2**63, 2**32, 50)]
    evils += [
        chunk("zstd", zstandard.compress(zeros), 100),
        chunk("zstd", zstandard.compress(zeros), 2**62),
        chunk("lz4", lz4.frame.compress(zeros), 100),
        chunk("lz4", b"", 2**27),
        chunk("", b"\x05" + b"\xff" * 60, 61),
        chunk("\x00" * 8, b"", 0),
        struct.pack("<BQHI", 7, 6, 1, 2**32 - 1),
        struct.pack("<BQHIQQ", 5, 2**40, 1, 1, 1, 1),
    ]
    path = tmp_path / "evil.mcap"
    for evil in some(evils):
        path.write_bytes(good.read_bytes() + evil)
        with open_take(path) as take:
            assert [frame.sequence for frame in take.raw] == [0]


@pytest.mark.parametrize("seed", range(40))
def test_random_bytes_behind_a_true_beginning(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    path = tmp_path / "a.mcap"
    noise = rng.choice(np.array([0, 1, 3, 4, 5, 6, 7, 9, 12, 15, 255], np.uint8), int(rng.integers(5000))).tobytes()
    path.write_bytes(MAGIC + noise)
    for read in READERS:
        with pytest.raises(PhalanxError):
            read(path)
