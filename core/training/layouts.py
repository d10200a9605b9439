"""Layouts to learn from: the shipped ones, varied, and ones that nobody wears, so that a new glove is no surprise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from core.frames import SIDES, FloatArray
from core.hand.model import template
from core.hand.skeleton import DIGITS
from core.markers.layout import MarkerLayout, load_layout

TAUGHT = {"han19": 0.45, "alexanderson13": 0.15, "schroeder17": 0.1, "qualisys13": 0.12}
"""Shipped layouts that the network is taught, each with its share of the training data; the rest are made up."""

_HEIGHTS_M = (0.0135, 0.0120, 0.0105)  # bone axis to marker centre, by bone from the palm
_BACK_HEIGHT_M = 0.018
_VARIED = 0.4
"""Share of the made-up layouts that are shipped ones with markers moved and left out."""


def drawn(random: np.random.Generator, own: MarkerLayout | None = None) -> MarkerLayout:
    """One layout to make clouds with. own: the only layout that matters, if there is one."""
    if own is not None:
        return own
    chance = random.random()
    for name, share in TAUGHT.items():
        chance -= share
        if chance < 0.0:
            return load_layout(name)
    if random.random() < _VARIED:
        return varied(random, load_layout(str(random.choice(list(TAUGHT)))))
    return made_up(random)


def varied(random: np.random.Generator, layout: MarkerLayout) -> MarkerLayout:
    """A layout with every marker moved by some millimetres and up to a quarter of them left out."""
    m = len(layout.marker_names)
    kept = np.sort(random.permutation(m)[: m - int(random.integers(m // 4 + 1))])
    return replace(
        layout,
        name=f"{layout.name}, varied",
        marker_names=tuple(layout.marker_names[k] for k in kept),
        joints=layout.joints[kept],
        positions_m=layout.positions_m[kept] + random.normal(0.0, 0.004, (len(kept), 3)),
    )


def made_up(random: np.random.Generator) -> MarkerLayout:
    """Two to six markers on the back of the hand and up to four on every digit, on its back or its sides."""
    places: list[tuple[str, int, FloatArray]] = []
    knuckles = template().skeleton.joint_positions_m[[4, 7, 10, 13]]
    for k in range(int(random.integers(2, 7))):
        across, along = random.uniform(0.0, 3.0), random.uniform(0.0, 1.0)
        left = min(int(across), 2)
        knuckle = knuckles[left] + (across - left) * (knuckles[left + 1] - knuckles[left])
        height_m = _BACK_HEIGHT_M + random.normal(0.0, 0.002)
        places.append((f"back{k + 1}", 0, along * knuckle * (1.0, 0.5, 1.0) + np.array([0.0, height_m, 0.0])))
    alike = np.sort(random.choice(_SLOTS, int(random.integers(1, 5)), replace=False))
    for digit in range(len(DIGITS)):
        slots = alike if random.random() < 0.7 else np.sort(random.choice(_SLOTS, int(random.integers(1, 5)), False))
        for slot in slots:
            places.append(_on_digit(random, digit, slot))
    names, joints, positions = zip(*places, strict=True)
    return MarkerLayout("made up", "", SIDES, names, np.asarray(joints, dtype=np.int64), np.stack(positions))


_SLOTS = np.array([0.1, 0.5, 0.95, 1.2, 1.5, 1.95, 2.3, 2.7])
"""Where on a digit, in bones from its root."""


def _on_digit(random: np.random.Generator, digit: int, slot: float) -> tuple[str, int, FloatArray]:
    skeleton = template().skeleton
    place = float(np.clip(slot + random.normal(0.0, 0.1), 0.0, 2.95))
    bone = int(place)
    ends = np.vstack([skeleton.joint_positions_m[1 + 3 * digit : 4 + 3 * digit], skeleton.tip_positions_m[digit]])
    along = ends[bone + 1] - ends[bone]
    dorsal = np.cross(along, skeleton.axes[4 * digit + 3])
    dorsal /= np.linalg.norm(dorsal)
    beside = np.cross(along, dorsal) / np.linalg.norm(along)
    around = random.normal(0.0, 0.35)
    height_m = _HEIGHTS_M[bone] + random.normal(0.0, 0.001)
    offset = height_m * (np.cos(around) * dorsal + np.sin(around) * beside)
    return f"{DIGITS[digit]}{slot:g}", 1 + 3 * digit + bone, ends[bone] + (place - bone) * along + offset
