"""File names out of take names, and names of performers that stand before those of markers and joints."""

from __future__ import annotations

import re
from collections.abc import Sequence

from core.printable import MOST_OF_TEXT, printable

_FORBIDDEN = re.compile(r'[<>:"/\\|?*\x00-\x1f]')
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
_BREAKS = re.compile(r'[\s<>:"/\\|?*\x00-\x1f]+')
_LONGEST, _LONGEST_BYTES = 150, 180
_LONGEST_SUBJECT = 32


def file_stem(name: str) -> str:
    """A take's name as a file name on every system, without an extension."""
    stem = _FORBIDDEN.sub("_", printable(name, MOST_OF_TEXT)).strip(" .")[:_LONGEST]
    stem = stem.encode()[:_LONGEST_BYTES].decode(errors="ignore") or "take"
    return f"_{stem}" if _RESERVED.fullmatch(stem) else stem


def subject_names(performers: Sequence[str]) -> tuple[str, ...]:
    """Names of performers without what names of joints or files may not hold, such as spaces; all different still."""
    subjects: list[str] = []
    for name in performers:
        base = candidate = _BREAKS.sub("_", name)[:_LONGEST_SUBJECT]
        number = 1
        while candidate.casefold() in (other.casefold() for other in subjects):
            number += 1
            candidate = f"{base}_{number}"
        subjects.append(candidate)
    return tuple(subjects)
