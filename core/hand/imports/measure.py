"""The shape of an imported hand: the nearest of our parametric hands (core.hand.shape)."""

from __future__ import annotations

import numpy as np

from core.errors import FormatError
from core.frames import FloatArray, IntArray
from core.hand.model import HandModel, template
from core.hand.poses import POSE_NAMES, pose
from core.hand.shape import (
    FIRST_BONE,
    FIRST_GIRTH,
    LARGEST,
    N_SHAPE,
    SHAPE_NAMES,
    SMALLEST,
    HandShape,
    shaped_skeleton,
)
from core.hand.skeleton import DIGITS, N_JOINTS, N_ROOT_DOFS, Skeleton
from core.kinematics.forward import joints_world

_MIDDLE_OF_BONE = ((0.35, 0.8), (0.25, 0.75), (0.15, 0.6))
"""Where a digit's bones are measured around, in parts of their length: clear of webs, joints and fingertips."""

THUMB_METACARPAL = 1
"""It lies in the palm; its flesh is no girth of the thumb."""

_MIDDLE_OF_PALM = (0.3, 0.8)
"""Where the palm is measured through, from the wrist to the third knuckle, clear of either."""


_WHOLE = "Give a hand with a whole surface, skinned to all of its joints."


def measure_shape(hand: HandModel) -> HandShape:
    """The shape in which the template is nearest to a hand at our flat rest.

    Palm and bones: least squares of all joints and fingertips from the wrist, over the named poses of core.hand.poses
    taken by both hands alike (at given angles joints are linear in the ratios). Thickness and girths: those of the
    surface. Raises FormatError for what is no person's hand.
    """
    ours, ratios = template(), np.ones(N_SHAPE)
    thickness, girths = SHAPE_NAMES.index("palm_thickness"), slice(FIRST_GIRTH, N_SHAPE)
    ratios[thickness] = palm_thickness_m(hand) / palm_thickness_m(ours)
    ratios[girths] = girths_m(hand) / girths_m(ours)
    found = [i for i in range(FIRST_GIRTH) if i != thickness]
    known = np.where(np.isin(np.arange(N_SHAPE), found), 0.0, ratios)
    per_ratio = np.stack(
        [posed_joints_m(shaped_skeleton(ours.skeleton, HandShape(row))).ravel() for row in np.eye(N_SHAPE)[found]]
    )
    left = posed_joints_m(hand.skeleton) - posed_joints_m(shaped_skeleton(ours.skeleton, HandShape(known)))
    ratios[found] = np.linalg.lstsq(per_ratio.T, left.ravel(), rcond=None)[0]
    for name, ratio in zip(SHAPE_NAMES, ratios, strict=True):
        if not SMALLEST <= ratio <= LARGEST:
            raise FormatError(
                f"This hand's {name.replace('_', ' ')} is {ratio:.2f} of the template's.",
                f"A person's lies between {SMALLEST} and {LARGEST}: look at the joints and units of the file.",
            )
    return HandShape(ratios)


def posed_joints_m(skeleton: Skeleton) -> FloatArray:
    """(poses, 21, 3) float64 [m], the 16 joints and 5 fingertips from the wrist in every named pose."""
    last, points = np.arange(3, N_JOINTS, 3), []
    tips_m = skeleton.tip_positions_m - skeleton.joint_positions_m[last]
    for name in POSE_NAMES:
        joints = joints_world(skeleton, np.concatenate([np.zeros(N_ROOT_DOFS), pose(name)]))
        ends = np.einsum("dab,db->da", joints[last, :3, :3], tips_m) + joints[last, :3, 3]
        points.append(np.vstack([joints[:, :3, 3], ends]))
    return np.stack(points)


def bone_lengths_m(skeleton: Skeleton) -> FloatArray:
    """(15,) float64 [m], from every joint but the wrist to the next, the last to the fleshy end of the digit."""
    ends = _bone_ends_m(skeleton)
    lengths: FloatArray = np.linalg.norm(ends - skeleton.joint_positions_m[1:], axis=1)
    return lengths


def girths_m(hand: HandModel) -> FloatArray:
    """(5,) float64 [m], distance of each digit's skin from the axes of its bones: the median by area, every bone
    counting alike."""
    centres, normals, carriers = _patches(hand)
    areas = np.linalg.norm(normals, axis=1)
    ends = _bone_ends_m(hand.skeleton)
    radii: list[list[float]] = [[] for _ in DIGITS]
    for j in range(1, N_JOINTS):
        if j == THUMB_METACARPAL:
            continue
        start = hand.skeleton.joint_positions_m[j]
        bone = ends[j - 1] - start
        away = centres - start
        along = away @ bone / (bone @ bone)
        low, high = _MIDDLE_OF_BONE[(j - 1) % 3]
        around = (carriers == j) & (along > low) & (along < high)
        if not around.any():
            raise FormatError(
                f"There is no skin around the {SHAPE_NAMES[FIRST_BONE + j - 1].replace('_', ' ')}.", _WHOLE
            )
        radius = np.linalg.norm(away[around] - along[around, None] * bone, axis=1)
        radii[(j - 1) // 3].append(_weighted_median(radius, areas[around]))
    return np.asarray([np.mean(each) for each in radii])


def palm_thickness_m(hand: HandModel) -> float:
    """From the back to the palm, on the average over the middle of the metacarpals [m]."""
    centres, normals, carriers = _patches(hand)
    upwards = normals[:, 1]
    joints = hand.skeleton.joint_positions_m
    low, high = sorted(joints[7, 2] * np.asarray(_MIDDLE_OF_PALM))
    left, right = sorted(joints[[4, 13], 0])
    inside = (carriers == 0) & (centres[:, 2] > low) & (centres[:, 2] < high)
    inside &= (centres[:, 0] > left) & (centres[:, 0] < right)
    up, down = inside & (upwards > 0.0), inside & (upwards < 0.0)
    if not up.any() or not down.any():
        raise FormatError(
            "There is no skin around the palm.", "Give a hand with a whole surface, skinned to its joints."
        )
    back = np.average(centres[up, 1], weights=upwards[up])
    palm = np.average(centres[down, 1], weights=-upwards[down])
    return float(back - palm)


def _bone_ends_m(skeleton: Skeleton) -> FloatArray:
    """(15, 3) float64 [m], far end of the bone of every joint but the wrist."""
    joints = skeleton.joint_positions_m[1:].reshape(len(DIGITS), 3, 3)
    ends: FloatArray = np.concatenate([joints[:, 1:], skeleton.tip_positions_m[:, None]], axis=1).reshape(-1, 3)
    return ends


def _weighted_median(values: FloatArray, weights: FloatArray) -> float:
    order = np.argsort(values, kind="stable")
    up_to = np.cumsum(weights[order])
    return float(np.interp(0.5 * up_to[-1], up_to - 0.5 * weights[order], values[order]))


def _patches(hand: HandModel) -> tuple[FloatArray, FloatArray, IntArray]:
    """Of every face its centre (f, 3) [m], its normal as long as its area (f, 3) [m2], and the joint that carries it
    most."""
    corners = hand.vertices_m[hand.faces]
    normals = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    shares = np.zeros((len(hand.vertices_m), N_JOINTS))
    np.put_along_axis(shares, hand.skin_joints, hand.skin_weights, axis=1)
    return corners.mean(axis=1), normals, shares[hand.faces].sum(axis=1).argmax(axis=1)
