"""Points picked in one frame: followed by id and by nearness, judged, and tracked through the take."""

from __future__ import annotations

import numpy as np
import pytest

from core.errors import CancelledError, PhalanxError
from core.frames import NO_ID, MarkerFrame
from core.props.define import define
from core.props.picked import check_rigid, followed, loosest, moved_by, still_words, stretch_about
from core.props.rigid import aligned, moved
from tests.core.props.things import BALL, PEN, frame, path, pose

N = 240


def a_take(ids_last: range = range(N), noise_m: float = 0.0, still: bool = False) -> list[MarkerFrame]:
    """The pen on its way among four points of something else. Outside `ids_last` its first marker has another id."""
    random = np.random.default_rng(1)
    others = random.uniform(-0.3, 0.3, (4, 3)) + [0.0, 1.0, 0.0]
    frames = []
    for i in range(N):
        placed = PEN.placed_m(path(0.0 if still else i / 120.0))
        ids = np.array([20, 1, 21, 2, 22, 3, 4, 23, 5 if i in ids_last else 90])
        order = [others[0], placed[0], others[1], placed[1], others[2], placed[2], placed[3], others[3], placed[4]]
        points = np.stack(order)
        frames.append(frame(i, points + random.normal(0.0, 1.0, points.shape) * noise_m, ids))
    return frames


ROWS = [1, 3, 5, 6, 8]


def test_the_stretch_ends_where_an_id_does() -> None:
    stretch = stretch_about(a_take(range(50, 130)), 100, ROWS)
    assert stretch.first == 50 and len(stretch.samples_m) == 80
    for k in (0, 79):
        np.testing.assert_array_equal(stretch.samples_m[k], PEN.placed_m(path((50 + k) / 120.0)))


def test_points_without_ids_are_followed_by_nearness() -> None:
    frames = [
        MarkerFrame(f.sequence, f.times, f.points_m[::-1], np.full(9, NO_ID), f.residuals_m) if i % 2 else
        MarkerFrame(f.sequence, f.times, f.points_m, np.full(9, NO_ID), f.residuals_m)
        for i, f in enumerate(a_take())
    ]  # fmt: skip
    stretch = stretch_about(frames, 100, ROWS)
    assert stretch.first == 0 and len(stretch.samples_m) == N
    np.testing.assert_array_equal(stretch.samples_m[-1], PEN.placed_m(path((N - 1) / 120.0)))


@pytest.mark.parametrize(("rows", "words"), [([], "No points are"), ([1], "One point is"), ([1, 3], "2 points are")])
def test_too_few_points_are_refused_by_their_number(rows: list[int], words: str) -> None:
    with pytest.raises(PhalanxError, match=f"{words} chosen.*3 to 16"):
        stretch_about(a_take(), 0, rows)


def test_the_point_that_moves_is_named_by_its_number_and_its_way() -> None:
    samples = stretch_about(a_take(noise_m=3e-5), 10, [1, 3, 5, 6, 8]).samples_m.copy()
    check_rigid(samples)
    samples[:, 3, 1] += 0.02 * np.sin(np.arange(N) / 9.0)
    k, way_m, others_rigid = loosest(samples)
    assert k == 3 and way_m == pytest.approx(0.02, rel=0.08) and others_rigid
    with pytest.raises(PhalanxError, match=r"point 4 moves by (19|20|21)\.\d mm.*Shift\+click"):
        check_rigid(samples)
    three = samples[:, [0, 1, 3]]
    with pytest.raises(PhalanxError, match=r"point 3 moves by \d+\.\d mm"):
        check_rigid(three)
    samples[:, 0, 0] += 0.02 * np.cos(np.arange(N) / 7.0)
    with pytest.raises(PhalanxError, match="move among themselves too"):
        check_rigid(samples)


def test_how_far_points_moved_and_turned() -> None:
    frames = a_take()
    way_m, turn_rad = moved_by(stretch_about(frames, 0, ROWS).samples_m)
    relative = [path(0.0)[:3, :3].T @ path(i / 120.0)[:3, :3] for i in range(N)]
    turns = [np.arccos(np.clip((np.trace(r) - 1) / 2, -1, 1)) for r in relative]
    assert turn_rad == pytest.approx(max(turns), abs=1e-6)
    middles = np.array([PEN.placed_m(path(i / 120.0)).mean(axis=0) for i in range(N)])
    assert way_m == pytest.approx(np.linalg.norm(middles - middles[0], axis=1).max(), rel=1e-9)
    assert still_words(stretch_about(frames, 0, ROWS).samples_m) == ""
    assert "moved only 0 mm and 0°" in still_words(stretch_about(a_take(still=True), 0, ROWS).samples_m)


def test_a_prop_from_a_part_is_followed_through_the_whole_take_past_broken_ids() -> None:
    frames = a_take(range(50, 130), noise_m=3e-5)
    made = define("pen", stretch_about(frames, 100, ROWS).samples_m, "cylinder")
    seen = followed(frames, N, made.prop)
    assert np.isfinite(seen.rms_m[3:]).all() and seen.tracked_share >= (N - 3) / N
    assert np.nanmax(seen.rms_m) < 1.5e-4
    truth = np.stack([PEN.placed_m(path(i / 120.0)) for i in range(N)])
    tracked = np.isfinite(seen.rms_m)
    assert np.abs(seen.samples_m[tracked] - truth[tracked]).max() < 2e-4
    better = define("pen", seen.samples_m, "cylinder").prop.markers_m
    away_m = np.linalg.norm(moved(better, aligned(better, PEN.markers_m)) - PEN.markers_m, axis=1)
    assert away_m.max() < 1e-5


def test_how_it_lay_at_first_goes_with_the_prop_and_its_file() -> None:
    begun = pose(np.random.default_rng(8))
    prop = define("ball", np.stack([BALL.placed_m(begun)] * 3), "none").prop
    assert prop.home is not None
    placed = prop.markers_m @ prop.home.T
    np.testing.assert_allclose(placed - placed[0], BALL.placed_m(begun) - BALL.placed_m(begun)[0], atol=1e-9)
    again = type(prop).from_dict(prop.to_dict())
    np.testing.assert_allclose(again.home, prop.home, atol=2e-6)
    with pytest.raises(PhalanxError, match=r"home_wxyz \[1, 1, 0, 0\].*unit quaternion"):
        type(prop).from_dict(prop.to_dict() | {"home_wxyz": [1, 1, 0, 0]})


def test_stopping_stops() -> None:
    frames = a_take()
    with pytest.raises(CancelledError):
        followed(frames, N, PEN, lambda share: share < 0.5)
