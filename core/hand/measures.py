"""Measures of a hand in metres, taken where anthropometry takes them, on the surface at rest.

Definitions follow ISO 7250-1 and the US Army surveys (T. M. Greiner, Hand Anthropometry of U.S. Army Personnel,
NATICK/TR-92/011, 1991): lengths along the hand's axis, breadth and circumference over the knuckles of the index and
little finger without the thumb, a digit's girth around its PIP (thumb: IP) joint. A tape does not follow hollows, so
a circumference is that of the convex hull.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from core.frames import BoolArray, FloatArray
from core.hand.model import HandModel
from core.hand.skeleton import DIGITS, JOINT_NAMES

CREASE = 0.4
"""Where a digit's proximal flexion crease crosses its proximal phalanx, as a share of the bone from the joint at its
base. 0.4 gives the adult mean of palm length to hand length, 0.60 (Greiner 1991, both sexes)."""

_THUMB = (1, 2, 3)
_PALM = np.asarray([0, *(JOINT_NAMES.index(f"{digit}_mcp") for digit in DIGITS[1:])])
_GIRTH_JOINTS = np.asarray([3, 5, 8, 11, 14])
"""The thumb's IP, the fingers' PIP."""
_PROXIMAL_JOINTS = np.asarray([2, 4, 7, 10, 13])
"""At the base of each proximal phalanx."""


@dataclass(frozen=True)
class HandMeasures:
    """All in metres.

    length: wrist to the tip of the middle finger. palm_length: wrist to that finger's crease. breadth, circumference:
    over the knuckles, without the thumb. digit_lengths: (5,) crease to tip. digit_girths: (5,) at the PIP, thumb: IP.
    """

    length: float
    palm_length: float
    breadth: float
    circumference: float
    digit_lengths: FloatArray
    digit_girths: FloatArray


def measure(hand: HandModel) -> HandMeasures:
    """Takes the measures of a hand at rest."""
    skeleton = hand.skeleton
    bases, beyond = skeleton.joint_positions_m[_PROXIMAL_JOINTS], skeleton.joint_positions_m[_PROXIMAL_JOINTS + 1]
    creases = bases + CREASE * (beyond - bases)
    knuckles = _knuckle_section(hand)
    return HandMeasures(
        length=skeleton.length_m,
        palm_length=-float(creases[2, 2]),
        breadth=float(np.ptp(knuckles[:, 0])),
        circumference=_tape(knuckles),
        digit_lengths=np.linalg.norm(skeleton.tip_positions_m - creases, axis=1),
        digit_girths=np.asarray([_tape(_digit_section(hand, d)) for d in range(len(DIGITS))]),
    )


def _knuckle_section(hand: HandModel) -> FloatArray:
    """(n, 2) float64 [m], across the hand and through it: the section through the second and fifth knuckle."""
    index, pinky = hand.skeleton.joint_positions_m[[4, 13]]
    across = (pinky - index) * (1.0, 0.0, 1.0)
    across /= np.linalg.norm(across)
    dorsal = np.asarray([0.0, 1.0, 0.0])
    return _section(hand, index, across, dorsal, np.isin(hand.skin_joints[:, 0], _PALM))


def _digit_section(hand: HandModel, digit: int) -> FloatArray:
    """(n, 2) float64 [m]: the section of a digit square to its bones at the middle one of its joints."""
    joint = int(_GIRTH_JOINTS[digit])
    here = hand.skeleton.joint_positions_m
    after = hand.skeleton.tip_positions_m[0] if digit == 0 else here[joint + 1]
    along = after - here[joint - 1]
    along /= np.linalg.norm(along)
    side = np.cross(along, (0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    own = np.isin(hand.skin_joints[:, 0], 3 * digit + np.asarray(_THUMB))
    return _section(hand, here[joint], side, np.cross(side, along), own)


def _section(hand: HandModel, centre: FloatArray, u: FloatArray, v: FloatArray, own: BoolArray) -> FloatArray:
    """(n, 2) float64 [m], where the plane spanned by u and v through `centre` cuts edges between vertices `own`."""
    heights = (hand.vertices_m - centre) @ np.cross(u, v)
    edges = np.concatenate([hand.faces[:, [0, 1]], hand.faces[:, [1, 2]], hand.faces[:, [2, 0]]])
    a, b = edges[(own[edges].all(axis=1)) & (heights[edges[:, 0]] < 0.0) & (heights[edges[:, 1]] >= 0.0)].T
    share = heights[a] / (heights[a] - heights[b])
    points = hand.vertices_m[a] + share[:, None] * (hand.vertices_m[b] - hand.vertices_m[a]) - centre
    return np.stack([points @ u, points @ v], axis=1)


def _tape(section: FloatArray) -> float:
    """Length of a tape around a section [m]."""
    return float(ConvexHull(section).area)
