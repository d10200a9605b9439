"""A take's file name leaves room for those of its copies, and one that does not is refused before anything begins."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from app.cli import main
from core.errors import TakeError
from core.profile import load_profile
from core.takes.export.naming import file_stem
from core.takes.file_name import MOST_BYTES, MOST_TAKE_BYTES, longer_name
from core.takes.reader import open_take
from core.takes.recover import recover
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.core.takes.frames import plain_frame, plain_solved

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="counts characters of whole paths")

N = 30
LONGEST = "a" * (MOST_TAKE_BYTES - 5) + ".mcap"


def writer_at(path: Path) -> TakeWriter:
    writer = TakeWriter(path, TakeInfo("take", rate_hz=120), load_profile("han19"))
    for i in range(N):
        writer.raw("", plain_frame(i))
        writer.solved(plain_solved(i))
    return writer


def test_the_longest_name_can_be_rescued_recovered_and_sealed(tmp_path: Path) -> None:
    writer = writer_at(tmp_path / LONGEST)
    writer.path.unlink()
    writer.seal(TakeCounts(N, N, solved=N))
    assert writer.path.stem.endswith("_rescued")
    writer.path.write_bytes(writer.path.read_bytes()[:-9])
    recovered = recover(writer.path).path
    assert recovered is not None and recovered.stem.endswith("_rescued_recovered")


@pytest.mark.parametrize("stem", ["a" * (MOST_TAKE_BYTES - 4), "a" * 250, "ä" * 125, "a" * 300])
def test_a_longer_one_is_refused_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], stem: str
) -> None:
    path = tmp_path / "takes" / f"{stem}.mcap"
    with pytest.raises(TakeError, match=r"takes \d+ bytes.*Choose a shorter name"):
        TakeWriter(path, TakeInfo("take"), load_profile("han19"))
    assert main(["record", "demo", "--out", str(path), "--seconds", "1"]) == 1
    said = capsys.readouterr()
    assert "Choose a shorter name." in said.err and "Preparing" not in said.out + said.err
    assert not path.parent.exists()


def test_a_take_that_has_too_long_a_name_already_is_recovered_under_a_shorter_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    writer = writer_at(tmp_path / "take.mcap")
    writer.close()
    path = writer.path.rename(tmp_path / f"{'ä' * 125}.mcap")
    for number in ("", "2"):
        assert main(["recover", str(path)]) == 0, capsys.readouterr().err
        (made,) = tmp_path.glob(f"*_recovered{number}.mcap")
        with open_take(made) as take:
            assert take.sealed and len(take.raw) == N
    assert "Unexpected" not in capsys.readouterr().err


def test_only_what_is_too_long_is_cut_and_never_within_a_character() -> None:
    assert longer_name("take", "_recovered.mcap", 8) == "take_recovered.mcap"
    name = longer_name("€" * 100, "_recovered.mcap", 8)
    assert name.endswith("€_recovered.mcap") and MOST_BYTES - 10 <= len(name.encode()) + 8 <= MOST_BYTES


def test_an_export_or_import_is_named_within_what_a_file_system_takes() -> None:
    assert len(file_stem("€" * 240).encode()) <= 180 and set(file_stem("€" * 240)) == {"€"}
    assert file_stem("take 7") == "take 7"
