"""Which columns with three axes are no positions, by their titles: rotations, velocities, accelerations.

RB-RX,RB-RY,RB-RZ beside RB-X,RB-Y,RB-Z, or Tip_rot_x, Tip Velocity X. A lone R or Q before the axis is a rotation only
where the file's other titles show that it is no part of a name: Thumb_RX may be the right thumb.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

_WORD = re.compile(r"(.*[\s_.:/|-])?(rot|quat|euler|vel|acc|angles?|omega)|(.*[A-Za-z0-9])?(Rot|Quat|Euler|Vel|Acc)")
_LONG_WORD = re.compile(
    r".*(rotations?|quaternions?|orientations?|velocity|velocities|accelerations?|euler[\s_]?angles?)", re.IGNORECASE
)
_LETTER = re.compile(r"(.*?)([\s_.:/|-]*)[RQ]", re.IGNORECASE)


def no_places(names: Sequence[str], joined: Sequence[bool]) -> list[bool]:
    """Of markers' names, which are none. joined: whether the axis stands at each name with nothing between."""
    places = {name for name in names if name}
    all_joined = all(joined)
    return [_is_none(name, at, places, all_joined) for name, at in zip(names, joined, strict=True)]


def _is_none(name: str, joined: bool, places: set[str], all_joined: bool) -> bool:
    if _WORD.fullmatch(name) or _WORD.fullmatch(name.lower()) or _LONG_WORD.fullmatch(name):
        return True
    letter = _LETTER.fullmatch(name) if joined else None
    return letter is not None and (letter[1] in places if all_joined else bool(letter[2] or letter[1] in places))
