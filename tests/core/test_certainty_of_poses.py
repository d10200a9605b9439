"""What the engine says of its own errors, against its true ones: a performance whose truth is known."""

from __future__ import annotations

from functools import cache
from itertools import islice

import numpy as np
import pytest

from core.engine import Engine
from core.frames import FloatArray, HandState
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile

FRAMES, SETTLED = 720, 60


@cache
def errors(hidden: float) -> dict[str, FloatArray]:
    """Stated standard deviations and true errors of two hands with 19 markers each, some of them hidden.

    angle_std, angle_error: (n, 20) [rad]; marker_std, marker_error: (n, 19) [m]; observed: (n, 19).
    """
    profile = load_profile("han19")
    performer, engine = Performer(profile, 7), Engine(profile)
    rows = []
    for frame in islice(MarkerStream(performer, 120.0, 7, hidden=hidden, ghosts=0.3).frames(), FRAMES):
        truth = performer.at(frame.times.device_s)
        for hand in engine.step(frame).hands:
            if hand.state is not HandState.TRACKED:
                assert np.isnan(hand.theta_std).all() and np.isnan(hand.marker_std_m).all()
            elif frame.sequence >= SETTLED:
                off_m = np.linalg.norm(hand.markers_world_m - truth.markers_world_m[hand.side], axis=1)
                off_rad = np.abs(hand.theta_rad - truth.theta_rad[hand.side])[6:]
                rows.append((hand.theta_std[6:], off_rad, hand.marker_std_m, off_m, hand.observed))
    assert len(rows) > FRAMES
    names = ("angle_std", "angle_error", "marker_std", "marker_error", "observed")
    return {name: np.array(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}


@pytest.mark.parametrize("hidden", [0.05, 0.3])
def test_true_errors_are_as_large_as_stated(hidden: float) -> None:
    """A normal error is within two standard deviations in 95 of 100 cases; and nothing is called unsure that is not."""
    found = errors(hidden)
    for kind in ("angle", "marker"):
        std, error = found[f"{kind}_std"], found[f"{kind}_error"]
        assert np.isfinite(std).all() and (std > 0.0).all()
        assert (error < 2.0 * std).mean() > 0.9, kind
    stated, true = (np.sqrt(np.square(found[name]).mean()) for name in ("angle_std", "angle_error"))
    assert 0.5 < true / stated < 2.0


def test_where_more_is_stated_more_is_wrong() -> None:
    found = errors(0.3)
    std, error = found["angle_std"].ravel(), found["angle_error"].ravel()
    order = np.argsort(std)
    quarters = [np.sqrt(np.square(error[part]).mean()) for part in np.array_split(order, 4)]
    assert quarters[3] > 2.0 * quarters[0] and quarters[3] == max(quarters)


def test_a_hidden_marker_is_less_sure_than_when_it_was_seen() -> None:
    found = errors(0.3)
    for k in range(19):
        seen = found["observed"][:, k]
        assert np.median(found["marker_std"][~seen, k]) > np.median(found["marker_std"][seen, k])
