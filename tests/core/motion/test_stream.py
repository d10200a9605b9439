"""The marker stream: what is sent, what it truly is, and ids that mean no more than a device's do."""

from __future__ import annotations

from itertools import islice, pairwise

import numpy as np
import pytest

from core.errors import PhalanxError
from core.frames import SIDES
from core.markers.layout import load_layout
from core.motion.performer import Performer
from core.motion.stream import GHOST, LabelledFrame, MarkerStream, RecordingMotion
from core.profile import Profile
from core.recording import Recording
from core.takes.formats import read_recording
from tests.data import data_path
from tests.some import some

PROFILE = Profile("", load_layout("han19"), SIDES, 1.0)


def dressed(count: int, rate_hz: float = 60.0, seed: int = 1, **options: float) -> list[LabelledFrame]:
    return list(islice(MarkerStream(Performer(PROFILE, 0), rate_hz, seed, **options).labelled(), count))


def true_positions(count: int, rate_hz: float = 60.0) -> list[np.ndarray]:
    return [points for _, points in islice(Performer(PROFILE, 0).positions(rate_hz), count)]


def small_recording() -> Recording:
    """Two trajectories, 10 Hz, 8 frames; the second has a gap in frames 3 and 4."""
    times = np.arange(8) / 10.0
    points = np.zeros((8, 2, 3))
    points[:, 0, 0], points[:, 1, 1] = times, 1.0 + times
    points[3:5, 1] = np.nan
    return Recording("small", 10.0, times, np.arange(8), points, ("a", "b"), np.arange(2))


def test_every_point_is_where_its_truth_says() -> None:
    frames = dressed(600, hidden=0.1, ghosts=2.0, noise_m=0.0, bodies=2)
    for labelled, truth_m in some(zip(frames, true_positions(600), strict=True)):
        hand = (labelled.truth >= 0) & (labelled.truth < 38)
        np.testing.assert_array_equal(labelled.frame.points_m[hand], truth_m[labelled.truth[hand]])
        real = labelled.truth[labelled.truth != GHOST]
        assert len(np.unique(real)) == len(real)
        assert labelled.truth.max() < 38 + 8
        n = len(labelled.truth)
        assert labelled.frame.points_m.shape == (n, 3)
        assert labelled.frame.ids.shape == labelled.frame.residuals_m.shape == (n,)


def test_ids_live_exactly_from_gap_to_gap() -> None:
    """One id per unbroken run of one marker, and one marker (or ghost) per id, ever."""
    last_seen: dict[int, tuple[int, int]] = {}  # marker -> frame, id
    owner: dict[int, int] = {}
    runs = 0
    for i, labelled in enumerate(dressed(2000, hidden=0.1, ghosts=1.5, bodies=1)):
        assert len(np.unique(labelled.frame.ids)) == len(labelled.frame.ids)
        for truth, id_ in zip(labelled.truth.tolist(), labelled.frame.ids.tolist(), strict=True):
            assert owner.setdefault(id_, truth) == truth
            if truth == GHOST:
                continue
            frame, before = last_seen.get(truth, (-2, -1))
            assert (id_ == before) == (frame == i - 1)
            runs += frame != i - 1
            last_seen[truth] = (i, id_)
    assert runs > 100


def test_the_share_hidden_is_what_was_asked() -> None:
    for share in (0.0, 0.05, 0.3):
        frames = dressed(3600, hidden=share)
        seen = sum(int((labelled.truth != GHOST).sum()) for labelled in frames)
        assert 1.0 - seen / (3600 * 38) == pytest.approx(share, rel=0.12, abs=1e-12)


def test_gaps_last_as_long_as_real_ones() -> None:
    frames = dressed(7200, rate_hz=120.0, hidden=0.1)
    seen = np.zeros((7200, 38), dtype=bool)
    for i, labelled in enumerate(frames):
        seen[i, labelled.truth] = True
    lengths = []
    for column in seen.T:
        edges = np.flatnonzero(np.diff(column.astype(int)))
        lengths += [(end - start) / 120.0 for start, end in pairwise(edges) if not column[start + 1]]
    assert len(lengths) > 500
    assert 0.15 < np.median(lengths) < 0.21
    assert np.quantile(lengths, 0.9) == pytest.approx(0.36, abs=0.04)


