"""Makes template.npz, the hand shipped with Phalanx, from the hand of the MakeHuman base mesh (CC0).

    python -m resources.hand.build_template makehuman_left_hand_raw.npz [template.npz]

CARD.md, next to this file, tells the steps and where the numbers come from.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from core.hand.skeleton import JOINT_NAMES, N_JOINTS
from resources.hand.build_surface import cap, cut, flow_weights, rim_of, subdivide, triangles

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

MESH_SCALE = 1.06  # the mesh is a hand of 176 mm; ours is 186 mm from the wrist to the tip of the middle finger
WRIST_SHIFT_M = np.array([0.0015, -0.006, 0.0])  # from the rig's wrist to the middle of the wrist's cross-section

# The digits of the mesh, in its own pose: by how much its joint centres are put right [m].
MCP_SHIFT_M = {  # proximal, dorsal: the rig bends the fingers too near to their webs and too deep in the flesh
    "index": (0.009, 0.0015),
    "middle": (0.009, 0.0030),
    "ring": (0.009, 0.0015),
    "pinky": (0.011, 0.0005),
}
THUMB_CMC_M = np.array([-0.021, -0.009, -0.025])  # the rig has no room for a first metacarpal
THUMB_MCP_DISTAL_M = 0.006

LENGTH_DIGITS, WEIGHT_DIGITS, LEAST_WEIGHT = 7, 4, 0.005

FOREARM_CUT_M = 0.040  # beyond the last ring of quads that runs all around the forearm
FOREARM_END_M = 0.030
# The end of the forearm is rounded: share of its radius further in, and further out [m].
CAP_RINGS = ((0.03, 0.0025), (0.12, 0.0045), (0.35, 0.0060))

# Half width of the bands around a joint in which the skin passes from one bone to the next, on a digit's back
# and on its palmar side [m].
BAND_M = {"back": 0.0035, "palmar": 0.0050}
MCP_BAND_M = {"back": 0.0080, "palmar": 0.0120}
THUMB_MCP_BAND_M = {"back": 0.0060, "palmar": 0.0080}

# The flat rest pose. Lengths [m]: Buryanov and Kotiuk 2010, bone plus soft tissue at the tip.
PHALANGES_M = {
    "thumb": (0.0462, 0.0316, 0.0273),
    "index": (0.0398, 0.0224, 0.0197),
    "middle": (0.0446, 0.0263, 0.0214),
    "ring": (0.0414, 0.0256, 0.0213),
    "pinky": (0.0327, 0.0181, 0.0197),
}
# Direction of the digit at rest [deg]: azimuth from -Z towards +X (ulnar), elevation towards +Y (dorsal).
THUMB_SEGMENTS_DEG = ((-44.0, -14.0), (-38.0, -12.0), (-35.0, -11.0))
FINGER_AZIMUTH_DEG = {"index": -6.0, "middle": 1.0, "ring": 8.0, "pinky": 17.0}
# Roll of the digit's back about its bone, from dorsal towards ulnar [deg].
THUMB_ROLL_DEG = -61.0
FINGER_ROLL_DEG = {"index": -6.0, "middle": 0.0, "ring": 2.0, "pinky": 8.0}
# How the flexion axes of PIP and DIP turn in the plane of the nail, so that fingertips converge in a fist [deg].
FINGER_CONVERGENCE_DEG = {"index": -2.0, "middle": 1.0, "ring": 3.0, "pinky": 5.0}
# The thumb turns its pad towards the fingers as it flexes and abducts at the CMC (Hollister 1992) [deg].
CMC_FLEXION_PRONATION_DEG = 28.0
CMC_ABDUCTION_PRONATION_DEG = 20.0

LIMITS_DEG = {
    "thumb_cmc_flexion": (-30.0, 50.0),
    "thumb_cmc_abduction": (-25.0, 60.0),
    "thumb_mcp_flexion": (-20.0, 70.0),
    "thumb_ip_flexion": (-25.0, 90.0),
    "mcp_abduction": (-25.0, 25.0),
    "mcp_flexion": (-40.0, 100.0),
    "pip_flexion": (-10.0, 120.0),
    "dip_flexion": (-15.0, 90.0),
}

RIG_DIGIT = {"thumb": 1, "index": 2, "middle": 3, "ring": 4, "pinky": 5}


def unit(vector: Array) -> Array:
    """The same direction, of length one."""
    return vector / np.linalg.norm(vector)


def direction(azimuth_deg: float, elevation_deg: float) -> Array:
    """(3,) unit, from -Z towards +X and +Y."""
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    return np.array([np.sin(azimuth) * np.cos(elevation), np.sin(elevation), -np.cos(azimuth) * np.cos(elevation)])


def turn(vector: Array, axis: Array, angle_deg: float) -> Array:
    """`vector` turned about the unit `axis` (Rodrigues)."""
    angle = np.radians(angle_deg)
    cross = np.cross(axis, vector)
    return vector * np.cos(angle) + cross * np.sin(angle) + axis * (axis @ vector) * (1.0 - np.cos(angle))


def back_of(bone: Array, roll_deg: float) -> Array:
    """(3,) unit normal of a digit's back: dorsal, square to `bone`, rolled towards ulnar."""
    dorsal = np.array([0.0, 1.0, 0.0])
    return turn(unit(dorsal - bone * (bone @ dorsal)), bone, roll_deg)


