"""A hand that goes into a file comes back: whatever its pose, side and unit, as glTF or as MANO's arrays."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from core.errors import FormatError
from core.hand.imports.load import load_hand
from core.hand.imports.measure import measure_shape
from core.hand.imports.rig import ImportedHand
from core.hand.mirror import mirror_points
from core.hand.model import HandModel, template
from core.hand.poses import pose
from core.hand.shape import N_SHAPE, HandShape, shaped_hand
from tests.core.hand.imports.files import dense, mano_arrays, write_webxr

SHAPE = HandShape(np.random.default_rng(5).uniform(0.85, 1.2, N_SHAPE))


@pytest.fixture(scope="module")
def hand() -> HandModel:
    return shaped_hand(template(), SHAPE)


def theta(name: str, share: float = 1.0) -> np.ndarray:
    return np.concatenate([[0.3, -0.2, 0.5, 0.9, -1.4, 0.4], share * pose(name)])


def check_same(imported: ImportedHand, hand: HandModel, joints_m: float, surface_m: float) -> None:
    """The joints of `hand` and its surface, up to how the palm was turned."""
    made, expected = imported.hand, hand
    np.testing.assert_allclose(made.skeleton.bone_lengths_m, expected.skeleton.bone_lengths_m, atol=1e-6)
    np.testing.assert_allclose(made.skeleton.joint_positions_m, expected.skeleton.joint_positions_m, atol=joints_m)
    assert made.skeleton.axes is template().skeleton.axes
    surface = trimesh.Trimesh(made.vertices_m, made.faces, process=False)
    assert surface.is_watertight and surface.is_winding_consistent and surface.volume > 0.0
    assert len(made.vertices_m) == len(expected.vertices_m)
    np.testing.assert_allclose(made.skin_weights.sum(axis=1), 1.0, atol=1e-12)
    nearest, _ = cKDTree(expected.vertices_m).query(made.vertices_m)
    assert np.percentile(nearest, 95) < surface_m  # folds of the skin in a closed hand cannot be smoothed out


@pytest.mark.parametrize(("side", "unit_m"), [("right", 1.0), ("left", 0.01)])
def test_a_glb_at_rest_is_the_same_hand(tmp_path: Path, hand: HandModel, side: str, unit_m: float) -> None:
    write_webxr(tmp_path / "hand.glb", hand, theta("rest"), side, unit_m)
    imported = load_hand(tmp_path / "hand.glb")
    assert imported.side == side
    # Its frame is the one in which its knuckles lie as the template's: a degree or two from the one it was made in.
    check_same(imported, hand, 0.008, 0.006)
    measured = measure_shape(imported.hand)
    np.testing.assert_allclose(measured.ratios[3:18], SHAPE.ratios[3:18], rtol=0.02)
    np.testing.assert_allclose(measured.ratios, SHAPE.ratios, rtol=0.06)


@pytest.mark.parametrize("name", ["relaxed", "cup", "spread", "flat", "grasp", "fist"])
def test_the_pose_of_the_file_does_not_matter(tmp_path: Path, name: str) -> None:
    """On the template itself every angle is found again, so its rest comes back to rounding."""
    hand = template()
    write_webxr(tmp_path / "hand.glb", hand, theta(name))
    imported = load_hand(tmp_path / "hand.glb", "right")
    check_same(imported, hand, 1e-5, 0.004)
    measured = measure_shape(imported.hand)
    np.testing.assert_allclose(measured.ratios[:18], 1.0, atol=0.03)
    np.testing.assert_allclose(measured.ratios[18:], 1.0, atol=0.05)


@pytest.mark.parametrize("name", ["rest", "relaxed", "fist", "point"])
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_side_is_seen_from_the_hand(tmp_path: Path, hand: HandModel, name: str, side: str) -> None:
    write_webxr(tmp_path / "hand.glb", hand, theta(name), side)
    assert load_hand(tmp_path / "hand.glb").side == side


def test_a_gltf_with_its_buffer_in_it_or_beside_it(tmp_path: Path, hand: HandModel) -> None:
    write_webxr(tmp_path / "hand.glb", hand, theta("relaxed"))
    data = (tmp_path / "hand.glb").read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    document, buffer = json.loads(data[20 : 20 + length]), data[28 + length :]
    expected = load_hand(tmp_path / "hand.glb").hand.vertices_m
    (tmp_path / "hand.bin").write_bytes(buffer)
    for uri in ("hand.bin", "data:application/octet-stream;base64," + base64.b64encode(buffer).decode()):
        document["buffers"][0]["uri"] = uri
        (tmp_path / "hand.gltf").write_text(json.dumps(document))
        assert np.array_equal(load_hand(tmp_path / "hand.gltf").hand.vertices_m, expected)
    document["buffers"][0]["uri"] = "../hand.bin"
    (tmp_path / "hand.gltf").write_text(json.dumps(document))
    with pytest.raises(FormatError, match="does not lie beside it"):
        load_hand(tmp_path / "hand.gltf")


@pytest.mark.parametrize("side", ["left", "right"])
def test_mano_arrays_are_the_same_hand(tmp_path: Path, hand: HandModel, side: str) -> None:
    turn = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # MANO's fingers point along x
    vertices, joints = (
        (mirror_points(points) if side == "left" else points) @ turn.T + (0.1, 0.0, 0.0)
        for points in (hand.vertices_m, hand.skeleton.joint_positions_m)
    )
    faces = hand.faces[:, ::-1] if side == "left" else hand.faces
    np.savez(tmp_path / "mano.npz", **mano_arrays(vertices, faces, dense(hand), joints))
    imported = load_hand(tmp_path / "mano.npz")
    assert imported.side == side
    # A MANO file has no fingertips: the last bones point to the middle of their skin, a few degrees off.
    lengths = imported.hand.skeleton.bone_lengths_m
    np.testing.assert_allclose(lengths[1:], hand.skeleton.bone_lengths_m[1:], atol=2e-6)
    np.testing.assert_allclose(measure_shape(imported.hand).ratios, SHAPE.ratios, rtol=0.08)


def test_betas_shape_a_mano_hand(tmp_path: Path) -> None:
    hand = template()
    arrays = mano_arrays(hand.vertices_m, hand.faces, dense(hand), hand.skeleton.joint_positions_m)
    np.savez(tmp_path / "mano.npz", **arrays, betas=np.array([0.1]))
    larger = load_hand(tmp_path / "mano.npz", "right").hand.skeleton.bone_lengths_m
    np.testing.assert_allclose(larger, 1.1 * hand.skeleton.bone_lengths_m, atol=2e-6)
    np.savez(tmp_path / "mano.npz", **arrays, betas=np.zeros(11))
    with pytest.raises(FormatError, match="has 11 betas and shapedirs"):
        load_hand(tmp_path / "mano.npz")


def test_an_open_wrist_is_closed(tmp_path: Path) -> None:
    hand = template()
    open_faces = hand.faces[(hand.vertices_m[hand.faces][..., 2] < 0.03).all(axis=1)]
    assert not trimesh.Trimesh(hand.vertices_m, open_faces, process=False).is_watertight
    arrays = mano_arrays(hand.vertices_m, open_faces, dense(hand), hand.skeleton.joint_positions_m)
    np.savez(tmp_path / "mano.npz", **arrays)
    made = load_hand(tmp_path / "mano.npz").hand
    surface = trimesh.Trimesh(made.vertices_m, made.faces, process=False)
    assert surface.is_watertight and surface.euler_number == 2
