"""Values out of a file: what is no number, no text or too long is told with its name and value."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from core.errors import FormatError
from core.frames import SIDES, FloatArray, Side

LONGEST_NAME = 200
LONGEST_TEXT = 10_000
LARGEST_WHOLE = 1 << 63
"""Above what every program can hold; not every such number is one in floating point."""

_SHOWN = 60


def shown(value: Any) -> str:
    """A value for a message, on one line and not the whole of a long one."""
    text = repr(value)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def is_number(value: Any) -> bool:
    """A finite number, which True is not."""
    if isinstance(value, float):
        return math.isfinite(value)
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < LARGEST_WHOLE


def numbers(value: Any, *shape: int) -> FloatArray:
    """(*shape) float64 of a list, of lists where there are several lengths; the first may be -1: any.

    Raises ValueError saying what stands there instead.
    """
    flat: list[float] = []
    length = _collect(value, shape, flat)
    return np.asarray(flat, dtype=np.float64).reshape(length, *shape[1:])


def text_of(
    data: Mapping[str, Any], key: str, source: str, default: str | None = None, most: int = LONGEST_TEXT
) -> str:
    """The text under a key, `default` where there is none. Raises FormatError naming `source`, key and value."""
    value = data.get(key, default)
    if not isinstance(value, str) or len(value) > most:
        raise FormatError(f"{source}: {key} {shown(value)}.", f"It must be a text of at most {most:,} characters.")
    return value


def sides_of(value: Any, source: str) -> tuple[Side, ...]:
    """Some hands, in the order of SIDES. Raises FormatError."""
    if not isinstance(value, list | tuple) or not value or any(side not in SIDES for side in value):
        raise FormatError(f"{source}: sides {shown(value)}.", 'List "left", "right" or both.')
    return tuple(side for side in SIDES if side in value)


def _collect(value: Any, shape: tuple[int, ...], flat: list[float]) -> int:
    if not isinstance(value, list) or (shape[0] >= 0 and len(value) != shape[0]):
        wanted = "a list" if shape[0] < 0 else f"a list of {shape[0]}"
        raise ValueError(f"{shown(value)} is not {wanted}")
    for each in value:
        if len(shape) > 1:
            _collect(each, shape[1:], flat)
        elif is_number(each):
            flat.append(float(each))
        else:
            raise ValueError(f"{shown(each)} is not a number")
    return len(value)
