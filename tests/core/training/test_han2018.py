from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the extra train")
pytest.importorskip("onnx", reason="needs the extra train")

from core.frames import NO_POINT  # noqa: E402
from core.training.depth_image import SIZE, best_turn, images, matched, viewed  # noqa: E402
from core.training.han2018 import HanNetwork  # noqa: E402


def test_layers_have_the_published_sizes() -> None:
    model = HanNetwork(19)
    image, sizes = torch.zeros(2, 1, SIZE, SIZE), []
    for layer in model.convolutions:
        sizes.append(tuple(image.shape[1:]))
        image = layer(image)
    into_convolutions = [
        size for size, layer in zip(sizes, model.convolutions, strict=True) if hasattr(layer, "kernel_size")
    ]
    assert into_convolutions == [
        (1, 52, 52), (64, 50, 50), (64, 48, 48), (64, 24, 24), (128, 22, 22), (128, 20, 20), (128, 18, 18)
    ]  # fmt: skip
    assert image.flatten(1).shape == (2, 10368) and model(torch.zeros(2, 1, SIZE, SIZE)).shape == (2, 19, 3)


def test_the_image_holds_every_point_at_its_depth_within_the_margin() -> None:
    points = np.random.default_rng(1).normal(0.0, 0.05, (3, 20, 3))
    valid = np.ones((3, 20), dtype=np.bool_)
    valid[2, 5:] = False
    turns = np.tile(np.eye(3), (3, 1, 1))
    seen, zoom, reach = viewed(points, valid, turns)
    assert np.abs(seen[valid][:, :2]).max() == pytest.approx(0.8)
    assert seen[valid][:, 2].min() == pytest.approx(0.1) and seen[valid][:, 2].max() == pytest.approx(1.0)
    flat = (seen[0, :, :2] - seen[0, 0, :2]) / zoom[0]
    np.testing.assert_allclose(flat, points[0, :, :2] - points[0, 0, :2], atol=1e-12)
    depth = (seen[0, :, 2] - seen[0, 0, 2]) / 0.9 * reach[0, 0, 0]
    np.testing.assert_allclose(depth, points[0, :, 2] - points[0, 0, 2], atol=1e-12)
    drawn = images(seen, valid)
    assert (drawn[2] > 0.0).sum() == 5
    np.testing.assert_allclose(np.sort(drawn[2][drawn[2] > 0.0]), np.sort(seen[2, :5, 2]), rtol=1e-6)


def test_of_ten_axes_the_one_that_spreads_the_points_most() -> None:
    flat = np.random.default_rng(2).normal(0.0, 1.0, (30, 3)) * (1.0, 1.0, 1e-3)
    turn = best_turn(np.random.default_rng(3), flat)
    assert abs(turn[2] @ (0.0, 0.0, 1.0)) > 0.7  # looks along the thin side
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)


def test_markers_take_the_points_with_the_least_sum_of_distances() -> None:
    places = np.array([[0.0, 0, 0], [1.0, 0, 0], [5.0, 0, 0]])
    points = np.array([[0.9, 0, 0], [0.1, 0, 0]])
    assert matched(places, points).tolist() == [1, 0, NO_POINT]
