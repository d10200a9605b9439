"""Files of hands, made from one of ours: what an importer must give back."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from core.gltf import GlbBuilder
from core.hand.imports.gltf import JOINTS, METACARPALS, TIPS
from core.hand.imports.mano import OURS, PARENTS
from core.hand.mirror import mirror_points, mirror_transforms
from core.hand.model import HandModel, skin
from core.hand.skeleton import N_JOINTS
from core.kinematics.forward import joints_world


def posed_points(hand: HandModel, theta_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints (16, 4, 4), fingertips (5, 3) and vertices (v, 3) of a right hand."""
    joints = joints_world(hand.skeleton, theta_rad)
    last = np.arange(3, N_JOINTS, 3)
    local = hand.skeleton.tip_positions_m - hand.skeleton.joint_positions_m[last]
    tips = np.einsum("dab,db->da", joints[last, :3, :3], local) + joints[last, :3, 3]
    return joints, tips, skin(hand, joints)


def split(hand: HandModel, vertices_m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Every face with corners of its own: vertices, faces, joints, weights."""
    corners = hand.faces.ravel()
    faces = np.arange(len(corners)).reshape(-1, 3)
    return vertices_m[corners], faces, hand.skin_joints[corners], hand.skin_weights[corners]


def write_webxr(
    path: Path, hand: HandModel, theta_rad: np.ndarray, side: str = "right", unit_m: float = 1.0
) -> np.ndarray:
    """A .glb of 25 joints whose bind pose is `theta_rad`, its mesh in `unit_m`, its nodes turned away from the bind
    pose. Returns the joints (16, 3) [m] of the bind pose."""
    joints, tips, vertices = posed_points(hand, theta_rad)
    if side == "left":
        joints, tips, vertices = mirror_transforms(joints), mirror_points(tips), mirror_points(vertices)
    vertices, faces, skin_joints, skin_weights = split(hand, vertices)
    if side == "left":
        faces = faces[:, ::-1]
    names = [*JOINTS, *TIPS, *METACARPALS]
    bind = np.tile(np.eye(4), (len(names), 1, 1))
    bind[:16] = joints
    bind[16:21, :3, 3] = tips
    bind[21:, :3, 3] = 0.5 * (joints[0, :3, 3] + joints[4::3, :3, 3])
    bind[:, :3, 3] /= unit_m
    to_metres = np.diag([unit_m, unit_m, unit_m, 1.0])
    moved = np.array([[0.0, 0.0, 1.0, 0.3], [1.0, 0.0, 0.0, 0.1], [0.0, 1.0, 0.0, -0.2], [0.0, 0.0, 0.0, 1.0]])
    builder = GlbBuilder()
    carriers = np.where(skin_weights > 0.0, skin_joints, 0)
    attributes = {
        "POSITION": builder.add((vertices / unit_m).astype(np.float32), bounds=True),
        "JOINTS_0": builder.add(carriers.astype(np.uint8)),
        "WEIGHTS_0": builder.add(skin_weights.astype(np.float32)),
    }
    primitive = {"attributes": attributes, "indices": builder.add(faces.ravel().astype(np.uint32))}
    nodes = [{"name": name, "matrix": matrix.T.ravel().tolist()} for name, matrix in zip(names, bind, strict=True)]
    nodes.append({"name": "hand", "matrix": (moved @ to_metres).T.ravel().tolist(), "children": list(range(25))})
    nodes.append({"name": "mesh", "mesh": 0, "skin": 0})
    inverse = builder.add(np.linalg.inv(bind).astype(np.float32))
    document = {
        "asset": {"version": "2.0"},
        "nodes": nodes,
        "meshes": [{"primitives": [primitive]}],
        "skins": [{"joints": list(range(25)), "inverseBindMatrices": inverse}],
    }
    builder.write(path, document)
    return joints[:, :3, 3]


def regressor(vertices_m: np.ndarray, joints_m: np.ndarray) -> np.ndarray:
    """(j, v): each joint as a sum of its 60 nearest vertices whose weights sum to one."""
    rows = np.zeros((len(joints_m), len(vertices_m)))
    for row, joint in zip(rows, joints_m, strict=True):
        near = np.argsort(np.linalg.norm(vertices_m - joint, axis=1))[:60]
        terms = np.vstack([vertices_m[near].T, np.ones(60)])
        row[near] = np.linalg.lstsq(terms, np.append(joint, 1.0), rcond=None)[0]
    return rows


def mano_arrays(
    vertices_m: np.ndarray, faces: np.ndarray, weights: np.ndarray, joints_m: np.ndarray
) -> dict[str, np.ndarray]:
    """The arrays of a MANO file: joints and weights (v, 16) come in our order."""
    in_mano = np.argsort(OURS)
    return {
        "v_template": vertices_m,
        "f": faces.astype(np.uint32),
        "weights": weights[:, in_mano],
        "J_regressor": regressor(vertices_m, joints_m[in_mano]),
        "kintree_table": np.array([[2**32 - 1, *PARENTS[1:]], range(16)], dtype=np.int64),
        "shapedirs": np.stack([vertices_m, np.zeros_like(vertices_m)], axis=2),  # the first makes it larger
    }


def dense(hand: HandModel) -> np.ndarray:
    """(v, 16) skin weights."""
    weights = np.zeros((len(hand.vertices_m), N_JOINTS))
    np.put_along_axis(weights, hand.skin_joints, hand.skin_weights, axis=1)
    return weights
