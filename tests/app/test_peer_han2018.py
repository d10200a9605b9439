"""The network of Han 2018 as a peer: what its file says is what it names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.peers.han2018 import HanNamer
from core.errors import FormatError
from core.frames import NO_POINT
from core.markers.layout import load_layout

LAYOUT = load_layout("alexanderson13")


def network(path: Path, places: np.ndarray) -> Path:
    """A file that sees the same places in every image."""
    onnx = pytest.importorskip("onnx", reason="needs the extra train")
    helper, floats = onnx.helper, onnx.TensorProto.FLOAT
    said = onnx.numpy_helper.from_array(places[None].astype(np.float32), "said")
    graph = helper.make_graph(
        [helper.make_node("ReduceMax", ["image"], ["most"], axes=[1, 2, 3], keepdims=0),
         helper.make_node("Sub", ["most", "most"], ["nothing"]),
         helper.make_node("Add", ["said", "nothing"], ["places"])],
        "places", [helper.make_tensor_value_info("image", floats, ["b", 1, 52, 52])],
        [helper.make_tensor_value_info("places", floats, ["b", len(places), 3])], [said],
    )  # fmt: skip
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), str(path))
    return path


def test_points_take_the_names_of_the_places_and_lefts_are_seen_in_the_mirror(tmp_path: Path) -> None:
    from core.training.depth_image import best_turn, viewed

    order = np.random.default_rng(1).permutation(13)
    points = LAYOUT.positions_m[order]
    turn = best_turn(np.random.default_rng(0), points)
    seen, _, _ = viewed(points[None], np.ones((1, 13), dtype=np.bool_), turn[None])
    namer = HanNamer(network(tmp_path / "n.onnx", seen[0][np.argsort(order)]))
    right = namer.name(points, LAYOUT, "right")
    np.testing.assert_array_equal(right.point, np.argsort(order))
    left = namer.name(points * (-1.0, 1.0, 1.0), LAYOUT, "left")
    np.testing.assert_array_equal(left.point, right.point)
    few = namer.name(points[:10], LAYOUT, "right")
    assert (few.point == NO_POINT).sum() == 3 and len(set(few.point[few.point != NO_POINT])) == 10
    with pytest.raises(FormatError, match="13 markers"):
        namer.name(points, load_layout("han19"), "right")


def test_another_network_is_refused(tmp_path: Path) -> None:
    (tmp_path / "n.onnx").write_text("words")
    shipped = Path(__file__).parents[2] / "resources" / "networks" / "labeller.onnx"
    for path in (tmp_path / "n.onnx", shipped):
        with pytest.raises(FormatError, match=path.name):
            HanNamer(path)
