from __future__ import annotations

from dataclasses import replace

import numpy as np

from core.hand.model import template
from core.kinematics.solver import HandPose
from core.motion.performer import Performer
from core.profile import load_profile
from resources.layouts.marker_fit import fit_markers


def test_displaced_markers_are_found_from_motion() -> None:
    """Markers said to be 6 mm from where they are: 20 s of performance bring the residual down to the noise."""
    random = np.random.default_rng(0)
    skeleton = template().skeleton
    profile = load_profile("han19").with_sides(("right",))
    performer = Performer(profile, seed=2)
    shots = [performer.at(t) for t in np.linspace(0.0, 20.0, 200)]
    said = profile.layout.positions_m + random.normal(0.0, 0.006 / np.sqrt(3.0), profile.layout.positions_m.shape)
    points = np.stack([shot.markers_world_m["right"] for shot in shots])
    start = HandPose.at_rest(19)
    start.theta_rad[:] = performer.theta("right", 0.0)
    fit = fit_markers(
        skeleton,
        replace(profile.layout, positions_m=said),
        points,
        start=start,
        rounds=15,
        prior_frames=1,
        fit_scale=False,
    )
    assert fit.rms_before_m > 0.003
    assert fit.rms_after_m < 0.25 * fit.rms_before_m
    before = np.linalg.norm(said - profile.layout.positions_m, axis=1).mean()
    after = np.linalg.norm(fit.layout.positions_m - profile.layout.positions_m, axis=1).mean()
    assert after < 0.8 * before  # a common shift of bones and markers cannot be told from the pose
    assert fit.rms_m.shape == (19,)
