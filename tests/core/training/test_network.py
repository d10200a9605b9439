from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the extra train")
pytest.importorskip("onnx", reason="needs the extra train")

from core.errors import FormatError  # noqa: E402
from core.labelling.marker_features import UNIT_M, marker_features  # noqa: E402
from core.labelling.network import LabelNetwork  # noqa: E402
from core.markers.layout import load_layout  # noqa: E402
from core.training.calibration import fitted_temperature  # noqa: E402
from core.training.clouds import made  # noqa: E402
from core.training.export import export  # noqa: E402
from core.training.loop import answered, asked_of, loss_of, question, rate, train  # noqa: E402
from core.training.network import Answer, Labeller  # noqa: E402
from core.training.poses import Pool, pool  # noqa: E402
from core.training.supply import supply, taken  # noqa: E402

LAYOUT = load_layout("han19")
FEATURES = torch.from_numpy(marker_features(LAYOUT))[None]


@pytest.fixture(scope="module")
def model() -> Labeller:
    torch.manual_seed(3)
    model = Labeller().eval()
    with torch.no_grad():  # away from what it is at the start, where much is near zero
        for weights in model.parameters():
            weights += 0.05 * torch.randn_like(weights)
        for volumes in (model.volumes, model.last_volumes):
            volumes.project.weight *= 6.0
    return model


def cloud(n: int = 21) -> torch.Tensor:
    return torch.from_numpy(np.random.default_rng(5).normal(0.0, 0.05, (1, n, 3)).astype(np.float32))


def ask(model: Labeller, points: torch.Tensor, side: float, features: torch.Tensor = FEATURES) -> Answer:
    with torch.no_grad():
        answer: Answer = model(points, torch.tensor([side]), features)
    return answer


def close(a: torch.Tensor, b: torch.Tensor) -> None:
    torch.testing.assert_close(a, b, atol=2e-3, rtol=2e-3)


def test_points_in_another_order_get_the_same_answers(model: Labeller) -> None:
    order = torch.randperm(21)
    before, after = ask(model, cloud(), 1.0), ask(model, cloud()[:, order], 1.0)
    close(after.label, before.label[:, order])
    close(after.side, before.side[:, order])
    close(after.hidden, before.hidden)


def test_markers_in_another_order_get_the_same_answers(model: Labeller) -> None:
    order = torch.randperm(19)
    before, after = ask(model, cloud(), -1.0), ask(model, cloud(), -1.0, FEATURES[:, order])
    close(after.label, before.label[..., torch.cat([order, torch.tensor([19])])])
    close(after.hidden, before.hidden[:, order])
    close(after.side, before.side)


def test_where_and_how_turned_a_hand_is_does_not_matter_and_a_mirror_exchanges_the_sides(model: Labeller) -> None:
    turn = torch.linalg.qr(torch.randn(3, 3))[0]
    mirrored = bool(torch.det(turn) < 0.0)
    for flip in (False, True):
        moved = cloud() @ turn.T * (torch.tensor([-1.0, 1.0, 1.0]) if flip else 1.0) + 0.3
        sign = -1.0 if mirrored != flip else 1.0
        for side in (0.0, 1.0, -1.0):
            before, after = ask(model, cloud(), side), ask(model, moved, sign * side)
            close(after.label, before.label)
            close(after.hidden, before.hidden)
            close(after.side, sign * before.side)
    assert ask(model, cloud(), 0.0).side.abs().max() > 0.02
    assert (ask(model, cloud(), 1.0).label - ask(model, cloud(), -1.0).label).abs().max() > 0.02


def test_padding_and_other_clouds_of_the_batch_change_nothing(model: Labeller) -> None:
    clouds = made(np.random.default_rng(1), few(), [load_layout("alexanderson13"), LAYOUT], 4, False)
    asked = np.ones(8)
    with torch.no_grad():
        together = answered(model, question(clouds, asked))
        for row in range(8):
            alone = taken(clouds, np.array([row]))
            n, m = int(alone.valid.sum()), len(clouds.layouts[clouds.layout[row]].joints)
            features = torch.from_numpy(marker_features(clouds.layouts[clouds.layout[row]]))[None].clone()
            features[0, :, :3] = torch.from_numpy(clouds.told_m[row, :m] / UNIT_M)
            single = model(torch.from_numpy(alone.points_m[:, :n]), torch.ones(1), features)
            close(together.label[row, :n, :m], single.label[0, :, :m])
            close(together.label[row, :n, -1], single.label[0, :, -1])
            close(together.hidden[row, :m], single.hidden[0])


