from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the extra train")
pytest.importorskip("onnx", reason="needs the extra train")

from core.errors import FormatError  # noqa: E402
from core.labelling.network import LabelNetwork  # noqa: E402
from core.markers.layout import load_layout  # noqa: E402
from core.training.export import export  # noqa: E402
from core.training.network import LAYERS, Labeller  # noqa: E402
from core.training.restored import restored  # noqa: E402

SHIPPED = Path(__file__).parents[3] / "resources" / "networks" / "labeller.onnx"


def test_a_network_comes_back_from_its_file_weight_by_weight(tmp_path: Path) -> None:
    torch.manual_seed(1)
    model = Labeller()
    with torch.no_grad():
        for weights in model.parameters():  # no two numbers alike that could be taken for each other
            weights += 0.05 * torch.randn_like(weights)
    export(model, 0.7, {}, tmp_path / "first.onnx")
    again = restored(tmp_path / "first.onnx")
    for (name, there), back in zip(model.named_parameters(), again.parameters(), strict=True):
        torch.testing.assert_close(back, there, rtol=1e-3, atol=1e-6, msg=name)
    export(again, 0.7, {}, tmp_path / "second.onnx")
    layout = load_layout("han19")
    points = layout.positions_m + np.random.default_rng(0).normal(0.0, 0.004, (19, 3))
    first, second = (LabelNetwork(tmp_path / f"{name}.onnx").labels(points, layout) for name in ("first", "second"))
    np.testing.assert_array_equal(first.label, second.label)
    np.testing.assert_array_equal(first.point, second.point)
    np.testing.assert_array_equal(first.right, second.right)


def test_a_network_with_fewer_layers_comes_back_with_more_and_says_the_same(tmp_path: Path) -> None:
    torch.manual_seed(2)
    model = Labeller(LAYERS - 1)
    with torch.no_grad():
        for weights in model.parameters():
            weights += 0.05 * torch.randn_like(weights)
    export(model, 0.7, {}, tmp_path / "shallow.onnx")
    deeper = restored(tmp_path / "shallow.onnx")
    assert len(deeper.attention) == LAYERS
    export(deeper, 0.7, {}, tmp_path / "deep.onnx")
    layout = load_layout("alexanderson13")
    points = layout.positions_m + np.random.default_rng(0).normal(0.0, 0.004, (13, 3))
    shallow, deep = (LabelNetwork(tmp_path / f"{name}.onnx").labels(points, layout) for name in ("shallow", "deep"))
    np.testing.assert_allclose(deep.label, shallow.label, atol=1e-5)
    np.testing.assert_allclose(deep.point, shallow.point, atol=1e-5)


def test_the_shipped_network_can_be_trained_on() -> None:
    model = restored(SHIPPED)
    assert all(torch.isfinite(weights).all() for weights in model.parameters())
    card = json.loads(SHIPPED.with_suffix(".json").read_text(encoding="utf-8"))
    assert card["parameters"] == sum(weights.numel() for weights in model.parameters())


def test_a_file_that_is_no_such_network_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.onnx").write_text("words")
    for path in (tmp_path / "text.onnx", tmp_path / "nowhere.onnx"):
        with pytest.raises(FormatError, match=path.name):
            restored(path)
