"""Whether the last number of a file was cut off: a part of a number is a number, too."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from itertools import pairwise

_SURE_ROWS = 3
_FAR_STEPS = 10.0


class Cut(Enum):
    """What a last number without a line break is taken for."""

    NO = "whole"
    MAYBE = "in doubt"
    YES = "cut off"


def last_number(cells: Sequence[str], before: Sequence[str], lacking: bool, one_column: bool = True) -> Cut:
    """Of the cells of a file's last row, which has no line break.

    before: the last cells of the rows before it, the newest at the end. lacking: the header promises more rows.
    one_column: they are of one marker, so that numbers in a row are near each other.
    Programs that write a fixed number of decimals are told by the rows before; those that leave out zeros at the end
    leave a doubt, unless the number is far from where it was.
    """
    last = cells[-1].strip()
    filled = [text for cell in before if (text := cell.strip())]
    if not filled or len({cell.strip() for cell in cells[-3:]}) == 1:  # a gap: three times nothing, or 0
        return Cut.YES if lacking and not last and filled else Cut.NO
    if not last:
        return Cut.YES
    usual = [_decimals(text) for text in filled]
    fewer = _decimals(last) < min(usual)
    shorter = len(last) < min(map(len, filled))
    if fewer and (lacking or (len(usual) >= _SURE_ROWS and len(set(usual)) == 1)):
        return Cut.YES
    if one_column and shorter and len(filled) >= _SURE_ROWS and _is_far(last, filled):
        return Cut.YES
    return Cut.MAYBE if fewer else Cut.NO


def _is_far(last: str, before: Sequence[str]) -> bool:
    """Whether a number is farther from the one before than any of those were from each other, by far."""
    values = [_value(text) for text in [*before, last]]
    steps = [abs(b - a) for a, b in pairwise(values)]
    return steps[-1] > _FAR_STEPS * max(*steps[:-1], 10.0 ** -min(map(_decimals, before)))


def _value(text: str) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return float("nan")  # far from nothing


def _decimals(cell: str) -> int:
    return len(cell.replace(",", ".").partition(".")[2])
