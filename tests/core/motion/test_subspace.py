"""Principal components of postures: against numpy's eigenvectors, in and out of files, and those that are shipped."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from core.errors import FormatError, PhalanxError
from core.motion.subspace import (
    THINNED_RAD,
    Subspace,
    load_subspace,
    save_subspace,
    shipped_subspace,
    subspace_names,
    subspace_of,
    thinned,
)


@pytest.fixture(scope="module")
def postures() -> np.ndarray:
    random = np.random.default_rng(3)
    mixed = random.normal(0.0, 1.0, (20, 20)) * np.geomspace(1.0, 0.01, 20)
    return 0.2 * random.normal(0.0, 1.0, (5000, 20)) @ mixed.T + random.normal(0.3, 0.1, 20)


def test_components_are_the_eigenvectors_of_the_covariance(postures: np.ndarray) -> None:
    subspace = subspace_of(postures, "s", dimensions=20)
    values, vectors = np.linalg.eigh(np.cov(postures.T))
    np.testing.assert_allclose(subspace.std_rad**2, values[::-1], rtol=1e-9)
    for component, vector in zip(subspace.basis.T, vectors.T[::-1], strict=True):
        assert abs(component @ vector) == pytest.approx(1.0, abs=1e-8)
        assert component[np.abs(component).argmax()] > 0.0  # a sign that does not depend on the library
    np.testing.assert_allclose(subspace.mean_rad, postures.mean(axis=0))
    np.testing.assert_allclose(subspace.covariance(), np.cov(postures.T), atol=1e-12)
    np.testing.assert_allclose(subspace.basis.T @ subspace.basis, np.eye(20), atol=1e-12)
    assert (np.diff(subspace.std_rad) <= 0.0).all()


@pytest.mark.parametrize("share", [0.5, 0.8, 0.9, 0.95, 0.999, 1.0])
def test_as_many_dimensions_as_explain_the_share(postures: np.ndarray, share: float) -> None:
    subspace = subspace_of(postures, "s", variance=share)
    values = np.sort(np.linalg.eigvalsh(np.cov(postures.T)))[::-1]
    shares = np.cumsum(values) / values.sum()
    np.testing.assert_allclose(subspace.explained, shares[: subspace.dimensions], rtol=1e-9)
    assert shares[subspace.dimensions - 1] >= share - 1e-9
    assert subspace.dimensions == 1 or shares[subspace.dimensions - 2] < share


@pytest.mark.parametrize("dimensions", [0, 1, 5, 19, 20])
def test_what_is_left_out_stays_in_every_angle_s_variance(postures: np.ndarray, dimensions: int) -> None:
    whole = subspace_of(postures, "s", dimensions=20)
    part = whole.truncated(dimensions)
    assert part.dimensions == dimensions
    np.testing.assert_allclose(np.diag(part.covariance()), np.diag(np.cov(postures.T)), rtol=1e-9)
    np.testing.assert_allclose(part.covariance(), subspace_of(postures, "s", dimensions=dimensions).covariance())


def test_the_nearest_posture_within(postures: np.ndarray) -> None:
    subspace = subspace_of(postures, "s", dimensions=4)
    near = subspace.nearest(postures)
    np.testing.assert_allclose(subspace.nearest(near), near, atol=1e-12)
    np.testing.assert_allclose((postures - near) @ subspace.basis, 0.0, atol=1e-12)
    left = ((postures - near) ** 2).sum() / ((postures - subspace.mean_rad) ** 2).sum()
    assert left == pytest.approx(1.0 - subspace.explained[-1], rel=1e-9)


def test_two_postures_are_needed() -> None:
    with pytest.raises(PhalanxError, match="of 1 postures"):
        subspace_of(np.zeros((1, 20)), "s")


def test_a_hold_weighs_no_more_than_a_posture_passed_through() -> None:
    random = np.random.default_rng(0)
    way = np.linspace(0.0, 1.0, 200)[:, None] * random.normal(0.0, 0.5, 20)
    held = np.repeat(way[100:101], 5000, axis=0) + random.normal(0.0, 0.005, (5000, 20))
    kept = thinned(np.vstack([way[:100], held, way[100:]]))
    assert kept[0] == 0
    assert (np.diff(kept) > 0).all()
    assert np.count_nonzero((kept >= 100) & (kept < 5100)) <= 1
    chosen = way[thinned(way)]
    assert (np.linalg.norm(np.diff(chosen, axis=0), axis=1) >= THINNED_RAD).all()
    assert len(thinned(np.empty((0, 20)))) == 0


def test_files_hold_what_was_written(postures: np.ndarray, tmp_path: Path) -> None:
    subspace = subspace_of(postures, "Ada", "Learnt from häppy.mcap.", variance=0.9)
    save_subspace(subspace, tmp_path / "ada.json")
    back = load_subspace(tmp_path / "ada.json")
    assert (back.name, back.description, back.dimensions) == ("Ada", "Learnt from häppy.mcap.", subspace.dimensions)
    for what in ("mean_rad", "basis", "std_rad", "residual_std_rad"):
        np.testing.assert_allclose(getattr(back, what), getattr(subspace, what), atol=6e-8)
    assert back.to_dict() == Subspace.from_dict(back.to_dict()).to_dict()
    with pytest.raises(FormatError, match="cannot be written"):
        save_subspace(subspace, tmp_path / "no" / "ada.json")


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"format": "phalanx-profile"}, "is not a subspace"),
        ({"version": 9}, "of version 9"),
        ({"mean_rad": [0.0] * 19}, "cannot be read"),
        ({"mean_rad": [0.0] * 19 + ["much"]}, "cannot be read"),
        ({"mean_rad": [0.0] * 19 + [float("nan")]}, "not sound: NaN stands where"),
        ({"std_rad": [-1.0, 1.0]}, "a deviation of -1 rad"),
        ({"mean_rad": [0.0] * 19 + [1e300]}, r"holds 1e\+300 rad"),
        ({"basis": [[1.0] * 20, [0.0] * 20]}, "is not orthonormal"),
        ({"residual_std_rad": None}, "cannot be read"),
    ],
)
def test_what_is_wrong_with_a_file_is_told(
    postures: np.ndarray, tmp_path: Path, change: dict[str, object], told: str
) -> None:
    path = tmp_path / "bad.json"
    data = subspace_of(postures, "s", dimensions=2).to_dict() | change
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(FormatError, match=told) as raised:
        load_subspace(path)
    assert "bad.json" in str(raised.value)


def test_a_file_that_is_not_there_or_no_json(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"No such file.*generic"):
        load_subspace(tmp_path / "nothing.json")
    (tmp_path / "text.json").write_text("a subspace", encoding="utf-8")
    with pytest.raises(FormatError, match="is not JSON"):
        load_subspace(tmp_path / "text.json")


def test_those_that_are_shipped() -> None:
    assert subspace_names() == ("generic", "gestures", "grasping")
    for name in subspace_names():
        subspace = shipped_subspace(name)
        assert load_subspace(name) is subspace
        assert subspace.name == name
        assert subspace.explained[-1] >= 0.95
        # Schröder 2014, 2017: 3 to 6 dimensions hold 90 %.
        assert 3 <= np.searchsorted(subspace.explained, 0.9) + 1 <= 6
    with pytest.raises(KeyError):
        shipped_subspace("fencing")