def test_gaps_are_moments_not_frames() -> None:
    """The same seed hides the same moments at any rate."""
    slow, fast = dressed(300, rate_hz=60.0, hidden=0.15), dressed(1200, rate_hz=240.0, hidden=0.15)[::4]
    for a, b in some(zip(slow, fast, strict=True)):
        assert set(a.truth.tolist()) == set(b.truth.tolist())


def test_ghosts_flicker_near_the_markers() -> None:
    frames = dressed(3000, ghosts=2.0)
    counts = [int((labelled.truth == GHOST).sum()) for labelled in frames]
    assert np.mean(counts) == pytest.approx(2.0, rel=0.2)
    lives: dict[int, int] = {}
    for labelled in frames:
        ghost = labelled.truth == GHOST
        for id_ in labelled.frame.ids[ghost].tolist():
            lives[id_] = lives.get(id_, 0) + 1
        if ghost.any() and not ghost.all():
            apart = np.linalg.norm(
                labelled.frame.points_m[ghost][:, None] - labelled.frame.points_m[~ghost][None], axis=2
            )
            assert apart.min(axis=1).max() < 1.0
    assert 1 <= min(lives.values()) < 3
    assert np.mean(list(lives.values())) < 10


def test_noise_and_skin_have_the_size_asked() -> None:
    clean = true_positions(600)
    for options, rms_m in (({"noise_m": 5e-5}, 5e-5 * 3**0.5), ({"noise_m": 0.0, "skin_m": 7e-4}, 7e-4)):
        frames = dressed(600, **options)
        errors = [f.frame.points_m - truth[f.truth] for f, truth in zip(frames, clean, strict=True)]
        assert np.sqrt(np.mean(np.sum(np.square(errors), axis=2))) == pytest.approx(rms_m, rel=0.05)


def test_order_tells_nothing() -> None:
    orders = [labelled.truth for labelled in dressed(50)]
    assert all(sorted(order.tolist()) == list(range(38)) for order in some(orders))
    assert all((a != b).any() for a, b in some(pairwise(orders)))


def test_same_arguments_same_frames() -> None:
    stream = MarkerStream(Performer(PROFILE, 0), 100.0, 5, hidden=0.1, ghosts=3.0, skin_m=5e-4, bodies=1)
    twin = MarkerStream(Performer(PROFILE, 0), 100.0, 5, hidden=0.1, ghosts=3.0, skin_m=5e-4, bodies=1)
    for a, b, c in islice(zip(stream.labelled(), stream.labelled(), twin.frames(), strict=True), 300):
        for other in (b.frame, c):
            np.testing.assert_array_equal(a.frame.points_m, other.points_m)
            np.testing.assert_array_equal(a.frame.ids, other.ids)
            np.testing.assert_array_equal(a.frame.residuals_m, other.residuals_m)
            assert (a.frame.sequence, a.frame.times) == (other.sequence, other.times)
    other_seed = next(iter(MarkerStream(Performer(PROFILE, 0), 100.0, 6).frames()))
    assert (other_seed.points_m[0] != a.frame.points_m[0]).any()


def test_bodies_carry_their_markers() -> None:
    """The reported pose takes the same four local points to the world in every frame."""
    local: np.ndarray | None = None
    lost = 0
    for labelled in dressed(900, noise_m=0.0, bodies=1, hidden=0.2):
        (body,) = labelled.frame.rigid_bodies
        at = dict(zip(labelled.truth.tolist(), labelled.frame.points_m, strict=True))
        markers = [38 + m for m in range(4) if 38 + m in at]
        assert body.tracked == (len(markers) >= 3)
        lost += not body.tracked
        w, _, y, _ = body.quaternion_wxyz
        c, s = w * w - y * y, 2.0 * w * y
        turned = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        if local is None:
            assert len(markers) == 4
            local = np.stack([turned.T @ (at[38 + m] - body.position_m) for m in range(4)])
        if body.tracked:
            for m in markers:
                np.testing.assert_allclose(turned @ local[m - 38] + body.position_m, at[m], atol=1e-9)
    assert lost > 10