def first_joint(digit: str) -> int:
    """Index of the innermost joint of a digit."""
    return JOINT_NAMES.index("thumb_cmc" if digit == "thumb" else f"{digit}_mcp")


class Rig:
    """The mesh and the joint centres of its digits as modelled, in the hand frame of a right hand [m]."""

    def __init__(self, path: Path) -> None:
        with np.load(path, allow_pickle=False) as data:
            names = [str(name).removesuffix(".L") for name in data["bone_names"]]
            head = data["bone_head"].astype(np.float64)
            tail = data["bone_tail"].astype(np.float64)
            vertices = data["vertices"].astype(np.float64)
            quads = data["quads"].astype(np.int64)
            bone_weights = data["weights"].astype(np.float64)
        bone = {name: i for i, name in enumerate(names)}
        wrist = head[bone["wrist"]]
        z = -unit(head[bone["finger3-1"]] - wrist)
        across = head[bone["finger5-1"]] - head[bone["finger2-1"]]
        x = unit(across - z * (z @ across))
        # The mesh is a left hand: dorsal is -(z cross x), which makes this map a mirror.
        to_hand = np.stack([x, -np.cross(z, x), z])

        def hand_frame(points: Array) -> Array:
            mapped: Array = (points - wrist) @ to_hand.T * MESH_SCALE - WRIST_SHIFT_M
            return mapped

        head, tail = hand_frame(head), hand_frame(tail)
        # Column j: the rig's own weight of joint j, its metacarpals counted to the wrist.
        weights = np.zeros((len(vertices), N_JOINTS))
        self.chains: dict[str, Array] = {}
        for digit, number in RIG_DIGIT.items():
            bones = [bone[f"finger{number}-{segment}"] for segment in (1, 2, 3)]
            weights[:, first_joint(digit) : first_joint(digit) + 3] = bone_weights[:, bones]
            self.chains[digit] = np.vstack([head[bones], tail[bones[2]]])
        for digit, (proximal_m, dorsal_m) in MCP_SHIFT_M.items():
            metacarpal = unit(self.chains[digit][0] - head[bone["metacarpal1"]])
            self.chains[digit][0] += np.array([0.0, dorsal_m, 0.0]) - metacarpal * proximal_m
        thumb = self.chains["thumb"]
        thumb[0] = THUMB_CMC_M
        thumb[1] += unit(thumb[2] - thumb[1]) * THUMB_MCP_DISTAL_M

        points, faces, kept = cut(hand_frame(vertices), quads[:, ::-1], FOREARM_CUT_M)
        points[rim_of(faces.tolist()), 2] = FOREARM_END_M
        points, polygons = cap(points, faces, CAP_RINGS)
        capped_weights = np.vstack([weights[kept], np.zeros((len(points) - len(kept), N_JOINTS))])
        self.vertices_m, self.quads = subdivide(polygons, points)
        self.weights, _ = subdivide(polygons, capped_weights, smooth=False)
        for digit, chain in self.chains.items():  # a digit ends where its smoothed surface ends
            bone_direction = unit(chain[3] - chain[2])
            own = self.weights[:, first_joint(digit) + 2] > 0.95
            chain[3] = chain[2] + bone_direction * ((self.vertices_m[own] - chain[2]) @ bone_direction).max()


