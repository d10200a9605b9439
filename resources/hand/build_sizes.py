"""Writes sizes.json, the shapes of the five glove sizes.

    python -m resources.hand.build_sizes [sizes.json]

core/hand/sizes.py has the glove sizes, core/hand/tape.py the way from measures to a shape.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from core.hand.sizes import GLOVE_MM
from core.hand.tape import shape_of_measures


def build() -> dict[str, dict[str, float]]:
    """What sizes.json holds: ratios by name for each size."""
    return {
        name: shape_of_measures({"length": length_mm / 1e3, "circumference": circumference_mm / 1e3}).to_dict()
        for name, (length_mm, circumference_mm) in GLOVE_MM.items()
    }


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("sizes.json")
    target.write_text(json.dumps(build(), indent=1) + "\n", encoding="utf-8")
    print(f"{target} written")