def test_times_and_sequence_count_from_zero() -> None:
    frames = dressed(10, rate_hz=250.0)
    assert [labelled.frame.sequence for labelled in frames] == list(range(10))
    assert [labelled.frame.times.device_s for labelled in frames] == [i / 250.0 for i in range(10)]


def test_a_recording_once_at_its_own_rate_is_itself() -> None:
    recording = small_recording()
    frames = list(MarkerStream(RecordingMotion(recording), 10.0, noise_m=0.0).labelled())
    assert len(frames) == 8
    ids = []
    for i, labelled in enumerate(frames):
        for k, point in zip(labelled.truth.tolist(), labelled.frame.points_m, strict=True):
            np.testing.assert_array_equal(point, recording.points_m[i, k])
        assert 1 in labelled.truth or i in (3, 4)
        ids.append(dict(zip(labelled.truth.tolist(), labelled.frame.ids.tolist(), strict=True)))
    assert len({frame[0] for frame in ids}) == 1
    assert ids[2][1] == ids[0][1] != ids[5][1] == ids[7][1]


def test_a_recording_over_and_over_breaks_every_id_at_the_seam() -> None:
    frames = list(islice(MarkerStream(RecordingMotion(small_recording(), repeat=True), 10.0).labelled(), 20))
    of_a = [int(labelled.frame.ids[labelled.truth == 0][0]) for labelled in frames]
    assert of_a[0] == of_a[7] != of_a[8] == of_a[15] != of_a[16]
    assert [labelled.frame.sequence for labelled in frames] == list(range(20))


def test_a_recording_at_another_rate_is_interpolated() -> None:
    frames = list(MarkerStream(RecordingMotion(small_recording()), 20.0, noise_m=0.0).labelled())
    assert len(frames) in (15, 16)
    for i, labelled in enumerate(frames[:15]):
        np.testing.assert_allclose(labelled.frame.points_m[labelled.truth == 0][0], (i / 20.0, 0.0, 0.0), atol=1e-12)
        assert (1 in labelled.truth) == (i not in range(5, 10))  # never across a gap


def test_a_real_recording_keeps_its_own_gaps() -> None:
    recording = read_recording(data_path("qualisys_hand", "recording.tsv"))
    stream = MarkerStream(RecordingMotion(recording), recording.rate_hz, noise_m=0.0)
    present = ~np.isnan(recording.points_m[:, :, 0])
    count = 0
    for i, labelled in enumerate(stream.labelled()):
        assert sorted(labelled.truth.tolist()) == np.flatnonzero(present[i]).tolist()
        np.testing.assert_array_equal(labelled.frame.points_m, recording.points_m[i, labelled.truth])
        count += 1
    assert count == recording.n_frames == 6000


def test_an_unlabelled_recording_is_refused() -> None:
    recording = Recording("loose", 10.0, np.zeros(1), np.zeros(1, int), np.zeros((1, 1, 3)), (), np.zeros((1, 1), int))
    with pytest.raises(PhalanxError, match="loose has no labels"):
        RecordingMotion(recording)


@pytest.mark.parametrize(
    ("option", "value", "named"),
    [
        ("hidden", 0.95, "hidden share is 0.95"),
        ("hidden", float("nan"), "hidden share is nan"),
        ("ghosts", -1.0, "number of ghosts is -1"),
        ("noise_m", 1.0, "noise"),
        ("skin_m", -0.1, "skin"),
        ("bodies", 51, "number of bodies is 51"),
    ],
)
def test_a_value_out_of_range_is_named(option: str, value: float, named: str) -> None:
    with pytest.raises(PhalanxError, match=named):
        MarkerStream(Performer(PROFILE, 0), 120.0, **{option: value})


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, float("inf"), float("nan")])
def test_a_rate_must_be_a_rate(rate_hz: float) -> None:
    with pytest.raises(PhalanxError, match="frame rate is"):
        MarkerStream(Performer(PROFILE, 0), rate_hz)
