"""Names that are not UTF-8: which code page of Windows they were written in.

Programs for capture write names in the code page of their Windows, and none says which. Numbers, tabs and commas are
the same bytes in all of them, so a wrong guess spoils a name and never a value.
"""

from __future__ import annotations

import re
import unicodedata

WESTERN = "cp1252"
WORDS = {"gbk": "GBK (Chinese)", "cp932": "Shift-JIS (Japanese)", WESTERN: "Windows-1252 (Western European)"}
"""Code pages that are told apart, in words."""

_PAIR = re.compile(rb"[\x81-\xfe][\x40-\xfe]")
_COMMON_CHINESE = re.compile(rb"[\xb0-\xd7][\xa1-\xfe]")  # the 3,755 hanzi of GB 2312's first level
_JAPANESE_WORD = re.compile(rb"(?:[\x82\x83\x88-\x97][\x40-\xfc]){2}")  # kana, or kanji of the first level, in a row
_TWO_BYTE_RUN = re.compile("[\x80-\u07ff]+")


def of(head: bytes) -> str:
    """The code page of those lines that are not UTF-8; "" where all are."""
    foreign = [line for line in head.splitlines() if not is_utf8(line)]
    return guess(b"\n".join(foreign)) if foreign else ""


def is_utf8(line: bytes) -> bool:
    """Whether a line is UTF-8, and not by accident: some Chinese words in GBK are valid UTF-8 that nobody writes."""
    if line.isascii():
        return True
    try:
        text = line.decode()
    except UnicodeDecodeError:
        return False
    return not (any(map(_no_word, _TWO_BYTE_RUN.findall(text))) and guess(line) == "gbk")


def guess(names: bytes) -> str:
    """The code page in which bytes make the most usual characters."""
    pairs = _PAIR.findall(names)
    if 2 * sum(bool(_COMMON_CHINESE.fullmatch(pair)) for pair in pairs) > len(pairs) and _decodes(names, "gbk"):
        return "gbk"
    if _JAPANESE_WORD.search(names) and _decodes(names, "cp932"):
        return "cp932"
    return WESTERN


def decode(line: bytes, page: str) -> str:
    """A line of text, whatever it holds."""
    if page == WESTERN and not _decodes(line, page):
        return line.decode("latin-1")
    return line.decode(page, errors="replace")


def _decodes(line: bytes, page: str) -> bool:
    try:
        line.decode(page)
    except UnicodeDecodeError:
        return False
    return True


def _no_word(run: str) -> bool:
    """Whether letters that stand together are of different scripts, or no letters at all."""
    kinds = [unicodedata.category(letter) for letter in run]
    letters = [letter for letter, kind in zip(run, kinds, strict=True) if kind[0] in "LM"]
    scripts = {unicodedata.name(letter, "?").partition(" ")[0] for letter in letters}
    return len(scripts) > 1 or "Cc" in kinds or "Cn" in kinds
