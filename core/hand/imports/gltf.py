"""Rigged glTF hands of 25 joints, by the names that WebXR gives them (WebXR Hand Input, section 4).

Nothing but the names, the bind pose and the skin of the file is used: its nodes may hang in any order.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from core.errors import FormatError
from core.frames import FloatArray, IntArray
from core.gltf import Document, Gltf, read_gltf
from core.hand.imports.rig import MOST_FACES, MOST_VERTICES, Rig
from core.hand.skeleton import DIGITS, N_JOINTS

_FINGERS = [digit if digit == "thumb" else f"{digit}-finger" for digit in DIGITS]
JOINTS = ("wrist", "thumb-metacarpal", "thumb-phalanx-proximal", "thumb-phalanx-distal") + tuple(
    f"{finger}-phalanx-{bone}" for finger in _FINGERS[1:] for bone in ("proximal", "intermediate", "distal")
)
"""WebXR's names of our 16 joints, in our order."""

TIPS = tuple(f"{finger}-tip" for finger in _FINGERS)
METACARPALS = tuple(f"{finger}-metacarpal" for finger in _FINGERS[1:])
"""These do not move in our palm: what they carry belongs to the wrist."""

MOST_NODES = 10_000
"""Of a file, and parts of a mesh."""

_MOST_SETS = N_JOINTS // 4 + 1
"""Of four joints that carry a vertex each."""

_WHAT = "Give a .glb or .gltf hand with the 25 joints of WebXR, skinned, one hand per file."


def read_rig(path: Path) -> Rig:
    """The only hand of a file in its bind pose. Raises FormatError."""
    name = path.name
    try:
        gltf = read_gltf(path)
        node = _hand_node(gltf, name)
        return _rig(gltf, node, name)
    except OSError as error:
        raise FormatError(f"{name} cannot be read ({error.strerror or error}).", _WHAT) from error
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, OverflowError) as error:
        said = f"it lacks {error}" if isinstance(error, KeyError) else str(error)
        raise FormatError(f"{name} is not a sound glTF file: {said}.", "Export the hand again.") from error


def _hand_node(gltf: Gltf, name: str) -> Document:
    """The node whose mesh is skinned to a hand. Raises FormatError."""
    nodes: list[Document] = gltf.document["nodes"]
    if len(nodes) > MOST_NODES:
        raise FormatError(f"{name} has {len(nodes):,} nodes; {MOST_NODES:,} at most are read.", _WHAT)
    best: list[str] | None = None
    missing_of: dict[int, list[str]] = {}
    for node in nodes:
        if "skin" not in node or "mesh" not in node:
            continue
        skin = int(node["skin"])
        if skin not in missing_of:
            named = {nodes[joint].get("name") for joint in gltf.document["skins"][skin]["joints"]}
            missing_of[skin] = [joint for joint in (*JOINTS, *TIPS) if joint not in named]
        missing = missing_of[skin]
        if not missing:
            return node
        best = missing if best is None or len(missing) < len(best) else best
    if best is None:
        raise FormatError(f"{name} has no skinned mesh.", _WHAT)
    raise FormatError(f"{name} has no joint {', '.join(best[:4])}{' ...' if len(best) > 4 else ''}.", _WHAT)


def _rig(gltf: Gltf, node: Document, name: str) -> Rig:
    document = gltf.document
    skin = document["skins"][node["skin"]]
    joints: list[int] = skin["joints"]
    names = [str(document["nodes"][joint].get("name")) for joint in joints]
    inverse = gltf.array(skin["inverseBindMatrices"])
    if inverse.shape != (len(joints), 4, 4) or np.abs(np.linalg.det(inverse)).min() < 1e-12:
        raise ValueError(f"its {len(joints)} joints have {inverse.shape[0]} inverse bind matrices, or one is flat")
    bind = np.linalg.inv(inverse)
    wrist = names.index(JOINTS[0])
    # The mesh's own unit, which the nodes turn into metres: the size of what takes a vertex to where it is drawn.
    unit_m = float(np.cbrt(abs(np.linalg.det((_world(document, joints[wrist]) @ inverse[wrist])[:3, :3]))))
    place = {joint: unit_m * bind[names.index(joint), :3, 3] for joint in (*JOINTS, *TIPS)}
    vertices, faces, weights = _surface(gltf, node, [our_joint(name) for name in names])
    return Rig(
        name,
        np.stack([place[joint] for joint in JOINTS]),
        np.stack([place[joint] for joint in TIPS]),
        unit_m * vertices,
        faces,
        weights,
    )


