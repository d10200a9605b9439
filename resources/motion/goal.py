"""What each pose of the library is meant to be, before build_poses.py makes it exact.

A goal is a sketch in degrees, the places that must touch, and what is held, roughly where it is held. Sketches were
written by us from the names and descriptions of the sources; no data set's poses are in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from core.hand.skeleton import DIGITS

Row = tuple[float, float, float, float]


@dataclass(frozen=True)
class Held:
    """A prop, sketched: its lengths [mm], its middle [mm] and the directions of its z and x axes in the hand frame."""

    shape: str
    size_mm: tuple[float, ...]
    position_mm: tuple[float, float, float]
    z_axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    x_axis: tuple[float, float, float] = (1.0, 0.0, 0.0)


@dataclass(frozen=True)
class Goal:
    """One pose to be solved; sketch_deg: five rows of four angles [degrees]."""

    name: str
    activity: str
    source: str
    sketch_deg: tuple[Row, Row, Row, Row, Row]
    contacts: tuple[tuple[str, str], ...] = ()
    held: Held | None = None


# A finger by its shape: MCP, PIP and DIP flexion [degrees].
SHAPES: dict[str, tuple[float, float, float]] = {
    "straight": (0, 3, 2),
    "back": (-26, -4, -3),
    "loose": (16, 22, 12),
    "curled": (30, 45, 28),
    "round": (45, 50, 30),
    "closed": (86, 98, 54),
    "loosely closed": (66, 80, 44),
    "hook": (6, 92, 50),
    "claw": (2, 58, 36),
    "bent": (84, 5, 3),
    "half bent": (48, 5, 3),
    "flat fist": (86, 100, 8),
}

# A thumb by its shape: CMC flexion, CMC abduction, MCP flexion, IP flexion [degrees].
THUMBS: dict[str, Row] = {
    "rest": (0, 0, 0, 0),
    "loose": (8, 14, 10, 14),
    "across": (38, 28, 44, 46),
    "over": (40, 30, 36, 40),
    "out": (-22, 0, -8, -10),
    "up": (-24, 8, -10, -12),
    "along": (14, -18, 6, 4),
    "palm": (40, 12, 45, 30),
    "opposed": (34, 30, 13, 8),
    "front": (16, 44, 10, 12),
}

_ABDUCTION: dict[str, tuple[float, float, float, float]] = {
    "closed": (-2, 0, -2, -4),
    "together": (-5, 0, -5, -10),
    "natural": (0, 0, 0, 0),
    "spread": (13, 0, 10, 15),
}


def digits(
    thumb: str | Row, fingers: str | Sequence[str | Row], abduction: str | Sequence[float] = "natural"
) -> tuple[Row, Row, Row, Row, Row]:
    """A sketch from shapes; `fingers` one for all, or index to pinky; a row of four numbers stands for itself."""
    each = [fingers] * 4 if isinstance(fingers, str) else fingers
    apart = _ABDUCTION[abduction] if isinstance(abduction, str) else tuple(abduction)
    rows = [
        ((_ABDUCTION["closed"][i] if shape in ("closed", "flat fist") else apart[i], *SHAPES[shape])
         if isinstance(shape, str) else shape)
        for i, shape in enumerate(each)
    ]  # fmt: skip
    return (THUMBS[thumb] if isinstance(thumb, str) else thumb, rows[0], rows[1], rows[2], rows[3])


def up(*raised: str, shape: str = "straight", rest: str = "closed") -> list[str | Row]:
    """Four finger shapes: those named raised, the others closed."""
    return [shape if digit in raised else rest for digit in DIGITS[1:]]