@cache
def few() -> Pool:
    return pool(np.random.default_rng(1), 300, 1)


def test_questions_say_what_is_true() -> None:
    clouds = made(np.random.default_rng(2), few(), [LAYOUT], 12, True)
    posed = question(clouds, np.resize([1.0, -1.0, 0.0], 12))
    for row in range(12):
        for point in np.flatnonzero(clouds.valid[row]):
            wanted, sign = int(posed.wanted[row, point]), [0, -1, 1][int(clouds.side[row, point]) + 1]
            meant = clouds.label[row, point] >= 0 and (row % 3 == 2 or sign == [1, -1][row % 3])
            assert wanted == (clouds.label[row, point] if meant else 19)
            if meant and row % 3 != 2:
                assert int(posed.where[row, wanted]) == point
        hidden = set(range(19)) - set(posed.wanted[row].tolist())
        assert all(int(posed.where[row, k]) == clouds.valid.shape[1] for k in hidden)
        assert bool(posed.single[row]) == (row % 3 != 2)


def test_training_learns_ends_when_told_and_keeps_the_best() -> None:
    torch.manual_seed(0)
    model, batches = Labeller(), supply(0, few())
    clouds = next(batches)
    fixed = question(clouds, asked_of(np.random.default_rng(0), clouds))
    before = float(loss_of(answered(model, fixed), fixed).detach())
    kept: list[float] = []
    rounds = iter(range(12))
    last = train(
        model, batches, next(batches), 1e6, 0, lambda progress: None, lambda better: kept.append(1.0),
        stopped=lambda: next(rounds, None) is None, report_every_s=1e6,
    )  # fmt: skip
    assert 11 * 64 <= last.samples <= 12 * 96 and len(kept) == 1
    with torch.no_grad():
        assert float(loss_of(answered(model, fixed), fixed)) < before
    assert rate(0.0) < rate(0.02) < rate(0.03) > rate(0.5) > rate(1.0) > 0.0


def test_the_exported_network_says_what_the_trained_one_says(model: Labeller, tmp_path: Path) -> None:
    clouds = made(np.random.default_rng(3), few(), [LAYOUT], 32, False)
    temperature = fitted_temperature(model, clouds)
    path = tmp_path / "network.onnx"
    export(model, temperature, {"seed": "3"}, path)
    assert path.stat().st_size < 1_000_000 and list(tmp_path.iterdir()) == [path]
    network = LabelNetwork(path)
    assert network.about["seed"] == "3"
    for name in ("han19", "qualisys13"):
        layout = load_layout(name)
        features = torch.from_numpy(marker_features(layout))[None]
        for n, side, sign in ((1, None, 0.0), (7, "left", -1.0), (21, "right", 1.0), (45, None, 0.0)):
            answer = ask(model, cloud(n) - cloud(n).mean(1, keepdim=True), sign, features)
            labels = network.labels(cloud(n)[0].double().numpy() + 10.0, layout, side)  # type: ignore[arg-type]
            rows = torch.softmax(answer.label[0] / temperature, dim=-1).numpy()
            # Weights are stored in half precision.
            np.testing.assert_allclose(labels.label, rows, atol=0.01)
            np.testing.assert_allclose(labels.label.sum(1), 1.0, atol=1e-5)
            np.testing.assert_allclose(labels.point.sum(1), 1.0, atol=1e-5)
            np.testing.assert_allclose(labels.right, torch.sigmoid(answer.side[0]).numpy(), atol=0.01)


def test_the_exported_network_takes_several_clouds_at_once(model: Labeller, tmp_path: Path) -> None:
    path = tmp_path / "network.onnx"
    export(model, 1.0, {}, path)
    onnx = pytest.importorskip("onnx")
    shape = [axis.dim_param for axis in onnx.load(str(path)).graph.input[0].type.tensor_type.shape.dim]
    assert shape[:2] == ["b", "n"]
    network, points, sizes = LabelNetwork(path), cloud(21)[0].double().numpy(), (0.7, 1.0, 1.3)
    for size, labels in zip(sizes, network.labels_at(sizes, points, LAYOUT, "right"), strict=True):
        (alone,) = network.labels_at((size,), points, LAYOUT, "right")
        np.testing.assert_allclose(labels.label, alone.label, atol=1e-4)
        np.testing.assert_allclose(labels.point, alone.point, atol=1e-4)
        np.testing.assert_allclose(labels.right, alone.right, atol=1e-4)


def test_a_network_that_cannot_be_written_says_so(model: Labeller, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"n\.onnx"):
        export(model, 1.0, {}, tmp_path / "nowhere" / "n.onnx")
