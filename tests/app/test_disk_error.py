"""What to do when the system refuses to write fits the reason why it does."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from app.cli import main
from core.profile import load_profile
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.core.takes.frames import plain_frame, plain_solved
from tests.some import some

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="its folders have no modes")

ROOT = Path(__file__).parents[2]


def take_at(path: Path, seal: bool = True) -> Path:
    writer = TakeWriter(path, TakeInfo("take", rate_hz=120), load_profile("han19"))
    for i in range(30):
        writer.raw("", plain_frame(i))
        writer.solved(plain_solved(i))
    if seal:
        writer.seal(TakeCounts(30, 30, solved=30))
    else:
        writer.close()
    return path


@pytest.mark.skipif(os.name != "posix" or os.getuid() != 0, reason="only root can be somebody else")
def test_a_folder_that_may_not_be_written_is_no_full_disk(tmp_path: Path) -> None:
    take = take_at(tmp_path / "take.mcap", seal=False)
    for folder in some([tmp_path, *tmp_path.parents]):
        folder.chmod(folder.stat().st_mode | 0o055)
    program = (
        "import sys, os; from pathlib import Path; from core.takes.recover import recover\n"
        "from core.errors import PhalanxError\n"
        "os.setuid(65534)\n"
        "try: recover(Path(sys.argv[1]))\n"
        "except PhalanxError as error: print(error)\n"
    )
    command = [sys.executable, "-c", program, str(take)]
    said = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=True).stdout
    assert "Permission denied" in said and "The take as recorded is unharmed." in said
    assert "may write" in said and "ree space" not in said


def a_file(path: Path) -> str:
    path.write_text("notes")
    return "a file, not a folder"


def a_dangling_link(path: Path) -> str:
    path.symlink_to(path.parent / "nothing")
    return "a link that leads nowhere, not a folder"


@pytest.mark.parametrize("put", [a_file, a_dangling_link])
@pytest.mark.parametrize("below", ["", "deep/er"])
def test_what_stands_in_the_place_of_a_folder_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], put, below: str
) -> None:
    take = take_at(tmp_path / "take.mcap")
    kind = put(tmp_path / "there")
    folder = tmp_path / "there" / below
    for command in (
        ["export", str(take), "--to", "csv", "--out", str(folder)],
        ["record", "demo", "--out", str(folder / "new.mcap"), "--seconds", "1"],
    ):
        assert main(command) == 1
        said = capsys.readouterr().err
        assert f"{tmp_path / 'there'} is {kind}" in said, said
        assert "File exists" not in said and "space" not in said and "Preparing" not in said


def test_an_export_whose_file_is_a_link_that_leads_nowhere_says_that_it_is_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    take = take_at(tmp_path / "take.mcap")
    out = tmp_path / "out"
    out.mkdir()
    (out / "take.trc").symlink_to(tmp_path / "nothing")
    assert main(["export", str(take), "--to", "trc", "--out", str(out)]) == 1
    assert "take.trc exists already" in capsys.readouterr().err
