"""The constant error of reported angles: with a neutral trial what is left of it away from the stance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.calibration.carried import Carrier
from core.calibration.fixed_error import FixedError, trial_stance
from core.calibration.neutral import NeutralHand
from core.frames import FloatArray, Side
from core.hand.mirror import mirror_theta
from core.hand.poses import pose
from core.hand.skeleton import DIGIT_DOF_NAMES
from core.kinematics.prior import posture_prior
from core.profile import load_profile
from tests.some import some

PROFILE = replace(load_profile("han19"), scale=1.1)
M = len(PROFILE.layout.joints)
SHOWN = np.ones(M, dtype=np.bool_)
STANCE = pose("flat") + 0.1


def _trial(hidden: tuple[str, ...] = (), prior: tuple[str, ...] = ()) -> NeutralHand:
    """Held at `flat`, and tracked at STANCE."""
    told = np.array([name not in hidden + prior for name in DIGIT_DOF_NAMES])
    zero = np.where(told, STANCE - pose("flat"), 0.0)
    return NeutralHand(zero, np.full(20, 0.01), pose("flat"), hidden, "flat.c3d", 2.0, 4.0, "2026-03-01", prior)


def _poses(n: int = 4) -> FloatArray:
    random = np.random.default_rng(3)
    digits = pose("relaxed") + random.uniform(0.0, 0.3, (n, 20))
    return np.concatenate([random.normal(0.0, 0.5, (n, 6)), digits], axis=1)


def _std(thetas: FloatArray, neutral: NeutralHand | None, side: Side = "right") -> FloatArray:
    scales = np.full(len(thetas), 1.1)
    return FixedError(PROFILE, side, thetas, scales, SHOWN, neutral).std(thetas, scales)


@pytest.mark.parametrize("side", ["left", "right"])
def test_in_the_stance_itself_nothing_is_left_of_it(side: Side) -> None:
    thetas = _poses()
    thetas[:, 6:] = STANCE  # however the wrist is turned
    plain, counted = _std(thetas, None, side), _std(thetas, _trial(), side)
    assert plain[:, 6:].min() > 0.01
    assert counted[:, 6:].max() < 1e-7
    np.testing.assert_array_equal(counted[:, :6], plain[:, :6])


@pytest.mark.parametrize("side", ["left", "right"])
def test_elsewhere_it_is_that_of_the_difference(side: Side) -> None:
    thetas, carrier = _poses(), Carrier(PROFILE)
    counted, ones = _std(thetas, _trial(), side), np.ones((1, M))
    held = np.concatenate([np.zeros(6), STANCE])
    held_carried = carrier.carried(held[None], np.array([1.1]), ones)[0]
    for theta, std in some(zip(thetas, counted, strict=True)):
        right = mirror_theta(theta) if side == "left" else theta
        difference = carrier.carried(right[None], np.array([1.1]), ones)[0]
        difference[6:] -= held_carried[6:]
        np.testing.assert_allclose(std**2, np.diag(difference @ carrier.covariance @ difference.T), rtol=1e-9)


def test_it_grows_from_the_stance_on() -> None:
    way = np.linspace(0.0, 1.0, 6)[:, None]
    thetas = np.concatenate([np.zeros((6, 6)), STANCE + way * (pose("relaxed") - STANCE)], axis=1)
    sizes = np.sqrt(np.square(_std(thetas, _trial())[:, 6:]).mean(axis=1))
    assert (np.diff(sizes) > 0.0).all()


@pytest.mark.parametrize("field", ["hidden", "prior"])
def test_an_angle_without_a_zero_of_the_trial_keeps_all_of_it(field: str) -> None:
    names = ("ring_dip_flexion", "pinky_dip_flexion")
    at = [6 + DIGIT_DOF_NAMES.index(name) for name in names]
    others = np.setdiff1d(np.arange(6, 26), at)
    thetas = _poses()
    plain, counted = _std(thetas, None), _std(thetas, _trial(**{field: names}))
    np.testing.assert_array_equal(counted[:, at], plain[:, at])
    assert (counted[:, others] != plain[:, others]).all()


def test_what_the_trial_did_not_tell_stands_where_the_prior_has_it() -> None:
    names = tuple(name for name in DIGIT_DOF_NAMES if name.endswith("dip_flexion"))
    stance, prior = trial_stance(_trial(prior=names), PROFILE), posture_prior(PROFILE.subspace)
    told = np.array([name not in names for name in DIGIT_DOF_NAMES])
    np.testing.assert_allclose(stance[told], STANCE[told], atol=1e-15)
    low, high = PROFILE.hand.skeleton.limits_rad.T
    inside = ~told & (stance > low) & (stance < high)
    assert inside.any()
    slope = prior.precision_m2 @ (stance - prior.mean_rad)
    np.testing.assert_allclose(slope[inside], 0.0, atol=1e-12)
    np.testing.assert_array_equal(trial_stance(_trial(), PROFILE), _trial().zero_rad + pose("flat"))


def test_a_marker_counts_where_its_frame_or_the_recording_shows_it() -> None:
    thetas, scales, shown = _poses(), np.full(4, 1.1), SHOWN.copy()
    shown[np.isin(PROFILE.layout.joints, (10, 11, 12))] = False
    unseen = FixedError(PROFILE, "right", thetas, scales, shown)
    assert (unseen.std(thetas, scales)[:, 18:22] != _std(thetas, None)[:, 18:22]).all()
    np.testing.assert_allclose(unseen.std(thetas, scales, np.tile(SHOWN, (4, 1))), _std(thetas, None), rtol=1e-9)
