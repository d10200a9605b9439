"""JSON that others wrote: of bounded size and depth, with numbers that are numbers and names that stand once."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np

from core.errors import FormatError
from core.untrusted.files import decoded, read_bytes
from core.untrusted.values import LARGEST_WHOLE

MOST_BYTES = 1 << 24
"""Of a file; a profile with everything in it has less than half a megabyte."""

DEEPEST = 32
"""Lists and objects within each other. No file of ours has more than ten."""

_MOST_DIGITS = 20
_STRING = re.compile(r'"(?:[^"\\]++|\\.?)*+"?', re.DOTALL)
_HALF_PAIR = re.compile(r"\\u[dD][89a-fA-F]")


class _UnsoundError(ValueError):
    """What is wrong is said in words."""


def read_json(path: Path, source: str, mend: str, most: int = MOST_BYTES) -> Any:
    """What a JSON file holds. source: what it is called in messages, mend: what to do about it.

    Raises FormatError where it is no file, too large, too deep, no JSON, or holds numbers that are none.
    """
    try:
        data = read_bytes(path, most)
    except OSError as error:
        raise FormatError(f"{source} cannot be read ({error.strerror or error}).", mend) from error
    return parse_json(data, source, mend)


def parse_json(text: str | bytes, source: str, mend: str, most: int = MOST_BYTES) -> Any:
    """What a JSON text holds. Raises FormatError as `read_json`."""
    try:
        if len(text) > most:
            raise _UnsoundError(f"it has {len(text):,} characters, more than the {most:,} that are read")
        text = decoded(text) if isinstance(text, bytes) else text
        _check_depth(text)
        value = json.loads(
            text, parse_int=_whole, parse_float=_real, parse_constant=_no_constant, object_pairs_hook=_once
        )
        if _HALF_PAIR.search(text):
            json.dumps(value, ensure_ascii=False).encode("utf-8")
    except OSError as error:
        raise FormatError(f"{source} cannot be read ({error.strerror}).", mend) from error
    except UnicodeEncodeError as error:
        raise FormatError(f"{source} is not sound: it holds half a character, such as \\ud800.", mend) from error
    except _UnsoundError as error:
        raise FormatError(f"{source} is not sound: {error}.", mend) from error
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{source} is not JSON ({error}).", mend) from error
    return value


def _check_depth(text: str) -> None:
    """Before anything is made of it: what goes through its values one within the other would run out of stack."""
    outside = np.frombuffer(_STRING.sub("", text).encode("utf-8", "replace"), dtype=np.uint8)
    begins, ends = (np.isin(outside, list(marks)) for marks in (b"[{", b"]}"))
    depth = np.cumsum(begins.astype(np.int8) - ends.astype(np.int8), dtype=np.int32).max(initial=0)
    if depth > DEEPEST:
        raise _UnsoundError(f"lists lie {depth:,} deep within each other, {DEEPEST} at most are read")


def _whole(digits: str) -> int:
    if len(digits) > _MOST_DIGITS or abs(int(digits)) >= LARGEST_WHOLE:
        raise _UnsoundError(f"the number {digits[:12]}... of {len(digits.lstrip('-')):,} digits is too large")
    return int(digits)


def _real(digits: str) -> float:
    value = float(digits)
    if not math.isfinite(value):
        raise _UnsoundError(f"the number {digits[:20]} is too large")
    return value


def _no_constant(name: str) -> float:
    raise _UnsoundError(f"{name} stands where a number is meant")


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    data = dict(pairs)
    if len(data) != len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in data if names.count(name) > 1)
        raise _UnsoundError(f"{twice[:40]!r} stands there twice")
    return data