def rest_chains(rig: Rig) -> dict[str, Array]:
    """For each digit the (4, 3) joint centres and tip [m] of the flat rest pose."""
    chains = {}
    for digit, lengths in PHALANGES_M.items():
        if digit == "thumb":
            bones = [direction(*segment) for segment in THUMB_SEGMENTS_DEG]
        else:
            bones = [direction(FINGER_AZIMUTH_DEG[digit], 0.0)] * 3
        points = [rig.chains[digit][0]]
        for bone, length in zip(bones, lengths, strict=True):
            points.append(points[-1] + bone * length)
        chains[digit] = np.stack(points)
    return chains


def digit_axes(digit: str, chain: Array) -> Array:
    """(4, 3) unit axes of one digit's angles at rest; signs as core.hand.skeleton defines them."""
    bones = [unit(chain[k + 1] - chain[k]) for k in range(3)]
    if digit == "thumb":
        backs = [back_of(bone, THUMB_ROLL_DEG) for bone in bones]
        flexions = [np.cross(back, bone) for back, bone in zip(backs, bones, strict=True)]
        return np.stack(
            [
                turn(flexions[0], backs[0], CMC_FLEXION_PRONATION_DEG),
                turn(backs[0], flexions[0], -CMC_ABDUCTION_PRONATION_DEG),
                flexions[1],
                flexions[2],
            ]
        )
    back = back_of(bones[0], FINGER_ROLL_DEG[digit])
    flexion = np.cross(back, bones[0])
    towards = 1.0 if digit in ("index", "middle") else -1.0  # away from the middle finger; middle: to the thumb
    converging = turn(flexion, back, FINGER_CONVERGENCE_DEG[digit])
    return np.stack([back * towards, flexion, converging, converging])


def seeds_of(rig: Rig) -> Ints:
    """(v,) the joint whose bone alone carries a vertex, -1 in the bands between bones."""
    seeds = np.full(len(rig.vertices_m), -1)
    carried = np.zeros(len(rig.vertices_m), dtype=bool)  # by a digit or near to one
    for digit, chain in rig.chains.items():
        first = first_joint(digit)
        share = rig.weights[:, first : first + 3].sum(axis=1)
        along_m, radius_m, backness = along(chain, RIG_ROLL_DEG[digit], rig.vertices_m)
        ends_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(chain, axis=0), axis=1))])
        for k in range(3):
            if digit == "thumb":
                low = (None, THUMB_MCP_BAND_M, BAND_M)[k]
                high = (THUMB_MCP_BAND_M, BAND_M, None)[k]
                own = share > 0.95 if k else (share > 0.8) & (along_m > 0.4 * ends_m[1])
            else:
                low = (MCP_BAND_M, BAND_M, BAND_M)[k]
                high = (BAND_M, BAND_M, None)[k]
                own = share > 0.95
            inside = (
                own & (along_m >= ends_m[k] + band(low, backness)) & (along_m <= ends_m[k + 1] - band(high, backness))
            )
            if high is None:
                inside = own & (along_m >= ends_m[k] + band(low, backness))
            seeds[inside] = first + k
        if digit == "thumb":
            carried |= (share > 0.01) | (radius_m < 0.024) & (along_m > -0.006)
        else:
            carried |= (along_m > -band(MCP_BAND_M, backness)) & ((share > 0.005) | (radius_m < 0.018))
    seeds[~carried] = 0
    return seeds


def band(half_width_m: dict[str, float] | None, backness: Array) -> Array:
    """Half width of a band for vertices on the back (backness 1), the palmar side (-1) or between [m]."""
    if half_width_m is None:
        return np.full(backness.shape, -np.inf)
    share = (backness + 1.0) / 2.0
    return half_width_m["back"] * share + half_width_m["palmar"] * (1.0 - share)


def along(chain: Array, roll_deg: float, points: Array) -> tuple[Array, Array, Array]:
    """For each point the nearest place on a digit: arc length from its first joint [m] (the first bone is
    prolonged inwards, the last outwards), distance [m], and how much it lies on the back, -1 to 1."""
    length_m, along_m = 0.0, np.zeros(len(points))
    distance_m, backness = np.full(len(points), np.inf), np.zeros(len(points))
    for k in range(3):
        bone = chain[k + 1] - chain[k]
        t = (points - chain[k]) @ bone / (bone @ bone)
        t = np.clip(t, -np.inf if k == 0 else 0.0, np.inf if k == 2 else 1.0)
        offset = points - chain[k] - t[:, None] * bone
        d = np.linalg.norm(offset, axis=1)
        nearer = d < distance_m
        distance_m[nearer] = d[nearer]
        along_m[nearer] = length_m + t[nearer] * np.linalg.norm(bone)
        backness[nearer] = (offset @ back_of(unit(bone), roll_deg))[nearer] / np.maximum(d[nearer], 1e-9)
        length_m += float(np.linalg.norm(bone))
    return along_m, distance_m, backness


