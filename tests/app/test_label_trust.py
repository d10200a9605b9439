"""How sure labels are: the measures, and what plots make of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.label_trust import percent, trust, trust_level, worst_label
from app.live_numbers import Trail
from app.panels.plots import least_of
from core.frames import HandKey, HandState
from devices.device import Level
from tests.app.hand_frames import hand_frame, profile, sample

NAMES = profile().layout.marker_names
SURE = np.linspace(0.2, 1.0, 19)


def test_mean_and_least_are_of_what_is_known():
    assert trust(replace(hand_frame("left"), label_confidence=SURE)) == pytest.approx((0.6, 0.2))
    some = np.where(np.arange(19) < 4, np.nan, SURE)
    assert trust(replace(hand_frame("left"), label_confidence=some)) == pytest.approx((some[4:].mean(), some[4]))
    assert worst_label(some, NAMES) == f"{NAMES[4]} {100 * some[4]:.0f} %"
    assert np.isnan(trust(hand_frame("left"))).all() and worst_label(np.full(19, np.nan), NAMES) == ""


@pytest.mark.parametrize(
    ("share", "level", "words"),
    [
        (1.0, Level.GOOD, ">99 %"), (0.9, Level.GOOD, "90 %"), (0.899, Level.WARNING, "90 %"),
        (0.5, Level.WARNING, "50 %"), (0.49, Level.PROBLEM, "49 %"),
    ],
)  # fmt: skip
def test_limits(share, level, words):
    assert trust_level(share) is level
    assert percent(share) == words


def test_what_is_not_known_is_no_problem():
    assert trust_level(float("nan")) is Level.IDLE


def test_the_trail_keeps_them_for_each_hand():
    trail = Trail([HandKey(0, "left"), HandKey(0, "right")])
    right = replace(hand_frame("right"), label_confidence=SURE)
    left = hand_frame("left", state=HandState.LOST)
    for hands in ((left, right), (left, hand_frame("right")), (right,)):
        trail.add(sample(*hands)[1])
    kept = trail.view(60.0).trust
    assert kept.shape == (3, 2, 2) and np.isnan(kept[:, 0]).all() and np.isnan(kept[1, 1]).all()
    assert kept[[0, 2], 1] == pytest.approx(np.array([[0.6, 0.2], [0.6, 0.2]]))


@pytest.mark.parametrize("n", [1, 7, 24])
def test_a_doubt_of_one_frame_is_drawn_however_many_share_a_pixel(n):
    values = np.full(n, 0.99)
    values[n // 2], values[0] = 0.3, np.nan
    for step in (1, 3, 5):
        least = least_of(values, step)
        assert len(least) == len(values[::step])
        expected = [values[i : i + step] for i in range(0, n, step)]
        for drawn, group in zip(least, expected, strict=True):
            assert np.isnan(drawn) if np.isnan(group).all() else drawn == np.nanmin(group)
