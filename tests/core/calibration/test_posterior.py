"""What a calibration leaves open, and how alike its keyframes are."""

from __future__ import annotations

import numpy as np
import pytest

from core.calibration.alike import alike_shots
from core.calibration.bundle import Bundle
from core.calibration.geometry import Estimate
from core.calibration.posterior import information, left_open
from core.calibration.priors import KNOWN_SIZE_STD, POSTURE_WEAKNESS, priors_for
from core.frames import FloatArray
from core.hand.model import template
from core.hand.poses import POSE_NAMES, pose
from core.hand.shape import N_SHAPE
from core.hand.skeleton import N_DOFS
from core.profile import load_profile

PROFILE = load_profile("han19")
LAYOUT, M = PROFILE.layout, 19


def _scene(shots: int, slide_m: float, noise_m: float = 0.0005) -> tuple[Bundle, Estimate]:
    """Shots near the named poses, eight of each. slide_m: by how much every marker is off its place in all shots of one
    pose, in the frame of its bone."""
    random = np.random.default_rng(0)
    kinds = np.arange(shots) // 8
    names = [POSE_NAMES[kind % len(POSE_NAMES)] for kind in kinds]
    low, high = template().skeleton.limits_rad.T
    angles = np.stack([pose(name) for name in names]) + random.normal(0.0, 0.02, (shots, 20))
    thetas = np.concatenate([random.normal(0.0, 0.3, (shots, 6)), np.clip(angles, low + 0.05, high - 0.05)], axis=1)
    at = Estimate.of_poses(thetas, np.zeros(N_SHAPE), M)
    args = template().skeleton, LAYOUT.joints, LAYOUT.positions_m
    placed = Bundle(*args, np.zeros((shots, M, 3)), priors_for(PROFILE)).place(at)
    slides = random.normal(0.0, slide_m, (kinds.max() + 1, M, 3))[kinds]
    points = placed.markers_m + np.einsum("fmab,fmb->fma", placed.rotations[:, LAYOUT.joints], slides)
    points += random.normal(0.0, noise_m, points.shape)
    points[random.random(points.shape[:2]) < 0.05] = np.nan
    return Bundle(*args, points, priors_for(PROFILE)), at


def test_information_is_that_of_every_unknown_in_one_matrix() -> None:
    """Poses, the mean of the posture prior, and what is shared; the first two marginalised."""
    bundle, at = _scene(6, 0.0)
    normal = bundle.normal_equations(at, placed := bundle.place(at), bundle.residuals_m(placed), 0.001, 2.0)
    assert not normal.held.any()
    f, s, pulls = 6, bundle.n_shared, bundle.priors.posture_precision
    poses, mean = f * N_DOFS, slice(f * N_DOFS, f * N_DOFS + 20)
    whole = np.zeros((poses + 20 + s, poses + 20 + s))
    for k in range(f):
        rows = slice(k * N_DOFS, (k + 1) * N_DOFS)
        angles = slice(k * N_DOFS + 6, (k + 1) * N_DOFS)
        whole[rows, rows] = normal.pose[k]
        whole[rows, poses + 20 :] = normal.cross[k]
        whole[poses + 20 :, rows] = normal.cross[k].T
        whole[angles, mean] = whole[mean, angles] = -pulls
    whole[mean, mean] = f * pulls + POSTURE_WEAKNESS**2 * pulls
    whole[poses + 20 :, poses + 20 :] = normal.shared
    expected = np.linalg.inv(whole)[poses + 20 :, poses + 20 :]
    found = left_open(information(bundle, at, 0.001, 2.0), keep_shape=False)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found / scale, expected / scale, atol=1e-6)


def test_a_mean_that_is_not_known_leaves_more_open_than_the_poses_alone() -> None:
    bundle, at = _scene(40, 0.0)
    normal = bundle.normal_equations(at, placed := bundle.place(at), bundle.residuals_m(placed), 0.001, 1.0)
    flat = (-1, bundle.n_shared)
    alone = normal.shared - normal.cross.reshape(flat).T @ np.linalg.solve(normal.pose, normal.cross).reshape(flat)
    less = np.linalg.eigvalsh(alone - information(bundle, at, 0.001, 1.0))
    assert less.min() > -1e-6 * less.max()
    assert less.max() > 0.0


def test_errors_of_their_own_count_each_and_alike_ones_do_not() -> None:
    """Eight shots of a pose with one error of their own are worth one."""
    assert alike_shots(*_scene(120, 0.0), 0.0005) < 1.3
    sliding = alike_shots(*_scene(120, 0.003, 0.0001), 0.003)
    assert 5.0 < sliding < 12.0
    half = alike_shots(*_scene(120, 0.0005, 0.0005), 0.0007)
    assert 1.5 < half < 0.8 * sliding


def test_a_shape_that_was_kept_is_known_but_for_its_size() -> None:
    bundle, at = _scene(40, 0.0)
    known = information(bundle, at, 0.001, 2.0)
    covariance = left_open(known, keep_shape=True)
    np.testing.assert_allclose(covariance[:N_SHAPE, :N_SHAPE], KNOWN_SIZE_STD**2)
    # A hand taken for larger by 3 % puts each marker where the points still fit best.
    by_size: FloatArray = np.concatenate(
        [np.ones(N_SHAPE), -np.linalg.solve(known[N_SHAPE:, N_SHAPE:], known[N_SHAPE:, :N_SHAPE].sum(axis=1))]
    )
    given_size = covariance - KNOWN_SIZE_STD**2 * np.outer(by_size, by_size)
    np.testing.assert_allclose(given_size[N_SHAPE:, N_SHAPE:] @ known[N_SHAPE:, N_SHAPE:], np.eye(3 * M), atol=1e-6)
    assert covariance[:N_SHAPE, N_SHAPE:] == pytest.approx(KNOWN_SIZE_STD**2 * np.tile(by_size[N_SHAPE:], (N_SHAPE, 1)))
