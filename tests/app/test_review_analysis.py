from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.review.analysis import Cell, analyse
from app.review.lane_list import LaneList
from app.review.lanes import clock, tick_step, worst_cells
from app.review.moment import moment_words
from app.review.player import Player
from app.review.take_plots import TakePlots
from core.frames import WHY_LOST, HandState
from core.hand.skeleton import DOF_NAMES
from core.profile import load_profile
from core.takes.matching import match_solved
from core.takes.reader import open_take
from tests.app.hand_frames import hand_frame, profile, sample
from tests.app.takes import write_take


def test_a_take_becomes_arrays_over_its_frames(tmp_path):
    path = write_take(tmp_path, "a", 60, lost=range(10, 20), hidden=range(30, 45), unsolved=range(50, 55))
    with open_take(path) as take:
        matched = match_solved(take.raw.times_s, take.solved.times_s)
        analysis = analyse(take.solved, matched, take.profile)
    left, right = (analysis.sides.index(side) for side in ("left", "right"))
    expected = np.full(60, Cell.TRACKED)
    expected[10:20], expected[50:55] = Cell.LOST, Cell.UNSOLVED
    assert analysis.states[left].tolist() == expected.tolist()
    assert (analysis.states[right] == Cell.TRACKED).sum() == 55
    assert analysis.tracked_share(left) == pytest.approx(45 / 60)
    assert (analysis.losses(left), analysis.losses(right)) == (1, 0)
    gaps = analysis.gap_shares(left)
    assert gaps[2] == pytest.approx(15 / 45) and gaps[[0, 1, 3]].tolist() == [0, 0, 0]
    tracked = analysis.states[left] == Cell.TRACKED
    assert np.isfinite(analysis.rms_m[left]).tolist() == tracked.tolist()
    assert np.isfinite(analysis.theta_rad[left, :, 7]).tolist() == tracked.tolist()


def test_how_sure_each_frame_is(tmp_path):
    path = write_take(tmp_path, "a", 60, lost=range(10, 20), hidden=range(30, 45), guessed=range(40, 50))
    with open_take(path) as take:
        matched = match_solved(take.raw.times_s, take.solved.times_s)
        analysis = analyse(take.solved, matched, take.profile)
    left, right = (analysis.sides.index(side) for side in ("left", "right"))
    assert np.isfinite(analysis.theta_std[left]).all(axis=1).tolist() == [not 10 <= i < 20 for i in range(60)]
    dof = DOF_NAMES.index("ring_dip_flexion")
    degrees = np.degrees(analysis.theta_std[:, :, dof])
    assert degrees[left, 40:50] == pytest.approx(30.0) and degrees[right, 40:50] == pytest.approx(2.0)
    assert analysis.marker_std_m[left, 45, :3] == pytest.approx([0.001, 0.001, 0.009])
    assert analysis.guessed_joints[left].tolist() == [int(40 <= i < 50) for i in range(60)]
    assert analysis.guessed_joints[right].tolist() == [0] * 60
    assert analysis.guessed_share(left) == pytest.approx(10 / 50) and analysis.guessed_share(right) == 0.0


def test_the_moment_in_words(tmp_path):
    path = write_take(tmp_path, "a", 60, lost=range(10, 20), guessed=range(40, 50))
    dof = DOF_NAMES.index("ring_dip_flexion")
    with open_take(path) as take:
        analysis = analyse(take.solved, np.arange(60), take.profile)
        degrees = np.degrees(take.solved[45].hands[0].theta_rad[dof])
    assert [moment_words(analysis, 45, dof).splitlines()[i] for i in (analysis.sides.index("left"),)] == [
        f"Left: ring DIP flexion {degrees:.0f}° ±30°, least sure: ring DIP ±30°"
    ]
    assert "Left: not tracked" in moment_words(analysis, 15, dof)
    unknown = write_take(tmp_path, "b", 5)
    with open_take(unknown) as take:
        words = moment_words(analyse(take.solved, np.arange(5), take.profile), 2, dof)
    assert f"Left: ring DIP flexion {degrees:.0f}°" in words.splitlines() and "±" not in words


def test_reading_stops_when_asked(tmp_path):
    with open_take(write_take(tmp_path, "a")) as take:
        matched = match_solved(take.raw.times_s, take.solved.times_s)
        assert analyse(take.solved, matched, take.profile, lambda share, text: False) is None


@given(st.sets(st.integers(0, 50)), st.randoms())
def test_solved_frames_find_their_raw_ones(dropped, random):
    raw = np.arange(51) / 100
    kept = [i for i in range(51) if i not in dropped]
    random.shuffle(kept)
    matched = match_solved(raw, raw[kept] + 1e-8)
    assert [(-1 if i in dropped else kept.index(i)) for i in range(51)] == matched.tolist()


def test_a_clock_that_stands_still_matches_in_order():
    raw = np.array([0.0, 0.1, 0.1, 0.2])
    assert match_solved(raw, np.array([0.1, 0.1, 0.2])).tolist() == [-1, 0, 1, 2]
    assert match_solved(raw, np.empty(0)).tolist() == [-1] * 4
    assert match_solved(np.empty(0), raw).tolist() == []


@given(
    st.lists(st.sampled_from([Cell.UNSOLVED, Cell.SEARCHING, Cell.LOST, Cell.TRACKED]), min_size=1, max_size=80),
    st.integers(1, 40),
)
def test_a_pixel_shows_the_worst_of_its_frames(cells, width):
    cells = np.array(cells, np.uint8)
    edges = np.linspace(0, len(cells), width + 1)
    starts, ends = np.floor(edges[:-1]).astype(int), np.ceil(edges[1:]).astype(int)
    order = [Cell.LOST, Cell.SEARCHING, Cell.TRACKED, Cell.UNSOLVED]
    expected = [min(cells[a:b], key=order.index) for a, b in zip(starts, ends, strict=True)]
    assert worst_cells(cells, starts, ends).tolist() == expected


