"""How large the hands of the profile in use are: found from the motion, one of five sizes, or the profile's own."""

from __future__ import annotations

import numpy as np

from core.hand.measures import measure
from core.hand.shape import HandShape
from core.hand.sizes import GLOVE_MM, SIZES
from core.profile import Profile

FROM_MOTION = "From the motion"
CALIBRATED = "Calibrated"
SIZE_NAMES = (FROM_MOTION, *SIZES)
"""What every profile can be given; CALIBRATED is what it brings along."""


def hand_size(profile: Profile) -> str:
    """What is in use: FROM_MOTION, a name of SIZES, or CALIBRATED."""
    if profile.scale is None and np.array_equal(profile.shape.ratios, HandShape.generic().ratios):
        return FROM_MOTION
    if profile.scale == 1.0:
        for name, shape in SIZES.items():
            if np.allclose(profile.shape.ratios, shape.ratios, rtol=0.0, atol=1e-6):
                return name
    return CALIBRATED


def sized(profile: Profile, name: str) -> Profile:
    """The same performer and glove with hands of this size, which no calibration found. name: of SIZE_NAMES."""
    if name == FROM_MOTION:
        return profile.with_hand(shape=HandShape.generic(), scale=None)
    return profile.with_hand(shape=SIZES[name], scale=1.0)


def size_title(name: str) -> str:
    """A choice in a list: sizes with the length of their hand."""
    return f"{name} · {GLOVE_MM[name][0]:.0f} mm" if name in GLOVE_MM else name


def size_words(name: str) -> str:
    """What a choice means, in millimetres where it has any."""
    if name == FROM_MOTION:
        return "Generic proportions; the size is found while the hand moves."
    if name == CALIBRATED:
        return "The hand that the profile brings along."
    length_mm, circumference_mm = GLOVE_MM[name]
    glove = 6 + tuple(GLOVE_MM).index(name)
    return f"{length_mm:.0f} mm long, {circumference_mm:.0f} mm around the knuckles: glove size {glove} (EN 420)."


def hand_words(profile: Profile) -> str:
    """What the profile's hand measures; of a size yet to be found, what it starts from."""
    measures = measure(profile.hand)
    mm = 1e3 * (profile.scale or 1.0)
    return (
        f"{measures.length * mm:.0f} mm long, {measures.breadth * mm:.0f} mm broad and "
        f"{measures.circumference * mm:.0f} mm around the knuckles"
    )
