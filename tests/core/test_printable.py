"""Texts from elsewhere do nothing where they are shown, and stay different."""

from __future__ import annotations

import json
import sys
import unicodedata

import pytest

from core.errors import FormatError
from core.printable import MOST_OF_NAME, MOST_OF_TEXT, printable, printable_json, printable_lines, shortened

BAD = {
    "\x1b[2J": r"\x1b[2J",
    "a\nb": r"a\nb",
    "a\tb": r"a\tb",
    "a\r\nb": r"a\r\nb",
    "\x9b31m": r"\x9b31m",
    "\x7f": r"\x7f",
    "Anna\u202egpj": r"Anna\u202egpj",
    "An\u200bna": r"An\u200bna",
    "a\u2028b": r"a\u2028b",
    "caf\udce9": r"caf\udce9",
    "\ufeffAnna": r"\ufeffAnna",
    "Ann\u200da": r"Ann\u200da",
}
GOOD = ("Zoë", "Łukasz", "山田　太郎", "محمد", "می\u200cخواهم", "👩\u200d🔬", "R&D <b>x</b>", "50\u00a0%", "x\u0301")


@pytest.mark.parametrize(("text", "shown"), BAD.items())
def test_what_acts_or_hides_is_shown(text: str, shown: str) -> None:
    assert printable(text) == shown
    assert printable(shown) == shown


@pytest.mark.parametrize("text", GOOD)
def test_names_of_people_stay(text: str) -> None:
    assert printable(text) == text
    assert printable_lines(text) == text


def test_no_control_character_of_all_that_there_are_passes() -> None:
    every = [chr(i) for i in range(sys.maxunicode + 1)]
    bad = [c for c in every if unicodedata.category(c) in ("Cc", "Cs", "Zl", "Zp")]
    bad += [
        c
        for c in every
        if unicodedata.bidirectional(c) in ("LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI")
    ]
    assert len(bad) > 2000
    for character in bad:
        shown = printable(f"a{character}b")
        assert character not in shown
        assert shown.isascii()
        assert shown != "ab"
    assert len({printable(c) for c in bad}) == len(set(bad))


def test_lines_stay_lines() -> None:
    assert printable_lines("one\r\ntwo\tthree\x1b[0m\n") == "one\ntwo\tthree\\x1b[0m\n"


@pytest.mark.parametrize("most", (MOST_OF_NAME, MOST_OF_TEXT))
def test_long_ones_are_shortened_and_stay_different(most: int) -> None:
    long = "x" * 10**6
    others = {shortened(long[:k] + character + long[k:], most) for k in (0, 5, 500_000) for character in "abc"}
    assert len(others) == 9
    assert {len(text) for text in others} == {most}
    once = printable("\x1b" * 10**6, most)
    assert len(once) == most
    assert printable(once, most) == once


def test_json_says_the_same_and_holds_nothing_that_acts() -> None:
    said = ["\x1b[2J", "\x9b", "\x7f", "\u202e", "\udce9", "\U000e0041", "Zoë", "a\nb"]
    text = printable_json(json.dumps(said, ensure_ascii=False))
    assert json.loads(text) == said
    assert printable_lines(text) == text
    assert "Zoë" in text


def test_an_error_is_one_line_whatever_it_quotes() -> None:
    error = FormatError("Profile a\n\x1b[2Jb is no profile.", "Choose \u202eanother.")
    assert str(error) == r"Profile a\n\x1b[2Jb is no profile. Choose \u202eanother."
    assert len(str(FormatError("x" * 10**6, "y" * 10**6))) <= 2 * MOST_OF_TEXT + 1
