"""The surface of a posed hand: named places on it, how deep parts of it lie in one another, and distances to a prop.

Offline tools: build_poses.py solves poses with them, the tests check the shipped poses by them.
"""

# mypy: allow-untyped-defs
from __future__ import annotations

from functools import cache

import numpy as np
from numba import njit

from core.frames import FloatArray, IntArray
from core.hand.model import skinning_matrices, template
from core.hand.skeleton import DIGITS, JOINT_PARENTS, N_JOINTS
from core.kinematics.forward import joints_world
from core.motion.pose_file import Prop

BONES = ("proximal", "middle", "distal")
SIDES_OF_A_BONE = ("palmar", "dorsal", "radial", "ulnar")
PATCH_M = 0.008
"""A place is this far about its vertex [m]."""

_PAD_FRACTION = 0.58
_CREASE_M = 0.012
_SHARED = 0.02
"""A joint of less weight than this does not move a vertex [1]."""


def surface(angles_rad: FloatArray, vertices: IntArray | slice = slice(None)) -> tuple[FloatArray, FloatArray]:
    """Points (n, 3) [m] and unit normals (n, 3) of chosen vertices of the template, wrist at rest."""
    hand = template()
    joints = joints_world(hand.skeleton, np.concatenate([np.zeros(6), angles_rad]))
    matrices = skinning_matrices(hand.skeleton, joints)
    blended = np.einsum("vk,vkij->vij", hand.skin_weights[vertices], matrices[hand.skin_joints[vertices]][..., :3, :])
    points = np.einsum("vij,vj->vi", blended[..., :3], hand.vertices_m[vertices]) + blended[..., 3]
    normals = np.einsum("vij,vj->vi", blended[..., :3], _rest_normals()[vertices])
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


@cache
def _rest_normals() -> FloatArray:
    hand = template()
    corners = hand.vertices_m[hand.faces]
    of_faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(hand.vertices_m)
    for k in range(3):
        np.add.at(normals, hand.faces[:, k], of_faces)
    unit: FloatArray = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return unit


@cache
def site(place: str) -> int:
    """The vertex of a place: "DIGIT pad", "DIGIT tip", "DIGIT BONE SIDE", "FINGER palm" or "palm". Raises KeyError.

    "FINGER palm" is the palm under that finger's knuckle. The bones of the thumb are its metacarpal (proximal), its
    proximal (middle) and its distal phalanx.
    """
    hand = template()
    if place == "palm":
        return _ray_vertex(0, np.array([0.0, 0.0, -0.050]), np.array([0.0, -1.0, 0.0]))
    words = place.split()
    if words[0] not in DIGITS or len(words) not in (2, 3):
        raise KeyError(place)
    digit = DIGITS.index(words[0])
    if words[1:] == ["tip"]:
        return int(np.argmin(np.linalg.norm(hand.vertices_m - hand.skeleton.tip_positions_m[digit], axis=1)))
    if words[1:] == ["palm"] and digit > 0:
        knuckle = hand.skeleton.joint_positions_m[1 + 3 * digit]
        return _ray_vertex(0, knuckle + (0.0, 0.0, _CREASE_M), np.array([0.0, -1.0, 0.0]))
    bone, side = ("distal", "palmar") if words[1:] == ["pad"] else (words[1], words[-1])
    if bone not in BONES or side not in SIDES_OF_A_BONE:
        raise KeyError(place)
    level = BONES.index(bone)
    joint = 1 + 3 * digit + level
    start = hand.skeleton.joint_positions_m[joint]
    end = hand.skeleton.tip_positions_m[digit] if level == 2 else hand.skeleton.joint_positions_m[joint + 1]
    along = (end - start) / np.linalg.norm(end - start)
    axis = hand.skeleton.axes[4 * digit + level + (digit > 0 or level > 0)]
    palmar = np.cross(axis, along)
    direction = {"palmar": palmar, "dorsal": -palmar, "radial": axis, "ulnar": -axis}[side]
    return _ray_vertex(joint, start + (end - start) * (_PAD_FRACTION if level == 2 else 0.5), direction)


def _ray_vertex(joint: int, origin: FloatArray, direction: FloatArray) -> int:
    """The vertex of a bone nearest to a ray from inside it, where the skin faces as the ray goes."""
    hand = template()
    own = np.flatnonzero(hand.skin_joints[np.arange(len(hand.vertices_m)), hand.skin_weights.argmax(axis=1)] == joint)
    arms = hand.vertices_m[own] - origin
    direction = direction / np.linalg.norm(direction)
    ahead = arms @ direction
    off = np.linalg.norm(arms - ahead[:, None] * direction, axis=1)
    seen = (ahead > 0.0) & (_rest_normals()[own] @ direction > 0.6)
    return int(own[np.argmin(np.where(seen, off, np.inf))])


@cache
def patch(place: str) -> IntArray:
    """(n,) vertices about a place."""
    rest = template().vertices_m
    return np.flatnonzero(np.linalg.norm(rest - rest[site(place)], axis=1) < PATCH_M)


@cache
def bodies() -> IntArray:
    """(v,) int64, the bone that each vertex counts as when parts are checked against one another.

    -1 for skin in the webs and next to them, which moves with more than one of them. The ball of the thumb, which
    moves with palm and thumb, counts as the thumb's metacarpal.
    """
    hand = template()
    dense = np.zeros((len(hand.vertices_m), N_JOINTS))
    np.put_along_axis(dense, hand.skin_joints, hand.skin_weights, axis=1)
    body: IntArray = dense.argmax(axis=1)
    digits = dense[:, 1:].reshape(-1, len(DIGITS), 3).sum(axis=2)
    webs = (body > 0) & (dense[:, 0] > _SHARED)
    webs |= (dense[:, 0] > _SHARED) & (digits[:, 0] > _SHARED)
    webs |= (digits > _SHARED).sum(axis=1) > 1
    thenar = (dense[:, 0] > _SHARED) & (dense[:, 1] > _SHARED) & (dense[:, 2:].max(axis=1) < _SHARED)
    webs &= ~thenar
    touching = hand.faces[webs[hand.faces].any(axis=1)]
    webs[touching[(body[touching] > 0).all(axis=1)]] = True
    return np.where(webs, -1, np.where(thenar, 1, body))


