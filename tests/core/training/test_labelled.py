from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from core.errors import FormatError
from core.markers.layout import load_layout
from core.training.clouds import LEFT, NONE, RIGHT
from core.training.labelled import LabelledFrames, labelled_supply, read_labelled

LAYOUT = load_layout("alexanderson13")
M = len(LAYOUT.joints)


def frames(n: int = 40) -> np.ndarray:
    return LAYOUT.positions_m + np.random.default_rng(0).normal(0.0, 0.002, (n, M, 3))


def written(path: Path, **changed: object) -> Path:
    content = {"points": frames(), "hand": np.ones(40, dtype=np.uint8), "marker_names": np.array(LAYOUT.marker_names)}
    np.savez(path, **{**content, **changed})
    return path


def test_markers_are_put_in_the_order_of_the_layout(tmp_path: Path) -> None:
    order = np.random.default_rng(1).permutation(M)
    names = np.array(LAYOUT.marker_names)[order]
    path = written(tmp_path / "own.npz", points=frames()[:, order], marker_names=names)
    np.testing.assert_array_equal(read_labelled(path, LAYOUT).points_m, frames())


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"marker_names": np.array([f"A{i}" for i in range(M)])}, "ThumbMCP"),
        ({"points": np.zeros((40, 3))}, r"\(40, 3\)"),
        ({"hand": np.zeros(3, dtype=np.uint8)}, r"\(3,\)"),
    ],
)
def test_a_bad_recording_is_named_with_what_is_wrong(tmp_path: Path, changed: dict[str, object], said: str) -> None:
    with pytest.raises(FormatError, match=said) as error:
        read_labelled(written(tmp_path / "bad.npz", **changed), LAYOUT)
    assert "bad.npz" in str(error.value)
    (tmp_path / "none.npz").write_bytes(b"nothing")
    with pytest.raises(FormatError, match=r"none\.npz"):
        read_labelled(tmp_path / "none.npz", LAYOUT)


def test_own_frames_keep_their_shape_in_another_size_and_gaps_stay_gaps() -> None:
    points = frames()
    points[:, 4] = np.nan
    own = LabelledFrames("own", points, np.full(len(points), RIGHT))
    clouds = next(labelled_supply(0, [own], LAYOUT, 64))
    assert not (clouds.label == 4).any() and {LEFT, RIGHT} <= set(clouds.side.ravel())
    for row in range(64):
        named = np.flatnonzero(clouds.label[row] != NONE)
        place = clouds.points_m[row, named].astype(np.float64)
        there = LAYOUT.positions_m[clouds.label[row, named]]
        gaps = [np.linalg.norm(p[:, None] - p[None], axis=2).ravel() for p in (place, there)]
        size = (gaps[0] @ gaps[1]) / (gaps[1] @ gaps[1])
        assert 0.88 < size < 1.12 and np.abs(gaps[0] - size * gaps[1]).max() < 0.025
