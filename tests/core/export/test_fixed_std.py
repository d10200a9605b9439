"""`<parameter>_std_fixed` of angles.csv."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.calibration.carried import Carrier, fixed_std
from core.calibration.fixed import FixedCovariance
from core.calibration.neutral import Neutral, NeutralHand
from core.calibration.priors import fixed_covariance
from core.calibration.record import Calibrated
from core.frames import FloatArray
from core.hand.mirror import mirror_theta
from core.hand.skeleton import DOF_NAMES
from core.takes.export import export
from core.takes.export.options import ExportOptions
from core.takes.solution import Solution
from tests.core.export.recordings import hands_of, solution

FIXED_NAMES = [f"{name}_std_fixed" for name in DOF_NAMES]


def _calibrated(share: float) -> Solution:
    """A recording with a profile that is known so much better than a layout alone is."""
    recording = solution(n_frames=40, scale=1.0)
    covariance = FixedCovariance.of(share**2 * fixed_covariance(recording.cast[0]))
    record = Calibrated(covariance, 0.0006, 120, 12.0, 0.001, 0.001)
    return replace(recording, profiles=replace(recording.cast[0], scale=1.0, calibrated=record))


def _cells(folder: Path, side: str) -> FloatArray:
    """(f, 26) of the frames in which the hand is tracked."""
    with (folder / "angles.csv").open(newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if row["hand"] == side and row["state"] == "tracked"]
    return np.asarray([[float(row[name]) for name in FIXED_NAMES] for row in rows])


@pytest.mark.parametrize("side", ["left", "right"])
def test_it_is_what_the_calibration_left_open_carried_into_each_frame(tmp_path: Path, side: str) -> None:
    recording = _calibrated(0.2)
    export(recording, ["csv"], tmp_path)
    hands = [hand for hand in hands_of(recording, side) if hand.state.value == "tracked"]
    carrier = Carrier(recording.cast[0])
    expected = []
    for hand in hands:  # every marker is shown now and then, and so counts in every frame
        theta = mirror_theta(hand.theta_rad) if side == "left" else hand.theta_rad
        carried = carrier.carried(theta[None], np.asarray([hand.scale]), np.ones((1, 19)))
        expected.append(fixed_std(carried, carrier.covariance)[0])
    assert np.abs(_cells(tmp_path, side) - expected).max() < 0.6e-7


def test_better_known_hands_have_smaller_deviations_in_the_same_proportion(tmp_path: Path) -> None:
    for share in (0.1, 0.3):
        export(_calibrated(share), ["csv"], tmp_path / str(share))
    little, much = (_cells(tmp_path / str(share), "right") for share in (0.1, 0.3))
    np.testing.assert_allclose(3.0 * little, much, rtol=0.01, atol=1e-6)


def test_a_layout_alone_says_how_little_it_knows(tmp_path: Path) -> None:
    """Ten to twenty degrees of a joint angle, and less where the size is found from the motion than a hand of unknown
    size would have."""
    recording = solution(n_frames=40)
    assert recording.cast[0].scale is None
    export(recording, ["csv"], tmp_path)
    alone = np.degrees(_cells(tmp_path, "right")[:, 6:])
    assert 8.0 < np.sqrt(np.square(alone).mean()) < 30.0
    carrier = Carrier(recording.cast[0])
    hands = [hand for hand in hands_of(recording, "right") if hand.state.value == "tracked"]
    thetas, scales = np.stack([hand.theta_rad for hand in hands]), np.asarray([hand.scale for hand in hands])
    carried = carrier.carried(thetas, scales, np.ones((len(hands), 19)))
    unsized = np.degrees(fixed_std(carried, carrier.covariance)[:, 6:])
    assert np.sqrt(np.square(alone).mean()) < 0.95 * np.sqrt(np.square(unsized).mean())


def test_turned_to_z_up_only_the_wrists_axes_change_places(tmp_path: Path) -> None:
    recording = _calibrated(0.2)
    export(recording, ["csv"], tmp_path / "y")
    export(recording, ["csv"], tmp_path / "z", options=ExportOptions(up="z"))
    for side in ("left", "right"):
        upright, turned = _cells(tmp_path / "y", side), _cells(tmp_path / "z", side)
        order = [0, 2, 1, 3, 5, 4, *range(6, 26)]
        assert np.abs(turned - upright[:, order]).max() < 1.2e-7


def test_with_a_neutral_trial_it_is_of_what_is_reported_and_without_it_as_before(tmp_path: Path) -> None:
    plain = _calibrated(0.2)
    held = next(hand for hand in hands_of(plain, "right") if hand.state.value == "tracked")
    trial = NeutralHand(held.theta_rad[6:].astype(float), np.zeros(20), np.zeros(20), (), "flat.c3d", 0.0, 1.0, "")
    zeroed = replace(plain, profiles=replace(plain.cast[0], neutral=Neutral({"right": trial})))
    export(plain, ["csv"], tmp_path / "plain")
    export(zeroed, ["csv"], tmp_path / "zeroed")
    export(zeroed, ["csv"], tmp_path / "no", options=ExportOptions(neutral=False))
    assert (tmp_path / "no" / "angles.csv").read_bytes() == (tmp_path / "plain" / "angles.csv").read_bytes()
    before, after = (_cells(tmp_path / name, "right") for name in ("plain", "zeroed"))
    assert before[0, 6:].min() > 1e-2
    assert (after[0, 6:] < 0.06 * before[0, 6:]).all(), "but for the made hand's size, which is not the profile's"
    assert after[20:, 6:].max() > 1e-2
    np.testing.assert_array_equal(after[:, :6], before[:, :6])
    np.testing.assert_array_equal(_cells(tmp_path / "zeroed", "left"), _cells(tmp_path / "plain", "left"))
