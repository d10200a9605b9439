from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from core.untrusted.files import open_file, read_bytes, read_text

needs_pipes = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")


def why(path: Path, most: int = 1000) -> str:
    with pytest.raises(OSError) as raised:
        read_text(path, most)
    assert raised.value.strerror
    return raised.value.strerror


@needs_pipes
def test_only_files_are_opened_and_nothing_waits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("pipe")
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket")
        assert why(tmp_path / "socket") == "it is a socket, not a file"
    assert why(tmp_path / "pipe") == why(tmp_path / "link") == "it is a named pipe, not a file"
    assert why(Path("/dev/zero")) == "it is a device, not a file"
    assert why(tmp_path) == "it is a folder, not a file"
    (tmp_path / "loop").symlink_to("loop")
    assert why(tmp_path / "loop") and why(tmp_path / "none")


@pytest.mark.parametrize("name", ["a\0b", "half \ud800", "x" * 5000])
def test_names_that_no_file_can_have(name: str) -> None:
    assert why(Path(name))


def test_a_file_larger_than_is_read_says_both_sizes(tmp_path: Path) -> None:
    path = tmp_path / "large"
    path.write_bytes(b"0" * 1000)
    assert len(read_bytes(path, 1000)) == 1000
    assert why(path, 999) == "it has 1,000 bytes, more than the 999 that are read"
    with path.open("wb") as sparse:
        sparse.truncate(1 << 40)
    assert "1,099,511,627,776 bytes" in why(path)


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="needs /proc")
def test_a_file_that_does_not_say_its_size_is_bounded_too() -> None:
    assert "more than the 10 that are read" in why(Path("/proc/self/maps"), 10)


def test_text_is_utf_8_with_or_without_a_mark(tmp_path: Path) -> None:
    path = tmp_path / "text"
    path.write_bytes(b"\xef\xbb\xbfhand")
    assert read_text(path, 100) == "hand"
    path.write_bytes("hand".encode("utf-16"))
    assert why(path) == "it is no text in UTF-8 from byte 0 on"


def test_what_was_opened_is_closed_again(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"1")
    with open_file(path) as stream:
        assert stream.read() == b"1"
    assert stream.closed
