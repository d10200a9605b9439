"""A hand from a file, whatever made it."""

from __future__ import annotations

from pathlib import Path

from core.errors import FormatError
from core.frames import Side
from core.hand.imports import gltf, mano
from core.hand.imports.rig import ImportedHand, hand_of

_READERS = {".glb": gltf.read_rig, ".gltf": gltf.read_rig} | dict.fromkeys((".npz", ".pkl", ".pickle"), mano.read_rig)


def load_hand(path: Path, side: Side | None = None) -> ImportedHand:
    """A rigged glTF hand (.glb, .gltf) or a MANO file (.npz), as a right hand at our flat rest.

    side: of the file's hand; None = found from its geometry. Raises FormatError.
    """
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise FormatError(
            f"{path.name} is no kind of hand that can be read.", "Give a rigged .glb or .gltf, or a MANO .npz."
        )
    return hand_of(reader(path), side)
