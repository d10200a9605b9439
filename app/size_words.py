"""What there is to doubt of the size at which hands were found."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from app.hand_tally import HandFigures
from core.cast import Cast, hand_names
from core.frames import HandKey
from core.kinematics.kernels import SMALLEST

SHORTEST_M, LONGEST_M = 0.110, 0.270
"""From the wrist to the tip of the middle finger. Wide: gloves of grown-ups are made for 0.16 to 0.204 m
(core.hand.sizes)."""

MOST_APART = 0.15
"""By how much the longer hand of one person may be longer than the other."""

_AT_THE_END = 1.005
"""A size within this factor of the smallest that the solver tries is not where the markers fit best."""


def size_words(hands: Mapping[str, HandFigures], cast: Cast) -> Iterator[str]:
    """A sentence for each size found from the motion that cannot be. hands: by name, as app.hand_tally has them."""
    names = hand_names(cast)
    keys = [key for key, name in names.items() if name in hands and cast[key.performer].scale is None]
    lengths_m = {key: hands[names[key]].length_m for key in keys}
    for key, length_m in lengths_m.items():
        why = ""
        if not SHORTEST_M <= length_m <= LONGEST_M and math.isfinite(length_m):
            why = f"hands are {1000 * SHORTEST_M:.0f} to {_mm(LONGEST_M)} long"
        elif length_m < _AT_THE_END * SMALLEST * cast[key.performer].hand.skeleton.length_m:
            why = "no shorter one is looked for"
        if why:
            found = f"The {names[key]} hand was found {_mm(length_m)} long, and {why}"
            yield f"{found}: check the unit of the file and the layout."
    for performer in range(len(cast)):
        left, right = (HandKey(performer, side) for side in ("left", "right"))
        if left in lengths_m and right in lengths_m:
            pair = sorted((lengths_m[left], lengths_m[right]))
            if pair[1] > (1.0 + MOST_APART) * pair[0]:
                yield (
                    f"The {names[left]} hand was found {_mm(lengths_m[left])} long and the {names[right]} one "
                    f"{_mm(lengths_m[right])}: nobody has two such hands; check that the markers are those of the "
                    "layout."
                )


def _mm(length_m: float) -> str:
    return f"{1000 * length_m:.0f} mm"
