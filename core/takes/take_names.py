"""Names of takes from a template, such as `{performer}_{shot}_{take:03}`: numbers that advance by themselves, file
names that every system accepts, never the name of a take that exists."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Callable, Collection
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from string import Formatter

from core.errors import TakeError
from core.printable import printable
from core.takes.rescue import RESCUED
from core.takes.take import EXTENSION

DEFAULT_TEMPLATE = "{performer}_{shot}_{take:03}"
FIELDS = {
    "take": "number, advances by itself; {take:03} is 007",
    "performer": "name of the performer",
    "shot": "shot or scene",
    "date": "day, 2025-03-14",
    "time": "time of day, 15-09-26",
}
"""What a template may contain, with a line for the tooltip."""

_MAX_BYTES = 180  # of 255 that file systems allow, to leave room for the suffixes of copies and exports
_FORBIDDEN = re.compile(r'[<>:"/\\|?*\x00-\x1f\x7f]')
_RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³])(\..*)?", re.IGNORECASE)
_WIDTH = re.compile(r"0?([1-9])")
_TIME_PATTERN = r"\d{2}-\d{2}-\d{2}"
_SEPARATORS = " _.-"
_ANY_TAKE, _ANY_TIME = "\ue000", "\ue001"  # private characters, in nobody's name


@dataclass(frozen=True)
class TakeNames:
    """A template with what to fill in. Raises TakeError for a template that cannot name takes."""

    template: str = DEFAULT_TEMPLATE
    performer: str = ""
    shot: str = ""

    def __post_init__(self) -> None:
        parts = self._parts()
        if not any(field == "take" for _, field, _ in parts):
            raise self._bad("has no take number", "Put {take} or {take:03} where the number belongs.")
        if match := _FORBIDDEN.search("".join(text for text, _, _ in parts)):
            raise self._bad(f"contains {match.group()!r}", "A take name is one file name, without such characters.")

    def name(self, take: int, when: datetime) -> str:
        """The name of a take, as in the preview. when: local time. Raises TakeError if it is too long."""
        name = self._fill(lambda width: str(take).zfill(width), when, f"{when:%H-%M-%S}")
        if (size := len(name.encode())) > _MAX_BYTES:
            raise TakeError(f"Take name {name[:40]}... takes {size} bytes.", f"Shorten it to {_MAX_BYTES}.")
        return name

    def next_take(self, folder: Path | str, when: datetime, used: Collection[str] = ()) -> int:
        """The number behind the highest that these names have in a folder; 1 if there is none. A folder that cannot
        be read counts as empty: creating the take there will say what is wrong. used: names of takes that count as if
        they were there."""
        shape = re.escape(self._fill(lambda width: _ANY_TAKE, when, _ANY_TIME))
        shape = shape.replace(_ANY_TAKE, r"(\d+)", 1).replace(_ANY_TAKE, r"\d+").replace(_ANY_TIME, _TIME_PATTERN)
        # Also a take that was rescued has used up its number. Case does not count: some systems compare names so.
        pattern = re.compile(rf"{shape}(?:{RESCUED}\d*)?", re.IGNORECASE)
        try:
            stems = [path.stem for path in Path(folder).iterdir() if path.suffix.lower() == EXTENSION]
        except OSError:
            stems = []
        matches = (pattern.fullmatch(unicodedata.normalize("NFC", stem)) for stem in (*stems, *used))
        return 1 + max((int(match[1]) for match in matches if match), default=0)

    def next_path(self, folder: Path | str, when: datetime, used: Collection[str] = ()) -> Path:
        """A file that does not exist, for the next take in a folder. used: as for `next_take`. Raises TakeError."""
        take = self.next_take(folder, when, used)
        while os.path.exists(path := Path(folder) / (self.name(take, when) + EXTENSION)):  # noqa: PTH110 - never raises
            take += 1
        return path

    def _fill(self, take: Callable[[int], str], when: datetime, time: str) -> str:
        values = {
            "performer": safe_name(self.performer),
            "shot": safe_name(self.shot),
            "date": f"{when:%Y-%m-%d}",
            "time": time,
        }
        name, empty = "", False
        for text, field, width in self._parts():
            name += text
            if field is not None:
                value = take(width) if field == "take" else values[field]
                empty |= not value
                name += value
        if empty:  # and with it one of the separators around it
            name = re.sub(rf"([{_SEPARATORS}])[{_SEPARATORS}]+", r"\1", name).strip(_SEPARATORS)
        return safe_name(name)

    def _parts(self) -> list[tuple[str, str | None, int]]:
        """(text, the field behind it, its width) of the template. Raises TakeError."""
        try:
            pieces = list(Formatter().parse(self.template))
        except ValueError as error:
            raise self._bad(
                f"cannot be read ({error})", "Fields are written {performer}, {shot}, {take:03}."
            ) from error
        parts: list[tuple[str, str | None, int]] = []
        for text, field, spec, conversion in pieces:
            if field is None:
                parts.append((text, None, 0))
                continue
            if field not in FIELDS:
                known = ", ".join("{" + name + "}" for name in FIELDS)
                raise self._bad(f"has the unknown field {{{field}}}", f"The fields are {known}.")
            width = _WIDTH.fullmatch(spec or "")
            if conversion or (spec and not (field == "take" and width)):
                raise self._bad(
                    f"has {{{field}{'!' + conversion if conversion else ''}:{spec}}}",
                    "Only the take number has a format: its digits, as in {take:03}.",
                )
            parts.append((text, field, int(width[1]) if width else 1))
        return parts

    def _bad(self, what: str, action: str) -> TakeError:
        return TakeError(f"The name template {self.template!r} {what}.", action)


def safe_name(text: str) -> str:
    """Text as a file name that Linux, macOS and Windows accept; "" stays "". The same text gives the same name."""
    name = _FORBIDDEN.sub("_", printable(unicodedata.normalize("NFC", text))).strip(" ").rstrip(" .")
    return f"_{name}" if _RESERVED.fullmatch(name) else name
