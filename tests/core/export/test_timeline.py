import numpy as np
import pytest

from core.errors import ExportError
from core.frames import MarkerFrame, Times
from core.takes.export.content import last_tracked
from core.takes.export.job import export
from core.takes.export.naming import file_stem
from core.takes.export.timeline import timeline_of
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.solution import Solution
from tests.data import case_path


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
    timeline = timeline_of(frames(range(20_000), times), 120.0)
    assert np.array_equal(timeline.slots, np.arange(20_000))
    assert timeline.rate_hz == pytest.approx(119.88, abs=1e-3)  # at 120 Hz the last frame would be 20 places early
    assert timeline.warnings == ()


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


def test_frames_of_unknown_time_stand_between_those_beside_them():
    """A machine that slept knows not when some frames were; the times of all others stay."""
    numbers = np.array([5, 6, 7, 9, 10, 11, 12, 1, 2])  # one is lost, then the device counts anew
    true_s = 77 + np.array([0, 1, 2, 4, 5, 6, 7, 8, 9]) / 120
    known_s = true_s.copy()
    known_s[[0, 3, 4, 7, 8]] = np.nan
    timeline = timeline_of(frames(numbers, known_s), 120.0)
    assert timeline.start_s == pytest.approx(77, abs=1e-9)
    assert np.allclose(timeline.times_s, true_s - 77, atol=1e-9)
    assert timeline.slots.tolist() == [0, 1, 2, 4, 5, 6, 7, 8, 9]
    assert "5 frames of unknown time" in timeline.warnings[-1]


def test_frames_that_arrive_in_bursts_are_spaced_by_the_rate():
    times = np.repeat(np.arange(4) / 25, 4) + np.tile([0.0, 2e-5, 4e-5, 6e-5], 4)
    timeline = timeline_of(frames(range(16), times), 100.0)
    assert np.allclose(timeline.times_s, np.arange(16) / 100)


def test_unknown_rate_is_taken_from_the_times():
    assert timeline_of(frames(range(5), np.arange(5) / 250), float("nan")).rate_hz == pytest.approx(250.0)
    with pytest.raises(ExportError, match="frame rate is unknown"):
        timeline_of(frames([1], [0.0]), float("nan"))


def off(timeline):
    """By how many places each frame stands off its time."""
    return timeline.slots - timeline.times_s * timeline.rate_hz


@pytest.mark.parametrize("nominal", [30.0, 59.94, 120.0, 240.0, 960.0])
@pytest.mark.parametrize("parts", [1.0, 1.00005, 0.999, 1.02, 0.5, 2.0])
@pytest.mark.parametrize("jitter", [0.0, 0.05, 0.12])
def test_one_rate_keeps_its_even_grid_and_its_time(nominal, parts, jitter):
    """Stated rightly, nearly or wrongly: every frame has the next place, and none drifts off its time."""
    rng = np.random.default_rng(3)
    n, true = 6000, nominal * parts
    times = (np.arange(n) + rng.normal(0, jitter, n).clip(-0.4, 0.4)) / true
    timeline = timeline_of(frames(range(n), times), nominal)
    assert np.array_equal(timeline.slots, np.arange(n))
    assert np.abs(off(timeline)).max() <= 0.5 + 8 * jitter
    nearly = abs(n / true - n / nominal) * nominal <= 0.5
    assert (timeline.rate_hz == nominal) == nearly
    assert timeline.rate_hz == pytest.approx(true, rel=1e-4)
    assert bool(timeline.warnings) == (abs(parts - 1) > 0.01)


def times_of(rates, seconds, jitter=0.0, phase=0.3, seed=5):
    """Frames at one rate after another, the clocks of both out of step."""
    times, at = [], 0.0
    for rate, lasts in zip(rates, seconds, strict=True):
        part = at + np.arange(int(rate * lasts)) / rate
        at = part[-1] + (1 + phase) / rate
        times.append(part)
    rng = np.random.default_rng(seed)
    shortest = np.concatenate([np.full(len(part), 1 / rate) for part, rate in zip(times, rates, strict=True)])
    return np.concatenate(times) + rng.uniform(-jitter, jitter, len(shortest)) * shortest


@pytest.mark.parametrize("jitter", [0.0, 0.1])
@pytest.mark.parametrize("lost", [0.0, 0.05])
@pytest.mark.parametrize(
    ("rates", "seconds", "words"),
    [
        ((120, 240), (2, 3), "changes from 120 to 240 Hz at 2.0 s"),
        ((240, 120), (2, 3), "changes from 240 to 120 Hz at 2.0 s"),
        ((30, 960), (4, 2), "changes from 30 to 960 Hz at 4.0 s"),
        ((100, 240), (5, 5), "changes from 100 to 240 Hz at 5.0 s"),
        ((120, 240, 120), (3, 2, 4), "changes 2 times between 120 and 240 Hz, first at 3.0 s"),
        ((100, 119.88), (60, 60), "changes from 100 to 119.88 Hz at 60.0 s"),
    ],
)
def test_a_rate_that_changes_in_mid_take_keeps_its_time(rates, seconds, words, lost, jitter):
    times = times_of(rates, seconds, jitter)
    kept = np.flatnonzero(np.random.default_rng(1).random(len(times)) >= lost)
    timeline = timeline_of(frames(kept + 7, times[kept]), float(rates[0]))
    assert timeline.rate_hz == pytest.approx(max(rates), rel=2e-3 if jitter else 1e-4)
    assert np.all(np.diff(timeline.slots) >= 1)
    assert np.abs(off(timeline)).max() <= 0.5 + 3 * jitter
    (warning,) = timeline.warnings
    assert words in warning
    assert "even grid of C3D, TRC and BVH" in warning


