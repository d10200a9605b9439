"""`--out` that is a device, a pipe or a folder is refused before anything is begun, by every command that writes."""

from __future__ import annotations

import os
import pty
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.cli import main
from tests.some import some

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has neither pipes nor devices among its files")

WRITE_A_FILE = [
    ["record", "demo", "--out"],
    ["calibrate", "size", "M", "--profile", "han19", "--out"],
    ["calibrate", "hand", "a.mcap", "--profile", "han19", "--out"],
    ["calibrate", "neutral", "a.mcap", "--profile", "han19", "--out"],
    ["calibrate", "import", "a.glb", "--profile", "han19", "--out"],
    ["subspace", "a.mcap", "--out"],
    ["subspace", "a.mcap", "--out", "b.json", "--write-profile"],
    ["train", "labeller", "--out"],
    ["prop", "define", "a.mcap", "--points", "A,B,C", "--name", "pen", "--out"],
    ["prop", "add", "a.json", "--profile", "han19", "--out"],
    ["simulate", "natnet", "--props"],
]
WRITE_INTO_A_FOLDER = [
    ["track", "a.mcap", "--profile", "han19", "--out"],
    ["export", "a.mcap", "--to", "csv", "--out"],
    ["demo", "--out"],
]


def device(folder: Path) -> str:
    """The far end of a terminal: nothing can be put in its place, as root could in that of /dev/null."""
    near, far = pty.openpty()
    _TERMINALS.extend((near, far))
    return os.ttyname(far)


def pipe(folder: Path) -> str:
    os.mkfifo(folder / "pipe.mcap")
    return str(folder / "pipe.mcap")


def a_socket(folder: Path) -> str:
    with socket.socket(socket.AF_UNIX) as line:
        line.bind(str(folder / "socket"))
    return str(folder / "socket")


def a_folder(folder: Path) -> str:
    (folder / "takes").mkdir()
    return str(folder / "takes")


_TERMINALS: list[int] = []


@pytest.fixture(autouse=True)
def terminals() -> Iterator[None]:
    yield
    while _TERMINALS:
        os.close(_TERMINALS.pop())


KINDS: dict[Callable[[Path], str], str] = {
    device: "a device", pipe: "a pipe", a_socket: "a socket", a_folder: "a folder",
}  # fmt: skip


def refused(words: list[str], path: str, what: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*words, path]) == 1
    err = capsys.readouterr().err
    assert err.startswith(f"phalanx: {path} is {what}, not a ") and "nothing is written there" in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("words", WRITE_A_FILE, ids=" ".join)
@pytest.mark.parametrize("kind", list(KINDS))
def test_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], kind: Callable[[Path], str]
) -> None:
    path = kind(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    refused(words, path, KINDS[kind], capsys)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("words", WRITE_INTO_A_FOLDER, ids=" ".join)
def test_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str]) -> None:
    for kind in some((device, pipe, a_socket)):
        refused(words, kind(tmp_path), KINDS[kind], capsys)
