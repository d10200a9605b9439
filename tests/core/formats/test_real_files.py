"""Files of other programs, as they were recorded."""

import numpy as np
import pytest

from core.takes.formats import read_recording
from tests.data import data_path

HAN_NAMES = (
    "ThumbCMC", "ThumbMCP", "ThumbIP", "ThumbTip", "IndexMCP", "IndexPIP", "IndexTip", "MiddleMCP", "MiddlePIP",
    "MiddleTip", "RingMCP", "RingPIP", "RingTip", "PinkyMCP", "PinkyPIP", "PinkyTip", "BackHand1", "BackHand2",
    "BackHand3",
)  # fmt: skip


def gaps(missing):
    edges = np.flatnonzero(np.diff(np.r_[0, missing.astype(int), 0]))
    return edges[1::2] - edges[::2]


def test_qualisys_recording():
    recording = read_recording(data_path("qualisys_hand", "recording.tsv"))
    assert recording.name == "recording"
    assert (recording.n_frames, recording.rate_hz, recording.duration_s) == (6000, 100.0, 60.0)
    assert len(recording.labels) == 21
    assert recording.labels[0] == "hand_top" and recording.labels[-1] == "pillow_right"
    assert np.array_equal(recording.frame_numbers, np.arange(1, 6001))
    assert np.allclose(recording.times_s, np.arange(6000) / 100.0, atol=1e-9)
    # hand_top of the first line, 110.406 135.075 460.584 mm with Z up
    assert np.allclose(recording.points_m[0, 0], (0.110406, 0.460584, -0.135075), atol=1e-12)


def test_qualisys_gaps_are_those_of_the_recording():
    recording = read_recording(data_path("qualisys_hand", "recording.tsv"))
    missing = np.isnan(recording.points_m[:, recording.labels.index("thumb_tip"), 0])
    assert missing.sum() == 493  # 8.2 %
    lengths = gaps(missing)
    assert (len(lengths), lengths.max()) == (17, 57)
    frames = list(recording.frames())
    assert sum(len(frame.points_m) for frame in frames) == np.isfinite(recording.points_m).sum() // 3
    thumb = recording.ids[recording.labels.index("thumb_tip")]
    assert [thumb in frame.ids for frame in frames] == list(~missing)


def test_han_sequences():
    folder = data_path("han2018", "trc")
    paths = sorted(path for path in folder.iterdir() if not path.name.startswith("gaps"))
    assert paths
    for path in paths:
        recording = read_recording(path)
        rows = len(path.read_text().splitlines()) - 5
        assert recording.labels == HAN_NAMES
        assert (recording.n_frames, recording.rate_hz) == (rows, 120.0)
        assert not np.isnan(recording.points_m).any()
        assert np.abs(recording.points_m).max() < 1.0


def test_han_gaps_file_promises_more_frames_than_it_has():
    recording = read_recording(data_path("han2018", "trc", "gaps_user1_sequence.14_training_dense_right.trc"))
    assert recording.n_frames == 49  # the header says 50
    assert recording.frame_numbers[-1] == 49
    (jump,) = np.flatnonzero(np.diff(recording.frame_numbers) != 1)
    assert recording.frame_numbers[jump + 1] - recording.frame_numbers[jump] == 2
    assert recording.times_s[jump + 1] - recording.times_s[jump] == pytest.approx(2 / 120, abs=1e-6)
    assert np.allclose(recording.points_m[0, 0], (0.116433, 0.0144389, 0.105909), atol=1e-12)
