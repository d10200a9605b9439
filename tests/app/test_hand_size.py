"""Hand size of the profile in use: chosen, recognised again, told in millimetres, remembered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app import settings as names
from app.application import remembered_profile
from app.hand_size import CALIBRATED, FROM_MOTION, SIZE_NAMES, hand_size, hand_words, size_words, sized
from app.notifications import NotificationCentre
from app.settings import Settings
from core.hand.shape import HandShape
from core.hand.sizes import SIZES
from core.profile import Profile, load_profile


@pytest.mark.parametrize("name", SIZE_NAMES)
def test_a_size_given_is_the_size_in_use_also_after_a_file(name: str) -> None:
    before = replace(load_profile("qualisys13"), performer="Ada", scale=0.93)
    after = sized(before, name)
    assert hand_size(after) == hand_size(Profile.from_json(after.to_json())) == name
    assert after.scale == (None if name == FROM_MOTION else 1.0)
    assert replace(after, shape=before.shape, scale=before.scale) == before
    if name in SIZES:
        np.testing.assert_array_equal(after.shape.ratios, SIZES[name].ratios)


def test_any_other_hand_is_calibrated() -> None:
    generic = load_profile("han19")
    assert hand_size(generic) == FROM_MOTION
    assert hand_size(replace(generic, scale=0.93)) == CALIBRATED
    assert hand_size(replace(generic, shape=HandShape.uniform(1.05))) == CALIBRATED
    assert hand_size(replace(generic, shape=SIZES["L"], scale=1.02)) == CALIBRATED
    assert hand_size(replace(generic, shape=HandShape(SIZES["L"].ratios * 1.001), scale=1.0)) == CALIBRATED


def test_sizes_are_told_in_millimetres() -> None:
    assert "182 mm long, 203 mm around the knuckles: glove size 8" in size_words("M")
    assert hand_words(sized(load_profile("han19"), "M")) == "182 mm long, 86 mm broad and 203 mm around the knuckles"
    assert hand_words(replace(load_profile("han19"), scale=2.0)).startswith("371 mm long")


@pytest.mark.parametrize(("kept", "expected"), [("L", "L"), (CALIBRATED, FROM_MOTION), ("huge", FROM_MOTION)])
def test_the_next_start_has_the_same_hand(kept: str, expected: str) -> None:
    settings = Settings(None)
    settings.set(names.PROFILE, "qualisys13")
    settings.set(names.HAND_SIZE, kept)
    profile = remembered_profile(settings, False, NotificationCentre())
    assert (profile.layout.name, hand_size(profile)) == ("qualisys13", expected)
    assert hand_size(remembered_profile(settings, True, NotificationCentre())) == FROM_MOTION  # the performer's own
