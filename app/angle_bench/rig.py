"""A hand that is not ours: the generic hand of WebXR, with its own bones, skin and axes.

A glTF file whose skin has the 25 joints that WebXR names (WebXR Hand Input, section "Skeleton joints"). There each
joint's frame has -Z along its bone to the fingertip and +Y out of the back of the hand; the axes are taken from these
frames: flexion about -X, abduction about Y (ring and little finger: about -Y), of fingers abduction first, of the thumb
flexion first. The frame of its wrist is our hand frame. The fingers' metacarpals stay with the wrist.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import FloatArray
from core.gltf import Gltf, read_gltf
from core.hand.imports.gltf import JOINTS, TIPS, our_joint
from core.hand.model import HandModel
from core.hand.skeleton import DIGIT_DOF_NAMES, DOF_JOINTS, N_JOINTS, Skeleton

FILE = "right.glb"
FOLDER = "webxr_generic_hand"

WIDEST_RAD = np.radians(170.0)


def folder_in(data: Path) -> Path | None:
    """Where the hand lies in a folder of recordings, or in that of the hand itself; None if it is not there."""
    folders = (data, data / FOLDER, data / "hands" / FOLDER)
    return next((folder for folder in folders if (folder / FILE).is_file()), None)


def read_rig(folder: Path) -> HandModel:
    """The right hand of a folder such as `webxr_generic_hand`, in the frame of its wrist [m], about its own axes.

    Raises FormatError where the file is not there or not such a hand.
    """
    path = folder / FILE
    try:
        gltf = read_gltf(path)
        return _hand(gltf)
    except (OSError, KeyError, IndexError, TypeError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise FormatError(
            f"{path} cannot be read as the generic hand of WebXR ({why}).",
            f"Give the folder that holds {FILE} of WebXR's generic hand as --data.",
        ) from error


def _hand(gltf: Gltf) -> HandModel:
    skin = gltf.document["skins"][0]
    names = [str(gltf.document["nodes"][node]["name"]) for node in skin["joints"]]
    bind = np.linalg.inv(gltf.array(skin["inverseBindMatrices"]))
    wrist = np.linalg.inv(bind[names.index("wrist")])
    frames = {name: wrist @ matrix for name, matrix in zip(names, bind, strict=True)}
    primitive = gltf.document["meshes"][0]["primitives"][0]
    attributes = primitive["attributes"]
    vertices = gltf.array(attributes["POSITION"]) @ wrist[:3, :3].T + wrist[:3, 3]
    faces = gltf.array(primitive["indices"]).astype(np.int64).reshape(-1, 3)
    carriers = np.array([our_joint(name) for name in names])
    joints = carriers[gltf.array(attributes["JOINTS_0"]).astype(np.int64)]
    weights = gltf.array(attributes["WEIGHTS_0"])
    weights /= weights.sum(axis=1, keepdims=True)
    return HandModel(_skeleton(frames), vertices, faces, joints, weights)


def _skeleton(frames: dict[str, FloatArray]) -> Skeleton:
    axes = np.empty((len(DIGIT_DOF_NAMES), 3))
    for i, (name, joint) in enumerate(zip(DIGIT_DOF_NAMES, DOF_JOINTS, strict=True)):
        x, y, _ = frames[JOINTS[joint]][:3, :3].T
        ulnar = name.startswith(("ring", "pinky"))
        axis = -x if name.endswith("_flexion") else -y if ulnar else y
        axes[i] = axis / np.linalg.norm(axis)
    centres = np.array([frames[name][:3, 3] for name in JOINTS])
    tips = np.array([frames[name][:3, 3] for name in TIPS])
    assert centres.shape == (N_JOINTS, 3)
    return Skeleton(centres, tips, axes, np.tile([-WIDEST_RAD, WIDEST_RAD], (len(axes), 1)))
