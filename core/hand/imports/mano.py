"""A user's own MANO hand (Romero et al. 2017), from a .npz with the arrays of the model's file.

MANO's files are the user's, under its licence: none is shipped, and its pickles are not opened, for a pickle may run
anything. docs/imports.md tells how to make the .npz where MANO is installed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from core.errors import FormatError
from core.frames import FloatArray
from core.hand.imports.rig import MOST_FACES, MOST_VERTICES, Rig, fleshy_ends
from core.hand.skeleton import N_JOINTS
from core.untrusted.npz import read_npz

PARENTS = (-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 0, 10, 11, 0, 13, 14)
"""Of MANO's joints: wrist, then index, middle, pinky, ring and thumb, three each."""

OURS = (0, 13, 14, 15, 1, 2, 3, 4, 5, 6, 10, 11, 12, 7, 8, 9)
"""Number in MANO's order of each of our joints."""

LARGEST = 1e6
"""Of any number in it: metres, weights and betas are far below."""

_ARRAYS = ("v_template", "f", "weights", "J_regressor", "kintree_table")
_MAKE = "Make a .npz of " + ", ".join(_ARRAYS) + " where MANO is installed (docs/imports.md has the lines)."


def read_rig(path: Path) -> Rig:
    """The hand of a MANO file in its zero pose, shaped by `betas` if the file has any. Raises FormatError."""
    name = path.name
    if path.suffix.lower() in (".pkl", ".pickle"):
        raise FormatError(f"{name} is a pickle, which may run anything and is not opened.", _MAKE)
    arrays = read_npz(path, _ARRAYS, name, _MAKE, optional=("shapedirs", "betas"))
    vertices = _shaped(arrays, name)
    v = len(vertices)
    weights, regressor = (_floats(arrays, key, name) for key in ("weights", "J_regressor"))
    if weights.shape != (v, N_JOINTS) or regressor.shape != (N_JOINTS, v):
        raise FormatError(
            f"{name}: weights {weights.shape} and J_regressor {regressor.shape} of {v} vertices.",
            f"MANO's are ({v}, 16) and (16, {v}).",
        )
    parents = arrays["kintree_table"]
    if parents.shape != (2, N_JOINTS) or tuple(parents[0, 1:].tolist()) != PARENTS[1:]:
        raise FormatError(f"{name}: its joints do not hang together as MANO's 16 do.", _MAKE)
    faces = arrays["f"]
    if faces.ndim != 2 or faces.shape[1] != 3 or len(faces) > MOST_FACES or faces.dtype.kind not in "iu":
        raise FormatError(f"{name}: f is {faces.dtype} {faces.shape}.", "MANO's faces are (1538, 3) whole numbers.")
    joints = (regressor @ vertices)[list(OURS)]
    ours = weights[:, list(OURS)]
    return Rig(name, joints, fleshy_ends(joints, vertices, ours), vertices, faces.astype(np.int64), ours)


def _shaped(arrays: dict[str, NDArray[np.generic]], name: str) -> FloatArray:
    """(v, 3): the template, and what betas make of it."""
    vertices = _floats(arrays, "v_template", name)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not 0 < len(vertices) <= MOST_VERTICES:
        raise FormatError(f"{name}: v_template is {vertices.shape}.", "MANO's is (778, 3).")
    if "betas" not in arrays:
        return vertices
    betas = _floats(arrays, "betas", name).ravel()
    directions = _floats(arrays, "shapedirs", name) if "shapedirs" in arrays else np.zeros((0, 0, 0))
    if directions.shape[:2] != vertices.shape or directions.ndim != 3 or directions.shape[2] < len(betas):
        raise FormatError(
            f"{name} has {len(betas)} betas and shapedirs {directions.shape}.", "MANO's shapedirs are (778, 3, 10)."
        )
    shaped: FloatArray = vertices + directions[:, :, : len(betas)] @ betas
    return shaped


def _floats(arrays: dict[str, NDArray[np.generic]], key: str, name: str) -> FloatArray:
    array = arrays[key]
    try:
        values = array.astype(np.float64, casting="same_kind" if array.dtype.kind == "f" else "safe")
    except TypeError as error:
        raise FormatError(f"{name}: {key} holds {array.dtype}, not numbers.", _MAKE) from error
    largest = float(np.abs(values).max(initial=0.0))  # NaN where there is any
    if not largest <= LARGEST:
        raise FormatError(f"{name}: {key} holds the number {largest:g}.", _MAKE)
    return values