@cache
def may_meet() -> FloatArray:
    """(16, 16) bool: parts that should not lie in one another. A bone and the next one fold at their common skin."""
    meet = np.ones((N_JOINTS, N_JOINTS), dtype=np.bool_)
    for joint, parent in enumerate(JOINT_PARENTS):
        meet[joint, joint] = False
        if parent >= 0:
            meet[joint, parent] = meet[parent, joint] = False
    return meet


@njit(cache=True, nogil=True)
def _nearest(points, normals, body, meet, reach, partner, depth):
    """For each vertex the nearest of another part, and how deep it lies beneath that one's tangent plane.

    The points are sorted by their first coordinate.
    """
    n = points.shape[0]
    for i in range(n):
        partner[i] = -1
        depth[i] = 0.0
        if body[i] < 0:
            continue
        best = reach * reach
        for step in (-1, 1):
            j = i + step
            while 0 <= j < n:
                dx = points[i, 0] - points[j, 0]
                if dx * dx >= best:
                    break
                if body[j] >= 0 and meet[body[i], body[j]]:
                    dy, dz = points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
                    square = dx * dx + dy * dy + dz * dz
                    if square < best:
                        best = square
                        partner[i] = j
                j += step
        j = partner[i]
        if j >= 0:
            inside = 0.0
            for a in range(3):
                inside -= (points[i, a] - points[j, a]) * normals[j, a]
            # A vertex beside the rim of the other part is beneath a tangent plane too, but not inside.
            if inside * inside > 0.36 * best or inside < 0.0:
                depth[i] = inside
            else:
                depth[i] = -(best**0.5)


def overlaps(
    points_m: FloatArray, normals: FloatArray, body: IntArray, reach_m: float = 0.02
) -> tuple[IntArray, FloatArray]:
    """Partner (n,) and depth (n,) [m] of each point in other parts of the hand; positive is inside; -1 no partner."""
    order = np.argsort(points_m[:, 0])
    found, found_depth = np.empty(len(order), np.int64), np.empty(len(order))
    _nearest(points_m[order], normals[order], body[order], may_meet(), reach_m, found, found_depth)
    partner, depth = np.empty_like(found), np.empty_like(found_depth)
    partner[order] = np.where(found >= 0, order[found], -1)
    depth[order] = found_depth
    return partner, depth


def deepest_overlap(angles_rad: FloatArray) -> tuple[float, str]:
    """How deep [m] any part of the hand lies in another, and which two."""
    points, normals = surface(angles_rad)
    body = bodies()
    partner, depth = overlaps(points, normals, body)
    worst = int(np.argmax(np.where(partner >= 0, depth, -np.inf)))
    if partner[worst] < 0:
        return 0.0, ""
    return float(max(depth[worst], 0.0)), f"{part_name(body[worst])} in {part_name(body[partner[worst]])}"


def part_name(body: int) -> str:
    """Digit and bone of a body, for people."""
    if body < 0:
        return "web"
    return "palm" if body == 0 else f"{DIGITS[(body - 1) // 3]} {BONES[(body - 1) % 3]}"


def prop_distance(prop: Prop, points_m: FloatArray) -> FloatArray:
    """(n,) [m], signed distance of points (n, 3) of the hand frame to the surface of a prop; negative is inside."""
    rotation, origin = prop.transform_hand[:3, :3], prop.transform_hand[:3, 3]
    local = (points_m - origin) @ rotation
    if prop.shape == "sphere":
        distance: FloatArray = np.linalg.norm(local, axis=1) - prop.size_m[0] / 2
        return distance
    if prop.shape == "box":
        beyond = np.abs(local) - np.asarray(prop.size_m) / 2
    else:
        diameter, length = prop.size_m
        across = np.linalg.norm(local[:, :2], axis=1) - diameter / 2
        beyond = np.stack([across, np.abs(local[:, 2]) - length / 2], axis=1)
    outside: FloatArray = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return outside + np.minimum(beyond.max(axis=1), 0.0)


def prop_normals(prop: Prop, points_m: FloatArray) -> FloatArray:
    """(n, 3), unit, where the distance to a prop grows fastest."""
    slopes = [prop_distance(prop, points_m + h) - prop_distance(prop, points_m - h) for h in 1e-5 * np.eye(3)]
    normals = np.stack(slopes, axis=1)
    unit: FloatArray = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return unit


def contact_gap(angles_rad: FloatArray, prop: Prop | None, contact: tuple[str, str]) -> float:
    """[m], how far apart the two places of a contact are on the surface; negative where they press in."""
    first, second = sorted(contact, key=lambda place: place == "prop")
    points, _ = surface(angles_rad, patch(first))
    if second == "prop":
        if prop is None:
            raise KeyError("prop")
        distances = prop_distance(prop, points)
        return float(distances[np.argmin(np.abs(distances))])
    others, other_normals = surface(angles_rad, patch(second))
    arms = points[:, None] - others[None]
    lengths = np.linalg.norm(arms, axis=2)
    i, j = np.unravel_index(np.argmin(lengths), lengths.shape)
    sign = 1.0 if float(arms[i, j] @ other_normals[j]) >= 0.0 else -1.0
    return sign * float(lengths[i, j])