def test_a_rate_that_changes_by_little_keeps_its_time():
    times = times_of((100, 101), (60, 60))
    timeline = timeline_of(frames(range(len(times)), times), 100.0)
    assert np.all(np.diff(timeline.slots) >= 1)
    assert np.abs(off(timeline)).max() < 1.0
    assert "wanders between 100 and 101 Hz" in timeline.warnings[0]


@pytest.mark.parametrize("seed", range(40))
def test_whatever_a_server_does_the_grid_keeps_time(seed):
    """Parts at two rates in any order, some lost; between them it stands still, is started anew, or frames are lost."""
    rng = np.random.default_rng(seed)
    rates = rng.choice([50, 100, 120, 200, 240, 480], size=2, replace=False)
    times, numbers, at, number = [], [], 0.0, int(rng.integers(1000))
    for _ in range(rng.integers(1, 5)):
        rate = rng.choice(rates)
        n = int(rate * rng.uniform(1.6, 6.0))
        times.append(at + np.arange(n) / rate)
        numbers.append(number + np.arange(n))
        at, number = times[-1][-1] + 1 / rate, number + n
        match rng.choice(["nothing", "stands still", "is started anew", "frames are lost"]):
            case "stands still":
                at += rng.uniform(0.2, 9.0)
            case "is started anew":
                at, number = at + rng.uniform(0.2, 9.0), 0
            case "frames are lost":
                lost = int(rng.integers(1, 200))
                at, number = at + lost / rate, number + lost
    jitter = rng.choice([0.0, 0.08])
    all_s = np.concatenate(times)
    all_s = all_s + jitter * rng.uniform(-1, 1, len(all_s)) / rates.max()
    kept = rng.random(len(all_s)) >= rng.choice([0.0, 0.03])
    timeline = timeline_of(frames(np.concatenate(numbers)[kept], all_s[kept]), float(rates[0]))
    assert np.all(np.diff(timeline.slots) >= 1)
    assert np.abs(off(timeline)).max() <= 0.5 + 8 * jitter + 1e-6


def test_holes_do_not_add_up_to_a_drift():
    """A server that stands still a hundred times, for a length that is no whole number of frames."""
    starts = np.arange(100) * (60 / 120 + 0.2515)
    times = (starts[:, None] + np.arange(60) / 120).ravel()
    timeline = timeline_of(frames(range(len(times)), times), 120.0)
    assert timeline.rate_hz == 120.0
    assert np.abs(off(timeline)).max() <= 0.5 + 1e-6
    assert timeline.warnings == ()


def test_a_machine_that_was_held_up_makes_no_places():
    """Frames that waited and came at once are of the rate of all others: their numbers tell, not when they came."""
    times = np.arange(1200) / 120
    times[600:672] = times[672] - np.arange(72, 0, -1) * 2e-4
    timeline = timeline_of(frames(range(1200), times), 120.0)
    assert timeline.rate_hz == 120.0
    assert np.array_equal(timeline.slots, np.arange(1200))


def test_frames_that_come_in_clumps_have_one_rate():
    times = np.repeat(np.arange(300) / 25, 4) + np.tile([0.0, 2e-4, 4e-4, 6e-4], 300)
    timeline = timeline_of(frames(range(1200), times), 100.0)
    assert timeline.rate_hz == pytest.approx(100.0, rel=1e-3)
    assert np.array_equal(timeline.slots, np.arange(1200))


def test_a_loop_that_numbers_its_frames_anew():
    times = np.arange(1200) / 120
    timeline = timeline_of(frames(np.arange(1200) % 120, times), 120.0)
    assert np.array_equal(timeline.slots, np.arange(1200))


def test_the_take_of_the_case_keeps_its_time_in_every_format(tmp_path):
    path = case_path("files", "13-rate-changes-in-mid-take", "nat_ratechange.mcap")
    with open_take(path) as take:
        assert len(take.holes) == 0
        timeline = timeline_of(take.raw, take.info.rate_hz)
        assert timeline.rate_hz == 240.0
        assert np.all(np.diff(timeline.slots) >= 1)
        assert np.abs(off(timeline)).max() < 0.05
        assert timeline.times_s[-1] == pytest.approx(4.99165, abs=1e-5)
        assert "changes from 120 to 240 Hz at 1.7 s" in timeline.warnings[0]
        solution = Solution.of_take(take)
        export(solution, ["c3d", "trc", "csv"], tmp_path)
        last_s = timeline_of(take.solved, take.info.rate_hz).times_s[-1]
    for suffix in ("c3d", "trc"):
        (file,) = tmp_path.glob(f"*.{suffix}")
        recording = read_recording(file)
        assert recording.rate_hz == 240.0
        assert recording.times_s[-1] == pytest.approx(last_s, abs=0.5 / 240)


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
