"""The parts of the experiments on calibration, on what is known."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.reconstruction import fig17, han_shapes
from app.reconstruction.known_hands import NOISE_M, made
from core.frames import FloatArray
from core.kinematics.prior import posture_prior
from core.markers.layout import load_layout
from core.motion.subspace import shipped_subspace
from core.profile import Profile
from tests.data import data_path


@pytest.fixture(scope="module")
def seen() -> FloatArray:
    """(n, 19, 3) of a performer whose labels are all right."""
    return np.stack([frame.points_m for frame in made(1, swapped=0.0, count=200, seconds=15.0).frames])


def test_performers_are_as_large_as_asked_and_have_proportions_of_their_own() -> None:
    drawn, child = made(1, count=2).truth.shape.ratios, made(1, count=2, size=0.75).truth.shape.ratios
    assert child.mean() == pytest.approx(0.75)
    np.testing.assert_allclose(child / drawn, child[0] / drawn[0])


def test_affine_is_the_fit_of_the_paper(seen: FloatArray) -> None:
    """Against eq. 8 written out, frame by frame; and exact where a marker is an affine combination."""
    first, rest = seen[:150], seen[150:]
    k, others = 4, [i for i in range(19) if i != 4]
    x = np.concatenate([np.vstack([frame[others].T, np.ones(18)]) for frame in first])  # rows: coordinates
    y = np.concatenate([np.append(frame[k], 1.0) for frame in first])
    weights = np.linalg.solve(x.T @ x + fig17.LAMBDA * np.eye(18), x.T @ y)
    expected = np.linalg.norm(np.einsum("o,fod->fd", weights, rest[:, others]) - rest[:, k], axis=1)
    np.testing.assert_allclose(fig17.affine_errors_m(first, rest)[:, k], expected, rtol=1e-3, atol=1e-6)
    rigid = seen.copy()
    rigid[:, 0] = rigid[:, 1] + 0.5 * (rigid[:, 2] - rigid[:, 3])
    assert np.nanmax(fig17.affine_errors_m(rigid[:150], rigid[150:])[:, 0]) < 1e-5


def test_affine_does_without_markers_that_are_missing(seen: FloatArray) -> None:
    rest = seen[150:].copy()
    rest[:10, 7] = np.nan
    errors = fig17.affine_errors_m(seen[:150], rest)
    assert np.isnan(errors[:10, 7]).all()
    assert np.isfinite(np.delete(errors, 7, axis=1)).all()


def test_last_known_on_a_rigid_hand_is_exact() -> None:
    random = np.random.default_rng(0)
    rest = random.normal(0.0, 0.05, (6, 3))
    turns = Rotation.from_rotvec(random.normal(0.0, 1.0, (20, 3)))
    moved = np.stack([turn.apply(rest) + random.normal(0.0, 0.3, 3) for turn in turns])
    errors = fig17.last_known_errors_m(moved[:1], moved[1:], [0, 1, 2])
    assert errors[:, 3:].max() < 1e-12
    room = fig17.last_known_errors_m(moved[:1], moved[1:], ())
    np.testing.assert_allclose(room, np.linalg.norm(moved[1:] - moved[0], axis=2))


def test_a_hidden_marker_of_a_known_hand_is_found(seen: FloatArray) -> None:
    """With the true hand, a hidden marker is missed by little, and the nearer the better its posture is known."""
    scene = made(1, swapped=0.0, count=200, seconds=15.0)
    profile: Profile = scene.truth
    model = fig17.solved_m(profile, None, np.zeros(26), 1.0, seen)
    assert np.sqrt(((model[5:] - seen[5:]) ** 2).sum(2).mean()) < 2.0 * NOISE_M
    errors = fig17.hidden_errors_m(profile, posture_prior(shipped_subspace("generic")), np.zeros(26), 1.0, seen[:60])
    back = [name.startswith("Back") for name in profile.layout.marker_names]
    assert np.median(errors[5:, back]) < 0.0015
    assert np.median(errors[5:]) < 0.006


def test_own_prior_is_the_gaussian_of_the_postures() -> None:
    random = np.random.default_rng(0)
    postures = random.normal(0.3, 0.2, (5000, 20))
    prior = fig17.own_prior(postures)
    np.testing.assert_allclose(prior.mean_rad, 0.3, atol=0.02)
    expected = fig17.NOISE_M**2 / (fig17.WIDENED**2 * 0.04 + fig17.LEAST_STD_RAD**2)
    np.testing.assert_allclose(np.diag(prior.precision_m2), expected, rtol=0.1)


def test_what_jitter_leaves_after_a_pose_was_fitted() -> None:
    assert han_shapes.residual_floor_mm(19) == pytest.approx(3.2 * np.sqrt(31.0 / 57.0))


def test_frames_to_calibrate_from_and_to_try_are_of_different_sequences() -> None:
    path = data_path("han2018", "han_user4.npz")
    used, others = han_shapes.sequences(path, 300)
    assert len(used) == len(others) == 300
    ours, theirs = ({frame.points_m.tobytes() for frame in part} for part in (used, others))
    assert len(ours) == 300
    assert ours.isdisjoint(theirs)
    times = np.array([frame.times.host_s for frame in used])
    steps = np.diff(times)
    assert set(np.round(steps, 6)) <= {round(1.0 / han_shapes.RATE_HZ, 6), han_shapes.PAUSE_S}
    far = [np.linalg.norm(b.points_m - a.points_m, axis=1).mean() for a, b in pairwise(used)]
    assert np.median(np.asarray(far)[steps < 0.1]) < np.median(np.asarray(far)[steps > 0.1])


def test_the_stated_palm_widths_are_distances_of_two_markers() -> None:
    names = load_layout("han19").marker_names
    for user, stated in zip(han_shapes.USERS, han_shapes.PALM_WIDTHS_MM, strict=True):
        with np.load(data_path("han2018", f"han_user{user}.npz"), allow_pickle=False) as data:
            points = data["points"][data["hand"] == 1].astype(np.float64)
        assert han_shapes.palm_width_mm(points, names) == pytest.approx(stated, abs=1.0)