def pose_to_rest(rig: Rig, weights: Array, rest: dict[str, Array]) -> Array:
    """(v, 3) [m], the mesh with its digits straightened and brought to their rest lengths."""
    transforms = np.tile(np.eye(4), (N_JOINTS, 1, 1))
    joint = 1
    for digit, chain in rest.items():
        modelled = rig.chains[digit]
        roll = THUMB_ROLL_DEG if digit == "thumb" else FINGER_ROLL_DEG[digit]
        for k in range(3):
            old, new = modelled[k + 1] - modelled[k], chain[k + 1] - chain[k]
            stretch = np.linalg.norm(new) / np.linalg.norm(old)
            old_axes = frame_of(unit(old), RIG_ROLL_DEG[digit])
            new_axes = frame_of(unit(new), roll)
            transforms[joint, :3, :3] = new_axes @ np.diag([1.0, 1.0, stretch]) @ old_axes.T
            transforms[joint, :3, 3] = chain[k] - transforms[joint, :3, :3] @ modelled[k]
            joint += 1
    blended = np.einsum("vj,jab->vab", weights, transforms)
    moved: Array = np.einsum("vab,vb->va", blended[:, :3, :3], rig.vertices_m) + blended[:, :3, 3]
    return moved


# Roll of the digits' backs in the mesh as modelled, from the shape of their cross-sections [deg].
RIG_ROLL_DEG = {"thumb": -68.0, "index": -12.0, "middle": 0.0, "ring": -2.0, "pinky": 6.0}


def frame_of(bone: Array, roll_deg: float) -> Array:
    """(3, 3) columns side, back, bone."""
    back = back_of(bone, roll_deg)
    return np.stack([np.cross(back, bone), back, bone], axis=1)


def limits_rad() -> Array:
    """(20, 2) [rad], in the order of core.hand.skeleton.DIGIT_DOF_NAMES."""
    thumb = [LIMITS_DEG[f"thumb_{name}"] for name in ("cmc_flexion", "cmc_abduction", "mcp_flexion", "ip_flexion")]
    finger = [LIMITS_DEG[name] for name in ("mcp_abduction", "mcp_flexion", "pip_flexion", "dip_flexion")]
    return np.radians(np.array(thumb + finger * 4))


def build(source: Path) -> dict[str, NDArray[np.float64] | Ints]:
    """The arrays of template.npz."""
    rig = Rig(source)
    rest = rest_chains(rig)
    joints = np.vstack([np.zeros((1, 3))] + [chain[:3] for chain in rest.values()])
    weights = flow_weights(rig.vertices_m, rig.quads, seeds_of(rig), N_JOINTS)
    skin_joints, skin_weights = four_per_vertex(weights)
    weights = np.zeros_like(weights)
    np.put_along_axis(weights, skin_joints, skin_weights, axis=1)
    vertices = pose_to_rest(rig, weights, rest)
    tips = np.stack([chain[3] for chain in rest.values()])
    return {
        "joint_positions_m": joints.round(LENGTH_DIGITS),
        "tip_positions_m": tips.round(LENGTH_DIGITS),
        "axes": np.vstack([digit_axes(digit, chain) for digit, chain in rest.items()]),
        "limits_rad": limits_rad(),
        "vertices_m": vertices.round(LENGTH_DIGITS),
        "faces": triangles(vertices, rig.quads),
        "skin_joints": skin_joints,
        "skin_weights": skin_weights,
    }


def four_per_vertex(weights: Array) -> tuple[Ints, Array]:
    """(v, 4) joints and (v, 4) weights, the heaviest first; they sum to one, and none is below LEAST_WEIGHT."""
    joints = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    kept = np.take_along_axis(weights, joints, axis=1)
    kept[kept < LEAST_WEIGHT] = 0.0
    kept = (kept / kept.sum(axis=1, keepdims=True)).round(WEIGHT_DIGITS)
    kept[:, 0] = 1.0 - kept[:, 1:].sum(axis=1)
    return joints, kept


if __name__ == "__main__":
    target = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(__file__).with_name("template.npz")
    np.savez_compressed(target, **build(Path(sys.argv[1])))  # type: ignore[arg-type]
    print(f"{target} written")
