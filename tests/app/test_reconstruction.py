"""The experiments of `phalanx bench reconstruction`, small: what must hold whatever the figures are."""

from __future__ import annotations

from argparse import Namespace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest

import app.reconstruction
from app.experiments import experiments_of
from app.reconstruction import fig11, fig15, table1
from app.reconstruction.methods import LAYERED, MAP, METHODS, STANDARD, Surface, markers_of, on_digits, reconstructed
from app.reconstruction.motions import han_motions, is_grasp, performed
from core.hand.model import skin, template
from core.hand.poses import pose
from core.hand.skeleton import N_DOFS
from core.kinematics.forward import joints_world, markers_world
from core.markers.layout import load_layout
from core.motion.subspace import shipped_subspace
from tests.app.command import phalanx
from tests.data import data_path

HAND = template()
TIPS = markers_of(load_layout("schroeder17"), table1.LAYOUTS["tips"], "tips")


@pytest.fixture(scope="module")
def motion() -> np.ndarray:
    return performed("grasping", seed=31, rate_hz=5.0)


def test_the_surface_is_the_skin(motion: np.ndarray) -> None:
    vertices = Surface(HAND).vertices_m(motion[:7])
    for t in range(7):
        np.testing.assert_allclose(
            vertices[:, t], skin(HAND, joints_world(HAND.skeleton, motion[t])), rtol=0.0, atol=1e-6
        )


def test_the_error_is_of_the_digits_alone(motion: np.ndarray) -> None:
    surface, moved = Surface(HAND), motion.copy()
    moved[:, :6] += 0.3
    assert surface.error([moved], [motion]).figures() == {"mean_mm": 0.0, "max_mm": 0.0, "p95_mm": 0.0}
    moved[:, 25] += 0.2  # the last joint of the pinky: some 13 to 20 mm long
    figures = surface.error([moved], [motion]).figures()
    assert 2.0 < figures["max_mm"] < 6.0
    assert figures["mean_mm"] < 0.2


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.title)
def test_the_root_is_as_given_and_the_limits_hold(motion: np.ndarray, method) -> None:
    (found,) = reconstructed(method, HAND.skeleton, TIPS, shipped_subspace("generic"), [motion[:40]])
    np.testing.assert_allclose(found[:, :6], motion[:40, :6], rtol=0.0, atol=1e-12)
    low, high = HAND.skeleton.limits_rad.T
    assert (found[:, 6:] >= low - 1e-9).all() and (found[:, 6:] <= high + 1e-9).all()


def test_all_markers_of_a_dense_layout_leave_nothing_open(motion: np.ndarray) -> None:
    surface, dense = Surface(HAND), load_layout("han19")
    (found,) = reconstructed(STANDARD, HAND.skeleton, dense, shipped_subspace("generic"), [motion])
    assert surface.error([found], [motion]).figures()["mean_mm"] < 0.2
    for t in (0, 100, 200):
        markers = [
            markers_world(HAND.skeleton, theta, dense.joints, dense.positions_m) for theta in (found[t], motion[t])
        ]
        np.testing.assert_allclose(*markers, atol=0.0015)


def test_who_knows_what_hands_do_does_better_with_four_markers(motion: np.ndarray) -> None:
    surface, subspace = Surface(HAND), shipped_subspace("generic")
    standard, layered, prior = (
        surface.error(reconstructed(method, HAND.skeleton, TIPS, subspace, [motion]), [motion]).figures()["mean_mm"]
        for method in (STANDARD, LAYERED, MAP)
    )
    assert layered < 0.8 * standard
    assert prior < 0.8 * standard


def test_what_looks_like_a_grasp() -> None:
    def held(name: str) -> np.ndarray:
        return np.tile(np.concatenate([np.zeros(6), pose(name)]), (10, 1))

    names = ("grasp", "cup", "flat", "spread", "fist", "point", "peace", "ok")
    assert [name for name in names if is_grasp(held(name))] == ["grasp", "cup"]
    assert is_grasp(np.concatenate([held("grasp"), held("flat")]))
    assert not is_grasp(np.concatenate([held("grasp"), held("flat"), held("flat")]))


