"""The hands of a .glb file evaluated as glTF prescribes (2.0, 3.7.3 skins and 3.11 animations), to compare."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import FloatArray, IntArray
from core.gltf import Document, Gltf

Tracks = dict[tuple[int, str], FloatArray]
"""Values per frame by node and property."""


@dataclass(frozen=True)
class GltfHand:
    """One skinned mesh and its animation.

    joint_names: (j,) in the order of the skin. times_s: (t,) float64 [s]. world: (t, j, 4, 4) float64, joints in the
    world. inverse_bind: (j, 4, 4). vertices_m: (v, 3). faces: (f, 3). joints, weights: (v, 4).
    """

    joint_names: tuple[str, ...]
    times_s: FloatArray
    world: FloatArray
    inverse_bind: FloatArray
    vertices_m: FloatArray
    faces: IntArray
    joints: IntArray
    weights: FloatArray

    def positions_m(self) -> FloatArray:
        """(t, j, 3) float64 [m], the joints in the world."""
        return self.world[:, :, :3, 3]

    def surface_m(self, frame: int) -> FloatArray:
        """(v, 3) float64 [m], the skinned vertices in one frame."""
        matrices = self.world[frame] @ self.inverse_bind
        blended = np.einsum("vk,vkij->vij", self.weights, matrices[self.joints])
        surface: FloatArray = np.einsum("vij,vj->vi", blended[:, :3, :3], self.vertices_m) + blended[:, :3, 3]
        return surface


def gltf_hands(glb: Gltf) -> list[GltfHand]:
    """Every skinned mesh of the file. Raises KeyError, IndexError or ValueError where it is not sound."""
    document = glb.document
    nodes: list[Document] = document["nodes"]
    parents = {child: i for i, node in enumerate(nodes) for child in node.get("children", ())}
    tracks, times = read_tracks(glb)
    hands = []
    for node in nodes:
        if "skin" not in node:
            continue
        skin = document["skins"][node["skin"]]
        primitive = document["meshes"][node["mesh"]]["primitives"][0]
        attributes = primitive["attributes"]
        joints: list[int] = skin["joints"]
        world = np.stack([_world(joint, nodes, parents, tracks, len(times)) for joint in joints], axis=1)
        hands.append(
            GltfHand(
                tuple(nodes[joint]["name"] for joint in joints),
                times,
                world,
                glb.array(skin["inverseBindMatrices"]),
                glb.array(attributes["POSITION"]),
                glb.array(primitive["indices"]).astype(np.int64).reshape(-1, 3),
                glb.array(attributes["JOINTS_0"]).astype(np.int64),
                glb.array(attributes["WEIGHTS_0"]),
            )
        )
    return hands


def read_tracks(glb: Gltf) -> tuple[Tracks, FloatArray]:
    """Everything that is animated, and the times it all shares. Raises as gltf_hands."""
    (animation,) = glb.document["animations"]
    tracks: Tracks = {}
    inputs = set()
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        inputs.add(sampler["input"])
        tracks[channel["target"]["node"], channel["target"]["path"]] = glb.array(sampler["output"])
    (times,) = inputs
    times_s = glb.array(times)
    if np.any(np.diff(times_s) <= 0.0):
        raise ValueError("its times do not increase")
    return tracks, times_s


def _world(node: int, nodes: list[Document], parents: dict[int, int], tracks: Tracks, t: int) -> FloatArray:
    """(t, 4, 4) of one node, its parents before it."""

    def values(name: str, default: tuple[float, ...]) -> FloatArray:
        still = np.asarray(nodes[node].get(name, default), dtype=np.float64)
        return tracks.get((node, name), np.tile(still, (t, 1)))

    local = np.zeros((t, 4, 4))
    rotation = Rotation.from_quat(values("rotation", (0.0, 0.0, 0.0, 1.0))).as_matrix()
    local[:, :3, :3] = rotation * values("scale", (1.0, 1.0, 1.0))[:, None, :]
    local[:, :3, 3] = values("translation", (0.0, 0.0, 0.0))
    local[:, 3, 3] = 1.0
    return _world(parents[node], nodes, parents, tracks, t) @ local if node in parents else local
