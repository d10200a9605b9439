"""Which files a command means."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.commands.file_list import files_of
from core.errors import FormatError


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "s1" / "more").mkdir(parents=True)
    for name in ("s1/b.c3d", "s1/a.c3d", "s1/a.trc", "s1/more/c.c3d", "odd[1].c3d", "@home.trc"):
        (tmp_path / name).write_text("")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_paths_are_kept_in_order_and_once(folder: Path) -> None:
    assert files_of(["s1/b.c3d", "s1/a.c3d", "s1/b.c3d", "none.c3d"]) == [
        Path("s1/b.c3d"), Path("s1/a.c3d"), Path("none.c3d"),
    ]  # fmt: skip
    assert files_of(["odd[1].c3d", "@home.trc"]) == [Path("odd[1].c3d"), Path("@home.trc")]


def test_patterns(folder: Path) -> None:
    assert files_of(["s1/*.c3d"]) == [Path("s1/a.c3d"), Path("s1/b.c3d")]
    assert files_of(["s1/*"]) == [Path("s1/a.c3d"), Path("s1/a.trc"), Path("s1/b.c3d")]  # no folders
    assert files_of([str(folder / "s1" / "[ab].c3d")]) == [folder / "s1" / "a.c3d", folder / "s1" / "b.c3d"]
    assert files_of(["s1/b.c3d", "s1/**/*.c3d"]) == [
        Path("s1/b.c3d"), Path("s1/a.c3d"), Path("s1/more/c.c3d"),
    ]  # fmt: skip


def test_a_list_is_as_if_typed(folder: Path) -> None:
    (folder / "s1" / "list.txt").write_bytes(
        "\ufeff# first day\r\ns1/b.c3d\r\n\r\n  s1/more/*.c3d \r\n#s1/a.trc\r\n".encode()
    )
    assert files_of(["s1/a.trc", "@s1/list.txt"]) == [Path("s1/a.trc"), Path("s1/b.c3d"), Path("s1/more/c.c3d")]


def test_what_means_no_file_is_said(folder: Path) -> None:
    (folder / "empty.txt").write_text("# nothing yet\n\n")
    (folder / "binary.txt").write_bytes(b"\xff\xfe\x00")
    (folder / "bad.txt").write_text("s1/*.mcap\n")
    for word, said in (
        ("s1/*.mcap", "No file matches 's1/*.mcap'."),
        ("@bad.txt", "No file matches 's1/*.mcap'."),
        ("@none.txt", "List none.txt cannot be read (No such file or directory)."),
        ("@empty.txt", "List empty.txt names no file."),
        ("@binary.txt", "List binary.txt cannot be read (it is no text in UTF-8 from byte 0 on)."),
    ):
        with pytest.raises(FormatError) as raised:
            files_of(["s1/a.c3d", word])
        assert raised.value.what == said and raised.value.action


@pytest.mark.parametrize(
    "word",
    ["x*" * 3000, "@" + "x" * 3000, "a\0/*.c3d", "*/a\0/*", "a\0*", "*/" * 3000, "[z-a]/*", "**/" * 3000, "\udc80/*"],
)
def test_what_no_file_can_be_called_means_none(folder: Path, word: str) -> None:
    with pytest.raises(FormatError, match=r"No file matches|cannot be read"):
        files_of([word])