def test_layouts_go_up_to_all_and_tell_of_digits() -> None:
    layouts = fig11.layouts()
    counts = [on_digits(layout) for layout in layouts]
    assert counts == sorted(counts) and (counts[0], counts[-1]) == (4, 16)
    assert {layout.name for layout in layouts} >= set(fig11.NAMED)
    subsets = [set(layout.marker_names) for layout in layouts if layout.name.startswith("first ")]
    assert all(a < b for a, b in pairwise(subsets))


def test_a_glove_that_is_all_seen_is_where_it_is() -> None:
    """fig15's solver on a hand it knows: all markers, exact, the root free."""
    motion, layout = performed("gestures", seed=4, rate_hz=20.0, seconds=6.0), load_layout("han19")
    points = np.stack([markers_world(HAND.skeleton, theta, layout.joints, layout.positions_m) for theta in motion])
    joints = np.stack([joints_world(HAND.skeleton, theta)[:, :3, 3] for theta in motion])
    found = fig15.solved(STANDARD, HAND.skeleton, layout, shipped_subspace("generic"), points)
    apart = np.linalg.norm(found - joints, axis=2)
    assert apart.mean() < 0.0003
    assert apart.max() < 0.003


def test_the_plot_is_drawn(tmp_path: Path) -> None:
    rows = [
        {"layout": f"first {count}", "on_digits": count, "errors": {"standard": {"mean_mm": 20.0 / count}}}
        for count in range(4, 16)
    ]
    fig11.plot({"made": {"rows": rows}}, ["made"], tmp_path / "fig11.png")
    from PySide6.QtGui import QImage

    picture = QImage(str(tmp_path / "fig11.png"))
    assert picture.width() >= 600
    places = product(range(0, picture.width(), 2), range(0, picture.height(), 2))
    colours = {picture.pixelColor(x, y).name() for x, y in places}
    assert {"#ffffff", fig11.COLOURS["standard"]} <= colours


def test_every_experiment_has_a_title() -> None:
    for name, module in experiments_of(app.reconstruction).items():
        assert (module.__doc__ or "").partition("\n")[0].endswith("."), name
    assert {"table1", "fig11", "fig15"} <= set(experiments_of(app.reconstruction))


def test_recordings_that_lack_are_said(tmp_path: Path) -> None:
    ran = phalanx("bench", "reconstruction", "--only", "table1", "--data", tmp_path)
    assert (ran.code, ran.err) == (
        1, "phalanx: table1 needs han2018. Give the folder that holds it as --data.\n"
    )  # fmt: skip


def test_fig15_on_the_recording() -> None:
    """Against itself the full set differs by nothing; every method that knows hands is near with 8 markers of 13."""
    data = data_path("qualisys_hand").parent
    ran = phalanx("bench", "reconstruction", "--only", "fig15", "--data", data, "--frames", 400, "--json")
    assert ran.code == 0
    figures = ran.figures["fig15"]
    assert figures["frames"] == 400
    for method in ("layered", "posture prior"):
        assert figures["generic"]["8"][method]["own"]["mean_mm"] < 5.0


def test_table1_on_han(monkeypatch: pytest.MonkeyPatch) -> None:
    data = data_path("han2018").parent
    motions = han_motions(data, 1, seed=2, most=40)
    assert len(motions) == 4 and all(motion.shape[1] == N_DOFS for motion in motions)
    again = han_motions(data, 1, seed=2, most=40)
    assert all(np.array_equal(a, b) for a, b in zip(motions, again, strict=True))
    monkeypatch.setattr(table1, "SEQUENCES", 2)
    figures = table1.run(Namespace(data=data, seed=0, frames=30))
    for kind in table1.KINDS:
        tips = figures[kind]["tips"]
        assert tips["layered"]["mean_mm"] < tips["standard"]["mean_mm"]
        assert tips["posture prior"]["mean_mm"] < tips["standard"]["mean_mm"]
        assert figures[kind]["five"]["layered"]["on_unmarked"] == 0.0
