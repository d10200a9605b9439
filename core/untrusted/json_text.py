"""JSON that others wrote: bounded in size, values and depth, with numbers that are numbers, names that stand once."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
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

MOST_VALUES = 1 << 20
"""Lists, objects and what is in them: each takes up to a hundred times the memory that it takes in the file."""

_MOST_DIGITS = 20
_STRING = re.compile(r'"(?:[^"\\]++|\\.?)*+"?', re.DOTALL)
_NO_BRACKETS = bytes(set(range(256)) - set(b"[]{}"))
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
        _check_extent(text)
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


def _check_extent(text: str) -> None:
    """Before anything is made of it: values would fill the memory, and what goes through those that lie one within the
    other would run out of stack."""
    outside = _STRING.sub("", text)
    values = 1 + sum(map(outside.count, ",[{"))
    if values > MOST_VALUES:
        raise _UnsoundError(f"it holds {values:,} values, {MOST_VALUES:,} at most are read")
    brackets = outside.encode("utf-8", "replace").translate(None, _NO_BRACKETS)[: 2 * MOST_VALUES]
    marks = np.frombuffer(brackets, dtype=np.uint8)
    depth = np.cumsum(np.where(np.isin(marks, list(b"[{")), 1, -1)).max(initial=0)
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
        (twice, _), *_ = Counter(name for name, _ in pairs).most_common(1)
        raise _UnsoundError(f"{twice[:40]!r} stands there twice")
    return data
