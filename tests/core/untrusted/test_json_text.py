from __future__ import annotations

import time
from pathlib import Path

import pytest

from core.errors import FormatError
from core.untrusted.json_text import DEEPEST, MOST_BYTES, MOST_VALUES, parse_json, read_json


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[" * 200_000, "lists lie 200,000 deep within each other"),
        ('{"a":' * 100_000, "100,000 deep"),
        ("[" * (DEEPEST + 1) + "]" * (DEEPEST + 1), "33 deep"),
        ('"' + '\\"' * 200_000, "is not JSON"),
        ("1" * 5000, "the number 111111111111... of 5,000 digits is too large"),
        ("-9223372036854775808", "of 19 digits is too large"),
        ("[1e999]", "the number 1e999 is too large"),
        ("[NaN]", "NaN stands where a number is meant"),
        ("[-Infinity]", "-Infinity stands"),
        ('{"scale": 1, "scale": 2}', "'scale' stands there twice"),
        ("{" + "".join(f'"{i}":0,' for i in range(500_000)) + '"z":0,"z":0}', "'z' stands there twice"),
        ("[" + "[]," * MOST_VALUES + "0]", "it holds 2,097,154 values, 1,048,576 at most are read"),
        ('[{"":0}' + ',{"":0}' * MOST_VALUES + "]", "at most are read"),
        ("0" + ",0" * MOST_VALUES, "it holds 1,048,577 values"),
        ("]" * MOST_BYTES, "is not JSON"),
        ('["\\ud800"]', "half a character"),
        ("{", "is not JSON"),
        ("", "is not JSON"),
        (b'\xff\xfe{"a": 1}', "it is no text in UTF-8 from byte 0 on"),
        (" " * (MOST_BYTES + 1), "more than the 16,777,216 that are read"),
    ],
    ids=lambda value: str(value)[:24],
)
def test_what_is_not_sound_is_told_at_once(text: str | bytes, told: str) -> None:
    began = time.monotonic()
    with pytest.raises(FormatError, match="The profile ") as raised:
        parse_json(text, "The profile", "Choose another.")
    assert told in raised.value.what and raised.value.action == "Choose another."
    assert len(raised.value.what) < 300
    assert time.monotonic() - began < 30.0


def test_what_is_sound_is_read(tmp_path: Path) -> None:
    deep = "[" * (DEEPEST - 1) + "]" * (DEEPEST - 1)
    values = r'[9223372036854775807, 1e308, "[[\"]]\\", "\ud83d\ude00", null, true]'
    path = tmp_path / "sound.json"
    path.write_text(f'\ufeff{{"a": {values}, "b": {deep}}}', encoding="utf-8")
    data = read_json(path, "It", "")
    assert data["a"] == [9223372036854775807, 1e308, '[["]]\\', "\U0001f600", None, True]


def test_brackets_in_texts_are_no_depth() -> None:
    text = "[" * 1000
    assert parse_json(f'["{text}", "\\\\", "{text}"]', "It", "") == [text, "\\", text]
