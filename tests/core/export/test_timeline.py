import numpy as np
import pytest

from core.errors import ExportError
from core.frames import MarkerFrame, Times
from core.takes.export.content import last_tracked
from core.takes.export.naming import file_stem
from core.takes.export.timeline import timeline_of


def frames(sequences, times):
    nothing = np.empty((0, 3)), np.empty(0, dtype=np.int64), np.empty(0)
    return [MarkerFrame(s, Times(t, t, t), *nothing) for s, t in zip(sequences, times, strict=True)]


def test_lost_frames_leave_free_places():
    timeline = timeline_of(frames([5, 6, 9, 10], 77 + np.array([0, 1, 4, 5]) / 120), 120.0)
    assert timeline.slots.tolist() == [0, 1, 4, 5]
    assert timeline.n_slots == 6
    assert timeline.frame_at_slot().tolist() == [0, 1, 1, 1, 2, 3]
    assert np.allclose(timeline.times_s, np.array([0, 1, 4, 5]) / 120)
    assert np.allclose(timeline.shifted(76.5).times_s, timeline.times_s + 0.5)


def test_a_clock_a_little_off_its_nominal_rate_makes_no_holes():
    times = np.arange(20_000) / 119.88 + np.random.default_rng(0).normal(0, 0.0005, 20_000)
    assert np.array_equal(timeline_of(frames(range(20_000), times), 120.0).slots, np.arange(20_000))


def test_a_device_that_sends_every_second_frame():
    assert timeline_of(frames([0, 2, 4, 8], np.array([0, 1, 2, 4]) / 60), 60.0).slots.tolist() == [0, 1, 2, 4]


def test_a_device_that_begins_anew_is_timed_by_the_clock():
    back = timeline_of(frames([900, 901, 902, 3, 4], np.array([0, 1, 2, 12, 13]) / 100), 100.0)
    assert back.slots.tolist() == [0, 1, 2, 12, 13]
    ahead = timeline_of(frames([1, 2, 3, 4_000_000, 4_000_001], np.array([0, 1, 2, 5, 6]) / 100), 100.0)
    assert ahead.slots.tolist() == [0, 1, 2, 5, 6]


@pytest.mark.parametrize("bad", [float("nan"), 0.0, -5.0, 1e9])
def test_one_bad_time_does_not_end_the_recording(bad):
    times = np.arange(6) / 100
    times[3] = bad
    timeline = timeline_of(frames(range(6), times), 100.0)
    assert timeline.slots.tolist() == [0, 1, 2, 3, 4, 5]
    if bad != 1e9:
        assert np.allclose(timeline.times_s, np.arange(6) / 100)
    assert np.all(np.diff(timeline.times_s) > 0)


def test_frames_that_arrive_in_bursts_are_spaced_by_the_rate():
    times = np.repeat(np.arange(4) / 25, 4) + np.tile([0.0, 2e-5, 4e-5, 6e-5], 4)
    timeline = timeline_of(frames(range(16), times), 100.0)
    assert np.allclose(timeline.times_s, np.arange(16) / 100)


def test_unknown_rate_is_taken_from_the_times():
    assert timeline_of(frames(range(5), np.arange(5) / 250), float("nan")).rate_hz == pytest.approx(250.0)
    with pytest.raises(ExportError, match="frame rate is unknown"):
        timeline_of(frames([1], [0.0]), float("nan"))


def test_untracked_frames_hold_the_last_pose():
    tracked = np.array([False, False, True, True, False, True, False])
    assert last_tracked(tracked).tolist() == [2, 2, 2, 3, 3, 5, 5]


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("anna_01", "anna_01"),
        ("a/b:c*?", "a_b_c__"),
        ("", "take"),
        (" .. ", "take"),
        ("con", "_con"),
        ("x" * 400, "x" * 150),
    ],
)
def test_take_names_become_file_names(name, stem):
    assert file_stem(name) == stem
