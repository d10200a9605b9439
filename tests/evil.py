"""Names that do something where they are shown, and records that hold them as another program may have written them."""

from __future__ import annotations

import os
import unicodedata
from typing import TypeVar

EVIL = "Ann\x1b[2J\nFORGED\t<b>x</b>\x9b31m\u202egpj&\x7f\u2028"
"""Clears a screen, begins a line of its own, is a cell more, is markup, colours, turns around."""
EVIL_FILE = os.fsdecode(b"=take\x1b[2J\nFORGED\xe9<i>")
"""The same of a file, with a byte that is no text."""
SHOWN = r"Ann\x1b[2J\nFORGED\t<b>x</b>\x9b31m\u202egpj&\x7f\u2028"

Record = TypeVar("Record")


def holding(record: Record, **values: object) -> Record:
    """A record with values that its own checks would have mended."""
    for name, value in values.items():
        object.__setattr__(record, name, value)
    return record


def acting(text: str) -> set[str]:
    """Characters of a text that act where it is shown, beside newlines and tabs."""
    return {
        c
        for c in text
        if c not in "\n\t" and (unicodedata.category(c) in ("Cc", "Cs", "Zl", "Zp") or c in "\u202d\u202e\u200b\ufeff")
    }


def assert_calm(text: str) -> None:
    """Nothing in it acts, and no line of it is a name's own."""
    assert not acting(text), sorted(map(ascii, acting(text)))
    assert not [line for line in text.splitlines() if line.startswith("FORGED")], text
