"""Given names that were not borne out: by label, of hands that are tracked."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.left_out import LeftOutTally
from app.tracking_figures import figures
from core.frames import HandState
from core.recording import Recording
from tests.app.hand_frames import hand_frame, profile, sample

NAMES = profile().layout.marker_names
GIVEN = {200 + k: ("right", k) for k in range(len(NAMES))}


def recorded(n: int) -> Recording:
    """The markers of a right hand, the last of the layout first, and a point that is none of them."""
    labels = ("Wand", *(f"R_{name}" for name in reversed(NAMES)))
    ids = np.array([7, *reversed(GIVEN)])
    return Recording("x", 100.0, np.arange(n) / 100.0, np.arange(n), np.zeros((n, len(labels), 3)), labels, ids)


def test_points_are_counted_by_label_in_the_order_of_the_file_where_their_hand_is_tracked():
    recording = recorded(4)
    solved = [
        sample(hand_frame("right", hidden=(2,)))[1],
        sample(hand_frame("right", hidden=(2, 5)))[1],
        sample(hand_frame("right", state=HandState.LOST, hidden=tuple(range(19))))[1],
        sample(hand_frame("left", hidden=(3,)))[1],
    ]
    sent = [recording.ids, recording.ids[recording.ids != 202], recording.ids, recording.ids]
    tally = LeftOutTally(recording, GIVEN)
    for ids, frame in zip(sent, solved, strict=True):
        tally.add(ids, frame)
    expected = {f"R_{NAMES[5]}": 1, f"R_{NAMES[2]}": 1}  # in the second frame there is no point that 2 could be
    assert list(tally.counts.items()) == list(expected.items())
    columns = [np.flatnonzero(np.isin(recording.ids, ids)) for ids in sent]
    found = figures(Path("x.trc"), recording, profile(), solved, columns, GIVEN)
    assert found.labels_left_out == expected
