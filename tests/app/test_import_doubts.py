"""What an import says of hands that are doubted: the same as `phalanx track`."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np

from app.labels import cast_labels
from app.review import tasks
from app.tracking_doubts import doubts
from app.tracking_figures import figures, frames_and_columns
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.reprocess import solve
from core.takes.verify import verify
from tests.app.test_cli_track_doubts import trc


def hand(n):
    """(n, 19, 3) [m] of a right hand in han19, no point missing."""
    worn = replace(load_profile("han19"), sides=("right",))
    frames = islice(MarkerStream(Performer(worn), 120.0, noise_m=0.0).frames(), n)
    return np.stack([frame.points_m[np.argsort(frame.ids)] for frame in frames])


def imported(path, worn, live_labels=False):
    """What is told of it, and the take."""
    target = path.with_name(f"{path.stem}_{'_'.join(worn.sides)}.mcap")
    return tasks.import_take(str(path), str(target), [worn.to_json()], live_labels, lambda *_: None), target


def test_a_hand_that_rests_on_few_markers_is_said_as_track_says_it(tmp_path):
    worn = load_profile("han19")
    few = [0, 1, 2, 5, 8, 11, 14]
    path = trc(tmp_path / "few.trc", [f"R_{worn.layout.marker_names[i]}" for i in few], hand(40)[:, few])
    told, _ = imported(path, worn)
    recording, cast = read_recording(path), (worn,)
    frames, columns = frames_and_columns(recording)
    labels = cast_labels(recording, cast)
    found = figures(path, recording, cast, solve(frames, cast, labels=labels), columns, labels)
    expected = doubts(recording, cast, labels, False, found.hands, (), found.labels_left_out)
    assert told["doubts"] == [doubt.text for doubt in expected] and told["labels_given"]
    assert [doubt.kind for doubt in expected] == ["layout", "markers"]
    assert "Of the 19 markers of han19 the file names 7" in told["doubts"][0]
    assert "Of the right hand 3" in told["doubts"][1]


def test_frames_that_a_recording_lacks_count_as_not_tracked(tmp_path):
    worn = load_profile("han19")
    path = trc(tmp_path / "hole.trc", [f"R_{name}" for name in worn.layout.marker_names], hand(100))
    lines = path.read_text().split("\n")
    path.write_text("\n".join([*lines[:-80], *lines[-20:]]))
    told, _ = imported(path, worn)
    assert told["frames"] == 40
    assert told["doubts"] == ["The right hand is tracked in 40.0 % of the frames, in less than 50 %."]


def test_a_right_hand_taken_as_a_left_one_is_said_and_not_kept(tmp_path):
    """Its points have no names, and only a left hand is looked for."""
    path = trc(tmp_path / "right.trc", [f"U{i}" for i in range(19)], hand(200))
    worn = load_profile("han19").with_sides(("left",))
    told, take = imported(path, worn, live_labels=True)
    side, none = told["doubts"]
    assert side.startswith("What is named or taken as the left hand is a right one: RMS")
    assert side.endswith("The hand was not solved. Choose a profile of a right hand.") and none == "No hand was found."
    assert told["frames"] == 200 and verify(take).ok
    with open_take(take) as made:
        assert len(made.raw) == len(made.solved) == 200 and made.counts.tracked["left"] == 0
    told, take = imported(path, worn.with_sides(("right",)), live_labels=True)
    assert told["doubts"] == []
    with open_take(take) as made:
        assert made.counts.tracked["right"] > 150
