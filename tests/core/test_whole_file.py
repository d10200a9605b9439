from __future__ import annotations

from pathlib import Path

import pytest

from core.errors import FormatError
from core.profile import load_profile, save_profile
from core.whole_file import write_whole


def test_a_file_takes_the_place_of_an_older_one_and_leaves_nothing_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "it.json"
    for content, held in (("ä\n", "ä\n".encode()), (b"\x00\xff", b"\x00\xff")):
        write_whole(path, content, "Profile")
        assert path.read_bytes() == held
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("place", ["none/it.json", "file/it.json", "x" * 252, "folder"])
def test_where_none_can_be_written_that_is_said_and_all_stays(tmp_path: Path, place: str) -> None:
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder").mkdir()
    there = sorted(tmp_path.iterdir())
    with pytest.raises(FormatError, match=r"Profile .* cannot be written"):
        save_profile(load_profile("schroeder6"), tmp_path / place)
    assert sorted(tmp_path.iterdir()) == there
