"""The second hand of the tests as its file has it: moved by its own joints, axes and weights, with none of our code
for hands."""

from __future__ import annotations

import numpy as np
import pygltflib
from scipy.spatial.transform import Rotation

from tests.data import data_path

FINGERS = ("index-finger", "middle-finger", "ring-finger", "pinky-finger")
PARENTS = {
    "wrist": None,
    "thumb-metacarpal": "wrist",
    "thumb-phalanx-proximal": "thumb-metacarpal",
    "thumb-phalanx-distal": "thumb-phalanx-proximal",
    "thumb-tip": "thumb-phalanx-distal",
} | {
    f"{finger}-{bone}": f"{finger}-{before}" if before else "wrist"
    for finger in FINGERS
    for bone, before in (
        ("metacarpal", ""), ("phalanx-proximal", "metacarpal"), ("phalanx-intermediate", "phalanx-proximal"),
        ("phalanx-distal", "phalanx-intermediate"), ("tip", "phalanx-distal"),
    )
}  # fmt: skip
MOVING = tuple(name for name in PARENTS if "tip" not in name and "finger-metacarpal" not in name)
"""The 16 joints that move, in the order in which Phalanx has them."""

_TYPES = {5121: np.uint8, 5123: np.uint16, 5126: np.float32}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class WebXRHand:
    """vertices_m (v, 3), faces (f, 3), and for the 25 joints of `names` their bind poses (25, 4, 4)."""

    def __init__(self, side: str = "right") -> None:
        self.path = data_path("hands", "webxr_generic_hand", f"{side}.glb")
        file = pygltflib.GLTF2().load(str(self.path))

        def values(accessor: int) -> np.ndarray:
            a = file.accessors[accessor]
            view = file.bufferViews[a.bufferView]
            count = a.count * _WIDTHS[a.type]
            flat = np.frombuffer(file.binary_blob(), _TYPES[a.componentType], count, view.byteOffset)
            return flat.reshape(a.count, -1).astype(np.float64)

        (skin,) = file.skins
        attributes = file.meshes[0].primitives[0].attributes
        self.names = [file.nodes[joint].name for joint in skin.joints]
        inverse = values(skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
        self.inverse_bind, self.bind = inverse, np.linalg.inv(inverse)
        self.vertices_m = values(attributes.POSITION)
        self.faces = values(file.meshes[0].primitives[0].indices).astype(np.int64).reshape(-1, 3)
        self.joints, self.weights = values(attributes.JOINTS_0).astype(np.int64), values(attributes.WEIGHTS_0)

    def joints_world(self, turns: dict[str, Rotation], wrist: np.ndarray) -> np.ndarray:
        """(25, 4, 4): every joint turned in its own frame, the whole hand moved by `wrist` (4, 4)."""
        world: dict[str, np.ndarray] = {}
        for name, parent in PARENTS.items():
            bind = self.bind[self.names.index(name)]
            before = np.eye(4) if parent is None else self.bind[self.names.index(parent)]
            turn = np.eye(4)
            if name in turns:
                turn[:3, :3] = turns[name].as_matrix()
            world[name] = (wrist @ bind if parent is None else world[parent] @ np.linalg.inv(before) @ bind) @ turn
        return np.stack([world[name] for name in self.names])

    def skinned_m(self, joints_world: np.ndarray) -> np.ndarray:
        """(v, 3) [m], its own linear blend skinning."""
        matrices = joints_world @ self.inverse_bind
        blended = np.einsum("vk,vkij->vij", self.weights, matrices[self.joints])
        return np.einsum("vij,vj->vi", blended[:, :3, :3], self.vertices_m) + blended[:, :3, 3]

    def moving_m(self, joints_world: np.ndarray) -> np.ndarray:
        """(16, 3) [m], centres of the joints that Phalanx has."""
        return np.stack([joints_world[self.names.index(name), :3, 3] for name in MOVING])


def motion(hand: WebXRHand, frames: int) -> list[np.ndarray]:
    """Joints of a hand that closes and opens digit after digit while it turns: each frame's (25, 4, 4)."""
    made = []
    for t in np.linspace(0.0, 1.0, frames):
        turns = {}
        for k, finger in enumerate(FINGERS):
            bend = 0.5 - 0.5 * np.cos(2 * np.pi * (2 * t + 0.13 * k))
            spread = 10.0 * np.sin(2 * np.pi * (3 * t + 0.2 * k))
            degrees = (
                ("phalanx-proximal", -65.0 * bend),
                ("phalanx-intermediate", -80.0 * bend),
                ("phalanx-distal", -45 * bend),
            )
            for bone, flexion in degrees:
                angles = (spread if bone == "phalanx-proximal" else 0.0, flexion)
                turns[f"{finger}-{bone}"] = Rotation.from_euler("YX", angles, degrees=True)
        bend = 0.5 - 0.5 * np.cos(2 * np.pi * (2 * t + 0.4))
        aside = 12.0 * np.sin(2 * np.pi * 3 * t)
        turns["thumb-metacarpal"] = Rotation.from_euler("YX", (aside, -20.0 * bend), degrees=True)
        turns["thumb-phalanx-proximal"] = Rotation.from_euler("X", -30.0 * bend, degrees=True)
        turns["thumb-phalanx-distal"] = Rotation.from_euler("X", -45.0 * bend, degrees=True)
        wrist = np.eye(4)
        wrist[:3, :3] = Rotation.from_rotvec(
            [1.2 * np.sin(2 * np.pi * t), 0.5, 0.8 * np.cos(2 * np.pi * t)]
        ).as_matrix()
        wrist[:3, 3] = 0.2 * np.sin(2 * np.pi * t), 1.0, 0.1
        made.append(hand.joints_world(turns, wrist))
    return made
