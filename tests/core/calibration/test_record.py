"""What a profile keeps of its calibration."""

from __future__ import annotations

import base64
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from core.calibration.findings import never_seen_words
from core.calibration.fixed import FixedCovariance
from core.calibration.priors import fixed_covariance
from core.calibration.record import MOST_CHARACTERS, Calibrated
from core.errors import FormatError
from core.hand.shape import N_SHAPE
from core.markers.layout import MAX_MARKERS
from core.profile import Profile, load_profile

PLAIN = load_profile("han19")
NAMES = PLAIN.layout.marker_names
N = N_SHAPE + 3 * len(NAMES)


def _covariance() -> np.ndarray:
    """Long bones with places that make up for them: nearly singular, as what a calibration leaves open."""
    random = np.random.default_rng(0)
    root = random.normal(0.0, 1.0, (N, 8)) @ random.normal(0.0, 1.0, (8, N)) + 0.05 * np.eye(N)
    size = np.concatenate([np.full(N_SHAPE, 0.02), np.full(N - N_SHAPE, 0.0008)])
    covariance: np.ndarray = np.outer(size, size) * (root @ root.T) / 60.0
    return covariance


def _calibrated() -> Calibrated:
    return Calibrated(
        FixedCovariance.of(_covariance()), 0.0006, 120, 11.5, 0.0011, None, ("Ring: girth not seen.",),
        ("warm-up.trc",), 3.0, 13.0, "2026-05-31",
    )  # fmt: skip


PROFILE = replace(PLAIN, calibrated=_calibrated(), scale=1.0)


def test_a_covariance_is_kept_to_within_its_rounding() -> None:
    """In every direction, also those that are known a hundred times better than others."""
    covariance = _covariance()
    kept = FixedCovariance.of(covariance).matrix
    assert np.array_equal(kept, kept.T)
    np.testing.assert_allclose(np.diag(kept), np.diag(covariance), rtol=2e-3)
    scale = np.sqrt(np.diag(covariance))
    values, directions = np.linalg.eigh(covariance / np.outer(scale, scale))
    found = np.einsum("in,ij,jn->n", directions, kept / np.outer(scale, scale), directions)
    known = values > 1e-3
    np.testing.assert_allclose(found[known], values[known], rtol=0.03)
    assert (np.linalg.eigvalsh(kept / np.outer(scale, scale)) > 0.0).all()


def test_a_profile_reads_back_what_it_was_calibrated_from() -> None:
    text = PROFILE.to_json()
    again = Profile.from_json(text)
    assert again.to_json() == text
    assert json.loads(text)["version"] == 4
    was, read = PROFILE.calibrated, again.calibrated
    assert was is not None and read is not None
    assert np.array_equal(was.covariance.matrix, read.covariance.matrix)
    assert replace(read, covariance=was.covariance) == was
    assert np.array_equal(fixed_covariance(again), was.covariance.matrix)
    assert len(text) < 30_000


def test_a_profile_reads_back_how_many_markers_were_never_seen() -> None:
    said = never_seen_words([f"left_hand_metacarpal_marker_{k}" for k in range(MAX_MARKERS)])
    again = Profile.from_json(replace(PROFILE, calibrated=replace(_calibrated(), not_seen=tuple(said))).to_json())
    assert again.calibrated is not None and list(again.calibrated.not_seen) == said


def test_without_a_calibration_a_profile_is_written_as_before() -> None:
    assert PLAIN.to_dict()["version"] == 2
    assert "calibrated" not in PLAIN.to_dict()
    assert replace(PROFILE, calibrated=None).to_json() == replace(PLAIN, scale=1.0).to_json()


def _text(triangle: np.ndarray) -> str:
    return base64.b64encode(triangle.astype("<f2").tobytes()).decode()


def _identity(entry: float, value: float) -> str:
    """The triangle of the identity with one entry another."""
    factor = np.eye(N)
    factor[40, 40 if entry else 3] = value
    return _text(factor[np.tril_indices(N)])


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"correlation": "AAAA"}, "4 characters of correlations do not fit 80 deviations"),
        ({"correlation": 3}, "0 characters of correlations"),
        ({"correlation": "!" * 8640}, "correlations cannot be read"),
        ({"correlation": _identity(1, -1.0)}, "those of nothing"),
        ({"correlation": _identity(1, np.nan)}, "those of nothing"),
        ({"correlation": _identity(0, 30.0)}, "those of nothing"),
        ({"measures_std": {"palm_width": 0.1}}, "must name every measure"),
        ({"markers_std_m": {"ThumbTip": [0.1, 0.1, 0.1]}}, "must name every marker"),
        ({"markers_std_m": {name: [0.001, 0.001] for name in NAMES}}, "deviation of ThumbCMC"),
        ({"markers_std_m": {name: [0.001, 0.001, 0.2] for name in NAMES}}, r"deviation 0\.2"),
        ({"markers_std_m": {name: [0.001, 0.001, True] for name in NAMES}}, "deviation True"),
        ({"markers_std_m": {name: [0.001, 0.001, float("nan")] for name in NAMES}}, "deviation nan"),
        ({"noise_m": None}, "noise_m None"),
        ({"noise_m": -1}, "noise_m -1"),
        ({"keyframes": True}, "keyframes True"),
        ({"independent_keyframes": "many"}, "independent_keyframes 'many'"),
        ({"rms_m": 3}, "rms_m 3"),
        ({"rms_m": {"keyframes": 4.0}}, r"keyframes 4\.0"),
        ({"date": "yesterday"}, "date 'yesterday'"),
        ({"date": 5}, "date 5"),
        ({"from_s": -1.0}, r"from_s -1\.0"),
        ({"not_seen": ["x" * (MOST_CHARACTERS + 1)]}, "not_seen must list"),
        ({"sources": ["a"] * 100}, "sources must list"),
        ({"sources": "a"}, "sources must list"),
    ],
)
def test_what_is_wrong_is_told(change: dict[str, Any], told: str) -> None:
    data = PROFILE.to_dict()
    data["calibrated"] |= change
    with pytest.raises(FormatError, match=told) as raised:
        Profile.from_dict(data, "ada.json")
    assert "ada.json: its calibration" in str(raised.value)


def test_a_calibration_is_an_object() -> None:
    with pytest.raises(FormatError, match="its calibration is 3"):
        Profile.from_dict(PROFILE.to_dict() | {"calibrated": 3})
