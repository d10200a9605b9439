"""File names out of take names."""

from __future__ import annotations

import re

_FORBIDDEN = re.compile(r'[<>:"/\\|?*\x00-\x1f]')
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
_LONGEST = 150


def file_stem(name: str) -> str:
    """A take's name as a file name on every system, without an extension."""
    stem = _FORBIDDEN.sub("_", name).strip(" .")[:_LONGEST] or "take"
    return f"_{stem}" if _RESERVED.fullmatch(stem) else stem
