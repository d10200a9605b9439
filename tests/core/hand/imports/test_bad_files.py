"""Whatever is wrong with a file of a hand: one error that names it, never anything else."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from core.errors import FormatError
from core.hand.imports import gltf, mano
from core.hand.imports.load import load_hand
from core.hand.model import HandModel, template
from tests.core.hand.imports.files import dense, mano_arrays, write_webxr


@pytest.fixture(scope="module")
def small() -> HandModel:
    """A hand of few faces: enough for what is wrong elsewhere."""
    hand = template()
    return HandModel(hand.skeleton, hand.vertices_m, hand.faces[::40], hand.skin_joints, hand.skin_weights)


@pytest.fixture
def glb(tmp_path: Path, small: HandModel) -> Path:
    write_webxr(tmp_path / "hand.glb", small, np.zeros(26))
    return tmp_path / "hand.glb"


def parts(path: Path) -> tuple[dict, bytes]:
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def put(path: Path, document: dict, buffer: bytes) -> None:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(buffer), len(text), 0x4E4F534A)
    path.write_bytes(head + text + struct.pack("<II", len(buffer), 0x4E4942) + buffer)


def test_a_file_cut_anywhere_is_named(glb: Path) -> None:
    data = glb.read_bytes()
    for length in (0, 3, 11, 19, 200, len(data) // 2, len(data) - 1):
        glb.write_bytes(data[:length])
        with pytest.raises(FormatError, match=r"^hand\.glb is not a sound glTF file: "):
            load_hand(glb)


def change(key: str, number: int, field: str, value: object):
    def changed(document: dict) -> None:
        document[key][number][field] = value

    return changed


def without_joint(document: dict) -> None:
    document["nodes"][4]["name"] = "index-finger-phalanx-prox"


def in_a_circle(document: dict) -> None:
    document["nodes"][0]["children"] = [25]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (change("accessors", 0, "count", 10**12), "does not fit into"),
        (change("accessors", 0, "count", -1), "-1 stands where a number of things is meant"),
        (change("accessors", 0, "byteOffset", 10**9), "does not fit into"),
        (change("accessors", 3, "componentType", 5126), "."),
        (change("accessors", 1, "componentType", 1), "it lacks 1"),
        (change("accessors", 2, "sparse", {}), "stores an array as sparse"),
        (change("bufferViews", 0, "byteLength", 8), "does not fit into the 8 bytes"),
        (change("bufferViews", 0, "byteStride", 1), "does not fit into"),
        (change("bufferViews", 2, "byteOffset", True), "True stands where"),
        (change("accessors", 4, "count", 7), "inverse bind matrices"),
        (change("skins", 0, "joints", [0]), "has no joint thumb-metacarpal"),
        (change("meshes", 0, "primitives", []), "no triangles"),
        (change("nodes", 26, "skin", 3), "list index out of range"),
        (without_joint, "has no joint index-finger-phalanx-proximal"),
        (in_a_circle, "hang in a circle"),
    ],
)
def test_a_document_that_asks_for_what_is_not_there(glb: Path, wrong, said: str) -> None:
    document, buffer = parts(glb)
    wrong(document)
    put(glb, document, buffer)
    with pytest.raises(FormatError, match=rf"^hand\.glb.*{said}"):
        load_hand(glb)


def parts_again(document: dict) -> None:
    """All of the same vertices: a file of a megabyte would take gigabytes."""
    document["meshes"][0]["primitives"] *= 1000


def skins_again(document: dict) -> None:
    """Every node's skin, of many joints, is looked through; not for each of them."""
    document["skins"].append({"joints": [0] * 100_000})
    document["nodes"][:0] = [{"mesh": 0, "skin": 1}] * 9_900


def joints_again(document: dict) -> None:
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    attributes |= {f"{what}_{n}": attributes[f"{what}_0"] for what in ("JOINTS", "WEIGHTS") for n in range(10_000)}


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (parts_again, "more than 100,000 vertices or 400,000 triangles"),
        (change("meshes", 0, "primitives", [{}] * 10_001), "10,001 parts"),
        (skins_again, "no joint"),
        (joints_again, "more than 20 joints each"),
        (lambda document: document["nodes"].extend([{}] * 10_000), "nodes; 10,000 at most are read"),
    ],
)
def test_a_document_that_makes_much_of_little(glb: Path, wrong, said: str) -> None:
    document, buffer = parts(glb)
    wrong(document)
    put(glb, document, buffer)
    with pytest.raises(FormatError, match=rf"^hand\.glb.*{said}"):
        load_hand(glb)


