r"""Texts from elsewhere (a server, a file, a person) that do nothing where they are shown: no control characters.

A terminal obeys `\x1b[2J`, a table breaks at a tab, `U+202E` turns what follows around, two names that differ in an
invisible character look the same, half a surrogate cannot be written at all. Each such character is shown instead, as
Python writes it: `\x1b`, `\t`, `\u202e`, `\udc80`. None is left out: two names that differ stay different.
"""

from __future__ import annotations

import re
import zlib

MOST_OF_NAME, MOST_OF_TEXT = 200, 2000
"""Characters of a name and of a sentence that are kept, beginning and end; the rest gives way to a checksum."""

_ACTS = (
    "\x00-\x1f\x7f-\x9f"  # C0, delete, C1
    "\u00ad\u034f\u061c\u115f\u1160\u17b4\u17b5\u180e\u200b\u2060-\u2065\u3164\ufeff\uffa0\ufff0-\ufffb"  # invisible
    "\u200e\u200f\u202a-\u202e\u2066-\u206f"  # turn the direction of writing
    "\u2028\u2029"  # end a line or a paragraph
    "\ud800-\udfff"  # halves of characters, such as Python makes of bytes that are no text
    "\U000e0000-\U000e0fff"  # tags
)
_JOINS = r"(?<![^\x00-\x7f])[\u200c\u200d]|[\u200c\u200d](?![^\x00-\x7f])"
"""Joiners belong into words of many scripts and into emoji, and nowhere beside a letter of the Latin ones."""
_NAME = re.compile(f"[{_ACTS}]|{_JOINS}")
_LINES = re.compile(f"(?![\n\t])[{_ACTS}]|{_JOINS}")


def printable(name: object, most: int = MOST_OF_NAME) -> str:
    """A name or a sentence on one line, at most `most` characters long. The same again if it is one already."""
    text = str(name)
    if len(text) <= most and text.isascii() and text.isprintable():  # as nearly all are, and some in every frame
        return text
    return shortened(_NAME.sub(_shown, text), most)


def named(name: object, otherwise: str) -> str:
    """A name as `printable` makes it, `otherwise` where there is nothing of it to be seen: blanks, of any width."""
    text = printable(name)
    return text if text.replace("\u2800", "").strip() else otherwise


def printable_lines(text: object) -> str:
    """A text of several lines and any length: its newlines and tabs stay, those of Windows as newlines."""
    return _LINES.sub(_shown, str(text).replace("\r\n", "\n"))


def printable_json(text: str) -> str:
    """JSON whose strings hold nothing that a terminal obeys: escaped as JSON does it, so that it says the same."""
    return _LINES.sub(lambda match: _utf16(match.group()), text)


def shortened(text: str, most: int = MOST_OF_TEXT) -> str:
    """Beginning and end of a text that is too long, with its checksum: other long texts are shortened to others."""
    if len(text) <= most:
        return text
    left_out = f"… {zlib.crc32(text.encode('utf-8', 'surrogatepass')):08x} …"
    kept = most - len(left_out)
    return text[: kept - kept // 2] + left_out + text[len(text) - kept // 2 :]


def _shown(match: re.Match[str]) -> str:
    return match.group().encode("unicode_escape").decode("ascii")


def _utf16(character: str) -> str:
    data = character.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{data[i : i + 2].hex()}" for i in range(0, len(data), 2))
