"""Inverse kinematics beside other libraries: what is compared must be the same hand and the same answer."""

from __future__ import annotations

import argparse
import sys

import numpy as np
import pytest

from app.bench import ik
from app.peers.lm import LevenbergMarquardt
from app.peers.mujoco_hand import MujocoHand
from app.peers.pinocchio_hand import PinocchioHand
from core.hand.model import template
from core.kinematics.forward import markers_world
from core.kinematics.prior import REST_PRIOR
from core.kinematics.solver import HandPose, HandSolver
from core.markers.layout import load_layout

SKELETON, LAYOUT = template().skeleton, load_layout("han19")


@pytest.fixture(params=[MujocoHand, PinocchioHand])
def hand(request: pytest.FixtureRequest):
    try:
        return request.param(SKELETON, LAYOUT)
    except ImportError as error:
        pytest.skip(f"{error.name} is not installed (extra bench)")


def random_theta(seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.concatenate([random.normal(size=6), random.uniform(*SKELETON.limits_rad.T)])


@pytest.mark.parametrize("seed", range(5))
def test_the_hand_in_the_other_library_is_ours(hand, seed: int) -> None:
    theta = random_theta(seed)
    hand.put(theta)
    np.testing.assert_allclose(
        hand.moved(np.zeros(26)), markers_world(SKELETON, theta, LAYOUT.joints, LAYOUT.positions_m), atol=1e-12
    )
    jacobian, h = hand.jacobian().copy(), 1e-6
    for d, step in enumerate(h * np.eye(26)):
        difference = (hand.moved(step).copy() - hand.moved(-step)) / (2 * h)
        np.testing.assert_allclose(jacobian[:, d].reshape(-1, 3), difference, atol=1e-8)
    np.testing.assert_allclose(hand.theta()[6:], theta[6:], atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_method_around_it_is_ours(hand, seed: int) -> None:
    random = np.random.default_rng(seed)
    truth = random_theta(seed)
    truth[6:] *= 0.7
    targets = markers_world(SKELETON, truth, LAYOUT.joints, LAYOUT.positions_m) + random.normal(0, 0.001, (19, 3))
    start = truth + random.normal(0, 0.05, 26)
    pose = HandPose.at_rest(19)
    pose.theta_rad[:] = start
    HandSolver(SKELETON, LAYOUT).solve(pose, targets, np.ones(19), iterations=100, tolerance=0.0)
    theirs = LevenbergMarquardt(hand, SKELETON.limits_rad, REST_PRIOR).solve(start, targets, np.ones(19), 100)
    np.testing.assert_allclose(theirs[6:], pose.theta_rad[6:], atol=1e-6)


def run(capsys: pytest.CaptureFixture[str]) -> tuple[dict, str]:
    parser = argparse.ArgumentParser()
    ik.add_options(parser)
    figures = ik.run(parser.parse_args(["--frames", "40"]))
    return figures, capsys.readouterr().out


def test_every_way_is_timed_and_the_answers_agree(capsys: pytest.CaptureFixture[str]) -> None:
    figures, printed = run(capsys)
    for name in ("full", "subspace 6 + 5", "subspace 6 + 12", "layered, 6 + 8 then full", "full, 4 hands in one call"):
        assert figures[name]["median_us"] <= figures[name]["p99_us"]
        assert name in printed
    assert figures["full"]["joints_off_m"] < 0.001
    assert "joints_off_m" not in figures.get("MuJoCo's Jacobian alone", {})
    peers = [value for value in figures.values() if isinstance(value, dict) and "apart_rad" in value]
    assert "scipy, finite differences" in figures
    assert all(peer["apart_rad"] < 1e-5 for peer in peers)


def test_a_library_that_is_missing_is_named_with_its_remedy(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    figures, printed = run(capsys)
    assert printed.count("not installed: pip install 'phalanx[bench]'") == 2
    assert not any("Jacobian" in name for name in figures)