def test_no_change_of_a_byte_escapes(glb: Path) -> None:
    """Read, or refused with words: nothing else, whichever byte of the header or the document is another."""
    data = glb.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    random = np.random.default_rng(0)
    refused = 0
    for _ in range(150):
        broken = bytearray(data)
        for at in random.integers(0, 20 + length, random.integers(1, 4)):
            broken[at] = random.integers(256)
        glb.write_bytes(bytes(broken))
        try:
            gltf.read_rig(glb)
        except FormatError as error:
            assert str(error).startswith("hand.glb")
            refused += 1
    assert refused > 75


def test_units_and_numbers(glb: Path, small: HandModel) -> None:
    document, buffer = parts(glb)
    document["nodes"][25]["matrix"] = (np.diag([100.0, 100.0, 100.0, 1.0])).T.ravel().tolist()
    put(glb, document, buffer)
    with pytest.raises(FormatError, match=r"from wrist to middle fingertip it is 1\.8\d+e\+04 mm long"):
        load_hand(glb)
    nan = np.full(3, np.nan, dtype="<f4").tobytes()
    write_webxr(glb, small, np.zeros(26))
    document, buffer = parts(glb)
    put(glb, document, nan + buffer[12:])
    with pytest.raises(FormatError, match="holds a number that is none"):
        load_hand(glb)


def test_a_pickle_is_not_opened(tmp_path: Path) -> None:
    for name in ("MANO_RIGHT.pkl", "hand.pickle"):
        with pytest.raises(FormatError, match=r"is a pickle.*Make a \.npz of v_template, f"):
            load_hand(tmp_path / name)  # it does not even exist


@pytest.mark.parametrize(
    ("array", "value", "said"),
    [
        ("v_template", np.zeros((5, 2)), r"v_template is \(5, 2\)"),
        ("weights", np.zeros((3, 16)), "weights"),
        ("J_regressor", np.zeros((16, 3)), "J_regressor"),
        ("kintree_table", np.zeros((2, 16), dtype=np.int64), "do not hang together"),
        ("kintree_table", np.zeros(3), "do not hang together"),
        ("f", np.zeros((4, 3)), "f is float64"),
        ("f", np.full((4, 3), 10**6), "a face names vertex 1000000 of 6894"),
        ("v_template", np.array([["a", "b", "c"]]), "v_template holds"),
        ("betas", np.zeros(12), "has 12 betas"),
    ],
)
def test_mano_arrays_of_another_form(
    tmp_path: Path, small: HandModel, array: str, value: np.ndarray, said: str
) -> None:
    arrays = mano_arrays(small.vertices_m, small.faces, dense(small), small.skeleton.joint_positions_m)
    np.savez(tmp_path / "mano.npz", **(arrays | {array: value}))
    with pytest.raises(FormatError, match=rf"^mano\.npz.*{said}"):
        load_hand(tmp_path / "mano.npz")


def test_what_is_no_npz(tmp_path: Path) -> None:
    path = tmp_path / "mano.npz"
    with pytest.raises(FormatError, match=r"mano\.npz cannot be read"):
        mano.read_rig(path)
    path.write_bytes(b"PK\x03\x04 nothing")
    with pytest.raises(FormatError, match=r"is not a \.npz of plain arrays"):
        mano.read_rig(path)
    np.savez(path, **dict.fromkeys(mano._ARRAYS, np.array([{}], dtype=object)))
    with pytest.raises(FormatError, match="v_template holds object, not numbers or texts"):
        mano.read_rig(path)
    np.savez(path, v_template=np.zeros((778, 3)))
    with pytest.raises(FormatError, match="has no array f, weights, J_regressor, kintree_table"):
        mano.read_rig(path)
    with pytest.raises(FormatError, match="is no kind of hand"):
        load_hand(tmp_path / "hand.fbx")
