"""Joint limits of one performer, where they are not the template's: how far each joint goes at most.

    "limits": {"index_mcp_flexion": [-20, 95], "thumb_ip_flexion": [-30, 85]}

in a profile: names of digit angles (core.hand.skeleton.DIGIT_DOF_NAMES), degrees, lower limit first. Angles that are
not named keep the template's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

import numpy as np

from core.errors import FormatError
from core.hand.skeleton import DIGIT_DOF_NAMES, Skeleton
from core.untrusted.values import is_number, shown

LOWEST_DEG, HIGHEST_DEG = -180.0, 180.0

LEAST_RANGE_DEG = 1.0
"""A joint that cannot move at all cannot be solved."""

_LONGEST = max(map(len, DIGIT_DOF_NAMES))


@dataclass(frozen=True)
class JointLimits:
    """degrees: a digit angle, its lower and its upper limit [degrees] as written, in the order of DIGIT_DOF_NAMES."""

    degrees: tuple[tuple[str, float, float], ...] = ()

    def __bool__(self) -> bool:
        """Is there any?"""
        return bool(self.degrees)

    @property
    def words(self) -> str:
        """'index_mcp_flexion -20 to 95 degrees, ...'; "" where there are none."""
        return ", ".join(f"{name} {low:g} to {high:g} degrees" for name, low, high in self.degrees)

    def on(self, skeleton: Skeleton) -> Skeleton:
        """The same skeleton with these limits; itself where there are none."""
        if not self.degrees:
            return skeleton
        limits_rad = skeleton.limits_rad.copy()
        for name, low, high in self.degrees:
            limits_rad[DIGIT_DOF_NAMES.index(name)] = np.radians((low, high))
        return replace(skeleton, limits_rad=limits_rad)

    def to_dict(self) -> dict[str, list[float]]:
        """The JSON form."""
        return {name: [low, high] for name, low, high in self.degrees}

    @classmethod
    def from_dict(cls, data: Any, source: str) -> JointLimits:
        """Raises FormatError naming `source`, the angle and its value."""
        if not isinstance(data, dict):
            raise FormatError(
                f"{source}: {shown(data)}.", 'Write {"index_mcp_flexion": [-20, 95]}: names of angles, degrees.'
            )
        for name, limits in data.items():
            if name not in DIGIT_DOF_NAMES:
                near = get_close_matches(name[:_LONGEST], DIGIT_DOF_NAMES, 1) or DIGIT_DOF_NAMES[5:6]
                raise FormatError(
                    f"{source}: {shown(name)} is no angle of a digit.", f"Name one as in angles.csv, such as {near[0]}."
                )
            if not _within(limits):
                raise FormatError(
                    f"{source}: {name} {shown(limits)}.",
                    f"Give the lower limit, then the upper one, in degrees between {LOWEST_DEG:g} and "
                    f"{HIGHEST_DEG:g}, {LEAST_RANGE_DEG:g} degree apart or more.",
                )
        named = [(name, data[name]) for name in DIGIT_DOF_NAMES if name in data]
        return cls(tuple((name, float(low), float(high)) for name, (low, high) in named))


def limits_deg(skeleton: Skeleton) -> dict[str, list[float]]:
    """Lower and upper limit [degrees] of every digit angle, as a profile would have them."""
    limits = np.round(np.degrees(skeleton.limits_rad), 6)
    return dict(zip(DIGIT_DOF_NAMES, limits.tolist(), strict=True))


def _within(limits: Any) -> bool:
    if not isinstance(limits, list) or len(limits) != 2:
        return False
    if not all(map(is_number, limits)):
        return False
    low, high = limits
    return bool(low >= LOWEST_DEG and low + LEAST_RANGE_DEG <= high <= HIGHEST_DEG)
