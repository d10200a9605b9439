"""Makes template.npz, the hand shipped with Phalanx, from the hand of the MakeHuman base mesh (CC0).

    python resources/hand/build_template.py makehuman_left_hand_raw.npz [template.npz]

CARD.md, next to this file, tells the steps and where the numbers come from.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from core.hand.skeleton import JOINT_NAMES, JOINT_PARENTS, N_JOINTS

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

MESH_SCALE = 1.06  # the mesh is a hand of 176 mm; ours is 186 mm from the wrist to the tip of the middle finger
WRIST_SHIFT_M = np.array([0.0015, -0.006, 0.0])  # from the rig's wrist to the middle of the wrist's cross-section

# The digits of the mesh, in its own pose: by how much its joint centres are put right [m].
MCP_PROXIMAL_M = (0.009, 0.009, 0.009, 0.011)  # index to pinky: the rig bends the fingers too near to their webs
THUMB_CMC_M = np.array([-0.020, -0.011, -0.025])  # the rig has no room for a first metacarpal
THUMB_MCP_DISTAL_M = 0.006

# The flat rest pose. Lengths [m]: Buryanov and Kotiuk 2010, bone plus soft tissue at the tip.
PHALANGES_M = {
    "thumb": (0.0462, 0.0316, 0.0273),
    "index": (0.0398, 0.0224, 0.0196),
    "middle": (0.0446, 0.0263, 0.0214),
    "ring": (0.0414, 0.0256, 0.0213),
    "pinky": (0.0327, 0.0181, 0.0197),
}
# Direction of the digit at rest [deg]: azimuth from -Z towards +X (ulnar), elevation towards +Y (dorsal).
THUMB_SEGMENTS_DEG = ((-44.0, -14.0), (-38.0, -12.0), (-35.0, -11.0))
FINGER_AZIMUTH_DEG = {"index": -6.0, "middle": 1.0, "ring": 8.0, "pinky": 17.0}
# Roll of the digit's back about its bone, from dorsal towards ulnar [deg].
THUMB_ROLL_DEG = -62.0
FINGER_ROLL_DEG = {"index": -7.0, "middle": 0.0, "ring": 5.0, "pinky": 11.0}
# How the flexion axes of PIP and DIP turn in the plane of the nail, so that fingertips converge in a fist [deg].
FINGER_CONVERGENCE_DEG = {"index": -2.0, "middle": 1.0, "ring": 3.0, "pinky": 5.0}
# The thumb turns its pad towards the fingers as it flexes and abducts at the CMC (Hollister 1992) [deg].
CMC_FLEXION_PRONATION_DEG = 25.0
CMC_ABDUCTION_PRONATION_DEG = 15.0

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

FINGERS = ("index", "middle", "ring", "pinky")
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

        self.vertices_m = hand_frame(vertices)
        self.quads = quads[:, ::-1].copy()
        head, tail = hand_frame(head), hand_frame(tail)
        self.weights = np.zeros((len(vertices), N_JOINTS))
        self.chains: dict[str, Array] = {}
        for digit, number in RIG_DIGIT.items():
            bones = [bone[f"finger{number}-{segment}"] for segment in (1, 2, 3)]
            first = JOINT_NAMES.index("thumb_cmc" if digit == "thumb" else f"{digit}_mcp")
            self.weights[:, first : first + 3] = bone_weights[:, bones]
            self.chains[digit] = np.vstack([head[bones], tail[bones[2]]])
        self.weights[:, 0] = 1.0 - self.weights[:, 1:].sum(axis=1)
        for digit, shift_m in zip(FINGERS, MCP_PROXIMAL_M, strict=True):
            metacarpal = unit(self.chains[digit][0] - head[bone["metacarpal1"]])
            self.chains[digit][0] -= metacarpal * shift_m
        thumb = self.chains["thumb"]
        thumb[0] = THUMB_CMC_M
        thumb[1] += unit(thumb[2] - thumb[1]) * THUMB_MCP_DISTAL_M


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


def pose_to_rest(rig: Rig, rest: dict[str, Array]) -> Array:
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
    blended = np.einsum("vj,jab->vab", rig.weights, transforms)
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
    assert joints.shape == (N_JOINTS, 3) and len(JOINT_PARENTS) == N_JOINTS
    weights = rig.weights
    order = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    top = np.take_along_axis(weights, order, axis=1)
    return {
        "joint_positions_m": joints,
        "tip_positions_m": np.stack([chain[3] for chain in rest.values()]),
        "axes": np.vstack([digit_axes(digit, chain) for digit, chain in rest.items()]),
        "limits_rad": limits_rad(),
        "vertices_m": pose_to_rest(rig, rest),
        "faces": np.concatenate([rig.quads[:, [0, 1, 2]], rig.quads[:, [0, 2, 3]]]),
        "skin_joints": order,
        "skin_weights": top / top.sum(axis=1, keepdims=True),
    }


if __name__ == "__main__":
    target = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(__file__).with_name("template.npz")
    np.savez_compressed(target, **build(Path(sys.argv[1])))  # type: ignore[arg-type]
    print(f"{target} written")
