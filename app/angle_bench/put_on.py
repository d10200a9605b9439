"""Markers put on a skin by a rule, as one does who looks at a layout's picture.

Where a layout has a marker on the template is told in terms of its bone: at which share of its length, on which side
of it, and how high above the skin. On any other hand it comes to the same share of that bone, on the same side, at the
same height: a ray from the bone outward finds the skin. Markers of the back of the hand come to the same share of the
palm's length and width.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from core.errors import PhalanxError
from core.frames import FloatArray
from core.hand.imports.measure import bone_lengths_m
from core.hand.joint_axes import joint_axes
from core.hand.model import HandModel, template
from core.hand.skeleton import JOINT_NAMES, TIP_JOINTS
from core.markers.layout import MarkerLayout

_INDEX_MCP, _MIDDLE_MCP, _PINKY_MCP = 4, 7, 13
_LAST_SHARE = 0.9
"""Of the last bone: beyond it there is no side of a finger any more."""


@dataclass(frozen=True)
class Place:
    """Where one marker belongs. joint: of its bone. along: (2,) float64, share of the bone's length and the angle about
    it from dorsal to radial [rad]; of the palm: shares of its length and width. height_m: above the skin."""

    joint: int
    along: tuple[float, float]
    height_m: float


@dataclass(frozen=True)
class Spot:
    """A place on a hand. point_m: (3,) float64 [m], the marker's centre at rest. face: of the skin below it."""

    point_m: FloatArray
    face: int


def places(layout: MarkerLayout) -> list[Place]:
    """Of every marker, from where the layout has it on the template."""
    hand, found = template(), []
    for joint, point in zip(layout.joints.tolist(), layout.positions_m, strict=True):
        along, beyond_m = _told(hand, joint, point)
        start, out = _ray(hand, joint, along)
        reach_m, _ = _skin_along(hand, start, out)
        found.append(Place(joint, along, beyond_m - reach_m))
    return found


def put_on(hand: HandModel, place: Place) -> Spot:
    """The marker on a hand at rest. Raises PhalanxError where there is no skin."""
    start, out = _ray(hand, place.joint, place.along)
    reach_m, face = _skin_along(hand, start, out)
    return Spot(start + (reach_m + place.height_m) * out, face)


def off(hand: HandModel, place: Place, off_m: float, random: np.random.Generator) -> Place:
    """The place of one who misses by `off_m` along the skin, in any direction; as high above it."""
    spot, (along, across) = put_on(hand, place), random.normal(0.0, 1.0, 2)
    if off_m == 0.0:
        return place
    one = hand.vertices_m[hand.faces[spot.face]]
    normal = np.cross(one[1] - one[0], one[2] - one[0])
    normal /= np.linalg.norm(normal)
    x = one[1] - one[0]
    x /= np.linalg.norm(x)
    step = along * x + across * np.cross(normal, x)
    moved = spot.point_m + off_m * step / np.linalg.norm(step)
    return replace(place, along=_told(hand, place.joint, moved)[0])


def _frame(hand: HandModel, joint: int) -> tuple[FloatArray, FloatArray, float]:
    """Origin, columns radial, dorsal and along the bone, and length [m] of a bone at rest."""
    skeleton, axes = hand.skeleton, joint_axes(hand.skeleton, "right")
    along, flexion = axes.bones[joint], axes.flexion[joint]
    radial = flexion - (flexion @ along) * along
    radial /= np.linalg.norm(radial)
    length = float(bone_lengths_m(skeleton)[joint - 1])
    return skeleton.joint_positions_m[joint], np.column_stack([radial, np.cross(along, radial), along]), length


def _palm_m(hand: HandModel) -> tuple[float, float]:
    """Length, wrist to middle knuckle along z, and width, index to little knuckle along x [m]."""
    centres = hand.skeleton.joint_positions_m
    return -float(centres[_MIDDLE_MCP, 2]), float(centres[_PINKY_MCP, 0] - centres[_INDEX_MCP, 0])


def _told(hand: HandModel, joint: int, point_m: FloatArray) -> tuple[tuple[float, float], float]:
    """A point in terms of a bone, and how far from its middle it lies [m]."""
    if joint == 0:
        length, width = _palm_m(hand)
        return (-float(point_m[2]) / length, float(point_m[0]) / width), float(point_m[1])
    origin, axes, length = _frame(hand, joint)
    radial, dorsal, along = (point_m - origin) @ axes
    return (float(along) / length, float(np.arctan2(radial, dorsal))), float(np.hypot(radial, dorsal))


def _ray(hand: HandModel, joint: int, along: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """From where, and in which direction, the skin is sought."""
    if joint == 0:
        length, width = _palm_m(hand)
        return np.array([along[1] * width, 0.0, -along[0] * length]), np.array([0.0, 1.0, 0.0])
    origin, axes, length = _frame(hand, joint)
    share = min(along[0], _LAST_SHARE) if joint in TIP_JOINTS else along[0]
    out = np.sin(along[1]) * axes[:, 0] + np.cos(along[1]) * axes[:, 1]
    return origin + share * length * axes[:, 2], out


def _skin_along(hand: HandModel, start_m: FloatArray, out: FloatArray) -> tuple[float, int]:
    """How far along a ray from within the skin is, and which face (Möller and Trumbore 1997)."""
    a, b, c = hand.vertices_m[hand.faces].transpose(1, 0, 2)
    one, two = b - a, c - a
    normal = np.cross(one, two)
    facing = normal @ out  # positive: the ray leaves the hand here
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.einsum("fi,fi->f", normal, a - start_m) / facing
        at = start_m + reach[:, None] * out - a
        square = np.einsum("fi,fi->f", normal, normal)
        u = np.einsum("fi,fi->f", np.cross(at, two), normal) / square
        v = np.einsum("fi,fi->f", np.cross(one, at), normal) / square
    hit = (facing > 0.0) & (reach > 0.0) & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9)
    if not hit.any():
        raise PhalanxError(
            "A marker of this layout finds no skin on the hand that it is put on.", "Choose another of the --layouts."
        )
    face = int(np.argmin(np.where(hit, reach, np.inf)))
    return float(reach[face]), face


def said(layout: MarkerLayout) -> list[dict[str, object]]:
    """The places in numbers, for the output of a bench: bone, share of its length, side in degrees, height in mm."""
    return [
        {
            "marker": name, "bone": JOINT_NAMES[place.joint], "share": place.along[0],
            ("side_deg" if place.joint else "width_share"): (
                float(np.degrees(place.along[1])) if place.joint else place.along[1]
            ),
            "height_mm": 1e3 * place.height_m,
        }
        for name, place in zip(layout.marker_names, places(layout), strict=True)
    ]  # fmt: skip