def our_joint(name: str) -> int:
    """Which of our joints carries what a joint of the file carries; what is none of the hand's goes with the wrist."""
    if name in JOINTS:
        return JOINTS.index(name)
    return 3 + 3 * TIPS.index(name) if name in TIPS else 0


def _surface(gltf: Gltf, node: Document, ours: Sequence[int]) -> tuple[FloatArray, IntArray, FloatArray]:
    """All primitives of the mesh as one: vertices, faces and the weights of our 16 joints."""
    vertices, faces, weights, count, n_faces = [], [], [], 0, 0
    primitives = gltf.document["meshes"][node["mesh"]]["primitives"]
    if len(primitives) > MOST_NODES:
        raise ValueError(f"its mesh has {len(primitives):,} parts, {MOST_NODES:,} at most are read")
    for primitive in primitives:
        if primitive.get("mode", 4) != 4:
            continue
        attributes = primitive["attributes"]
        points = gltf.array(attributes["POSITION"])
        corners = gltf.array(primitive["indices"]) if "indices" in primitive else np.arange(len(points), dtype=float)
        if corners.ndim != 1 or len(corners) % 3 or points.shape[1:] != (3,):
            raise ValueError(f"its mesh has {len(corners)} corners, which is no number of triangles")
        if len(corners) and corners.max() >= len(points):
            raise ValueError(f"a face names vertex {corners.max():.0f} of {len(points)}")
        count, n_faces = count + len(points), n_faces + len(corners) // 3
        if count > MOST_VERTICES or n_faces > MOST_FACES:  # parts may share what they are made of: few bytes, much mesh
            raise ValueError(
                f"its mesh has more than {MOST_VERTICES:,} vertices or {MOST_FACES:,} triangles, which no hand needs"
            )
        vertices.append(points)
        faces.append(corners.astype(np.int64).reshape(-1, 3) + count - len(points))
        weights.append(_weights(gltf, attributes, len(points), ours))
    if not vertices:
        raise ValueError("its mesh has no triangles")
    return np.concatenate(vertices), np.concatenate(faces), np.concatenate(weights)


def _weights(gltf: Gltf, attributes: dict[str, Any], count: int, ours: Sequence[int]) -> FloatArray:
    """(v, 16), from every set of four joints that a vertex has."""
    dense, number = np.zeros((count, N_JOINTS)), 0
    to_ours = np.asarray(ours, dtype=np.int64)
    while f"JOINTS_{number}" in attributes:
        if number == _MOST_SETS:
            raise ValueError(f"its vertices hang on more than {4 * _MOST_SETS} joints each")
        joints = gltf.array(attributes[f"JOINTS_{number}"]).astype(np.int64)
        share = gltf.array(attributes[f"WEIGHTS_{number}"])
        if joints.shape != (count, 4) or share.shape != (count, 4) or joints.max(initial=0) >= len(to_ours):
            raise ValueError(f"the skin of {count} vertices has weights for {len(joints)} and {len(share)}")
        np.add.at(dense, (np.arange(count)[:, None], to_ours[joints]), share)
        number += 1
    return dense


def _world(document: Document, node: int) -> FloatArray:
    """(4, 4) of one node, its parents before it."""
    nodes: list[Document] = document["nodes"]
    parents = {int(child): i for i, each in enumerate(nodes) for child in each.get("children", ())}
    world, steps = np.eye(4), 0
    while True:
        world = _local(nodes[node]) @ world
        if node not in parents:
            return world
        node, steps = parents[node], steps + 1
        if steps > len(nodes):
            raise ValueError("its nodes hang in a circle")


def _local(node: Document) -> FloatArray:
    if "matrix" in node:
        return np.asarray(node["matrix"], dtype=np.float64).reshape(4, 4).T
    local = np.eye(4)
    rotation = Rotation.from_quat(np.asarray(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64))
    local[:3, :3] = rotation.as_matrix() * np.asarray(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    local[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return local