def test_one_lost_frame_in_an_hour_is_seen():
    cells = np.full(360_000, Cell.TRACKED, np.uint8)
    cells[123_456] = Cell.LOST
    edges = np.linspace(0, len(cells), 801).astype(int)
    shown = worst_cells(cells, edges[:-1], edges[1:])
    assert (shown == Cell.LOST).nonzero()[0].tolist() == [123_456 * 800 // 360_000]


@pytest.mark.parametrize(
    ("time_s", "decimals", "text"),
    [(0, 1, "0:00.0"), (61.26, 2, "1:01.26"), (59.999, 1, "1:00.0"), (3600, 0, "60:00"), (-1.5, 1, "-0:01.5")],
)
def test_times_as_an_operator_reads_them(time_s, decimals, text):
    assert clock(time_s, decimals) == text


@given(st.floats(0.01, 1e4), st.floats(100, 3000))
def test_ticks_are_apart(span_s, width):
    step_s, decimals = tick_step(span_s, width)
    assert step_s >= span_s * 90 / width or step_s == 3600
    assert clock(step_s, decimals) != clock(2 * step_s, decimals)


def test_hands_of_two_performers_are_kept_apart(tmp_path):
    """The second wears another glove, on one hand, and is lost for a while."""
    cast = (replace(profile(), performer="Ann"), load_profile("qualisys13"))
    ann = [hand_frame(side, worn=cast[0]) for side in ("left", "right")]
    other = {state: replace(hand_frame("right", worn=cast[1], state=state), performer=1) for state in HandState}
    solved = [
        sample(*ann, other[HandState.LOST if 10 <= i < 25 else HandState.TRACKED], sequence=i)[1] for i in range(50)
    ]
    analysis = analyse(solved, np.arange(50), cast)
    assert analysis.hands == ((0, "left"), (0, "right"), (1, "right"))
    assert [analysis.title(i) for i in range(3)] == ["Ann · left", "Ann · right", "Performer 2 · right"]
    assert [len(names) for names in analysis.marker_names] == [19, 19, 13]
    assert [len(analysis.gap_shares(i)) for i in range(3)] == [19, 19, 13]
    assert [analysis.tracked_share(i) for i in range(3)] == [1.0, 1.0, 35 / 50]
    assert analysis.observed[2, 0].tolist() == [True] * 13 + [False] * 6 and not analysis.observed[2, 10].any()
    lanes = LaneList(analysis, markers_shown=True)
    assert [lane.name for lane in lanes.lanes if lane.marker < 0] == [
        "Ann · left",
        "Ann · right",
        "Performer 2 · right",
    ]
    assert len({lane.colour for lane in lanes.lanes if lane.marker < 0}) == 3
    assert len(lanes.lanes) == 3 + 19 + 19 + 13
    words = moment_words(analysis, 12, DOF_NAMES.index("index_pip_flexion")).splitlines()
    assert words[2] == "Performer 2 · right: not tracked" and words[0].startswith("Ann · left: index PIP flexion ")


def test_certainty_of_labels_and_why_a_hand_was_lost(qtbot):
    """What a take knows of its labels is drawn, mean and worst, and said of the frame shown."""
    sure = np.full(19, 0.99)
    doubted = np.where(np.arange(19) == 4, 0.3, sure)
    right = replace(hand_frame("right"), label_confidence=sure)
    left = [
        replace(hand_frame("left"), label_confidence=sure),
        replace(hand_frame("left"), label_confidence=doubted, why="searching"),
        replace(hand_frame("left", state=HandState.LOST), why="too few markers"),
        hand_frame("left", state=HandState.LOST),
    ]
    solved = [sample(left[i // 10], right, sequence=i)[1] for i in range(40)]
    analysis = analyse(solved, np.arange(40), profile())
    one = analysis.sides.index("left")
    assert analysis.trust[one, ::10] == pytest.approx(
        np.array([[0.99, 0.99], [doubted.mean(), 0.3], [np.nan] * 2, [np.nan] * 2]), nan_ok=True
    )
    assert [WHY_LOST[why] for why in analysis.why[one, ::10]] == ["", "searching", "too few markers", ""]
    words = [moment_words(analysis, i, DOF_NAMES.index("index_pip_flexion")).splitlines()[one] for i in (0, 10, 20, 30)]
    assert words[0].endswith(", labels 99 % sure, the worst 99 %")
    assert words[1].endswith(", labels 95 % sure, the worst 30 %")
    assert words[2:] == ["Left: not tracked, too few of its markers seen", "Left: not tracked"]
    plots = TakePlots(Player())
    qtbot.addWidget(plots)
    times_s = np.arange(40) / 100
    plots.show_take(times_s, analysis)
    for what, column in (("labels", 0), ("worst label", 1)):
        x, y = plots.curve(what, "left")
        np.testing.assert_array_equal(x, times_s)
        np.testing.assert_array_equal(y, 100 * analysis.trust[one, :, column])
    unknown = [sample(hand_frame("left"), hand_frame("right"), sequence=i)[1] for i in range(5)]
    plots.show_take(times_s[:5], analyse(unknown, np.arange(5), profile()))
    assert plots.curve("labels", "left")[1].size == plots.curve("worst label", "right")[1].size == 0
