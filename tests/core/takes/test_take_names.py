from __future__ import annotations

from datetime import datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.errors import TakeError
from core.takes.take_names import FIELDS, TakeNames, safe_name

WHEN = datetime(2025, 3, 14, 15, 9, 26)


@pytest.mark.parametrize(
    ("names", "name"),
    [
        (TakeNames(performer="Anna", shot="12B"), "Anna_12B_007"),
        (TakeNames(performer="Anna"), "Anna_007"),
        (TakeNames(shot="12B"), "12B_007"),
        (TakeNames(), "007"),
        (TakeNames("{take}"), "7"),
        (TakeNames("{take:5}"), "00007"),
        (TakeNames("{date}_{time}_{take:02}"), "2025-03-14_15-09-26_07"),
        (TakeNames("A--{take}"), "A--7"),
        (TakeNames("{{x}} {take}"), "{x} 7"),
        (TakeNames("{performer} - {take}", "../etc/passwd"), ".._etc_passwd - 7"),
        (TakeNames("{performer}{take:04}", "a:b*c?"), "a_b_c_0007"),
        (TakeNames("com{take}"), "_com7"),
        (TakeNames("{performer} {take}", "Åsa 手"), "Åsa 手 7"),
    ],
)
def test_names(names: TakeNames, name: str) -> None:
    assert names.name(7, WHEN) == name


@pytest.mark.parametrize(
    ("template", "words"),
    [
        ("", "no take number"),
        ("{performer}", "no take number"),
        ("{take", "cannot be read"),
        ("take}", "cannot be read"),
        ("{}_{take}", "unknown field {}"),
        ("{take.real}", "unknown field {take.real}"),
        ("{actor}_{take}", "unknown field {actor}"),
        ("{take:x}", "{take:x}"),
        ("{take:0999}", "{take:0999}"),
        ("{take!r}", "{take!r:}"),
        ("{performer:>20}_{take}", "{performer:>20}"),
        ("a/b_{take}", "'/'"),
        ("{take}:1", "':'"),
        ("{take}\n", "'\\n'"),
    ],
)
def test_a_bad_template_is_one_clear_error(template: str, words: str) -> None:
    with pytest.raises(TakeError) as caught:
        TakeNames(template)
    assert words in caught.value.what and repr(template) in caught.value.what and caught.value.action


def test_a_name_too_long() -> None:
    with pytest.raises(TakeError, match="bytes"):
        TakeNames(performer="手" * 61).name(1, WHEN)


def test_every_field_can_be_used() -> None:
    assert TakeNames("{take}" + "".join(f"-{{{field}}}" for field in FIELDS if field != "take")).name(1, WHEN)


def test_numbers_advance_over_what_exists(tmp_path: Path) -> None:
    names = TakeNames(performer="Anna", shot="12")
    assert names.next_take(tmp_path, WHEN) == 1
    assert names.next_take(tmp_path / "absent", WHEN) == 1
    for name in ("Anna_12_001.mcap", "anna_12_009.MCAP", "Anna_12_040.txt", "Anna_120_050.mcap", "Bea_12_060.mcap"):
        (tmp_path / name).touch()
    (tmp_path / "Anna_12_070_recovered.mcap").touch()
    assert names.next_path(tmp_path, WHEN) == tmp_path / "Anna_12_010.mcap"
    (tmp_path / "Anna_12_1234.mcap").touch()
    assert names.next_take(tmp_path, WHEN) == 1235


def test_numbers_advance_whatever_the_time_of_day(tmp_path: Path) -> None:
    names = TakeNames("{date}_{time}_{take}.{take:02}")
    (tmp_path / "2025-03-14_08-00-00_3.03.mcap").touch()
    (tmp_path / "2025-03-13_08-00-00_9.09.mcap").touch()
    assert names.next_path(tmp_path, WHEN).name == "2025-03-14_15-09-26_4.04.mcap"


def test_never_an_existing_file(tmp_path: Path) -> None:
    names = TakeNames("{take}")
    (tmp_path / "1.mcap").touch()
    (tmp_path / "2.mcap").symlink_to(tmp_path / "1.mcap")
    assert names.next_path(tmp_path, WHEN).name == "3.mcap"


@given(st.text(max_size=40), st.text(max_size=40), st.integers(1, 10**6))
def test_whatever_is_typed_gives_a_file_name(performer: str, shot: str, take: int) -> None:
    try:
        name = TakeNames(performer=performer, shot=shot).name(take, WHEN)
    except TakeError:
        assert len((performer + shot).encode("utf-8", "replace")) > 120
        return
    assert str(take) in name and safe_name(name) == name
    assert not set(name) & set('<>:"/\\|?*') and not any(ord(letter) < 32 for letter in name)
    assert name not in (".", "..") and not name.endswith((".", " "))
    assert Path("folder", name + ".mcap").parent == Path("folder")
