"""Hands by size: five glove sizes.

The sizes are those of protective gloves, EN 420:2003 (EN ISO 21420): 6 to 10, called XS to XL, each defined by the
length and the circumference of the hand that it fits; core.hand.tape finds the hand of which these two are true.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from types import MappingProxyType

from core.hand.shape import HandShape

GLOVE_MM = MappingProxyType(
    {"XS": (160.0, 152.0), "S": (171.0, 178.0), "M": (182.0, 203.0), "L": (192.0, 229.0), "XL": (204.0, 254.0)}
)
"""Hand length and circumference [mm] by size: EN 420 sizes 6, 7, 8, 9 and 10."""


def _load() -> Mapping[str, HandShape]:
    text = (files("resources") / "hand" / "sizes.json").read_text(encoding="utf-8")
    sizes = json.loads(text)
    return MappingProxyType({name: HandShape.from_dict(ratios, f"size {name}") for name, ratios in sizes.items()})


SIZES = _load()
"""Shape by size, XS to XL; resources.hand.build_sizes makes them."""
