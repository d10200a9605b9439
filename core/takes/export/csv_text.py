"""Names and notes in CSV: a spreadsheet computes a cell that begins like a formula, whoever wrote it."""

from __future__ import annotations

_FORMULA = ("=", "+", "-", "@")


def csv_text(text: str) -> str:
    """The same text; where a spreadsheet would take it for a formula, with an apostrophe before it."""
    return f"'{text}" if text.startswith(_FORMULA) else text
