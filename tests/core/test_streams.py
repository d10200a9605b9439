"""What a device says of its streams, and frames whose newer fields nobody gave."""

from __future__ import annotations

import numpy as np

from core.frames import BONE_STATES, InertialFrame, MarkerFrame, Times, TrackedFrame
from core.printable import MOST_OF_NAME
from core.streams import ClockSample, Sample, StreamInfo

TIMES = Times(1.0, 2.0, 3.0)


def test_what_a_device_calls_things_can_be_printed_and_is_the_same_again() -> None:
    info = StreamInfo("a\x1b[2J", "x\n", "T\t" * 200, "inertial", bone_names=("Hand\u202e", "手"), axes="Z\x00up")
    assert (info.key, info.kind, info.bone_names, info.axes) == ("a\\x1b[2J", "x\\n", ("Hand\\u202e", "手"), "Z\\x00up")
    assert len(info.title) <= MOST_OF_NAME
    again = StreamInfo(info.key, info.kind, info.title, "inertial", bone_names=info.bone_names, axes=info.axes)
    assert (again.key, again.title, again.bone_names, again.axes) == (info.key, info.title, info.bone_names, info.axes)


def test_what_nobody_gave_of_a_glove_is_unknown_of_every_bone() -> None:
    plain = InertialFrame(1, TIMES, ("a", "b", "c"), np.zeros((3, 4)))
    for given in (plain.positions_m, plain.angular_radps, plain.acceleration_mps2):
        assert given.shape == (3, 3) and np.isnan(given).all()
    assert plain.side is None and plain.state.dtype == np.int8 and plain.state.tolist() == [0, 0, 0]
    assert BONE_STATES[0] == ""
    given = InertialFrame(1, TIMES, ("a",), np.zeros((1, 4)), "left", np.ones((1, 3)), state=np.array([3], np.int8))
    assert (given.side, given.positions_m.tolist(), given.state.tolist()) == ("left", [[1.0, 1.0, 1.0]], [3])
    assert np.isnan(given.angular_radps).all()


def test_frames_that_are_made_as_before_say_nothing_new() -> None:
    raw = MarkerFrame(1, TIMES, np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0))
    solved = TrackedFrame(1, TIMES, ())
    assert raw.timecode == "" and solved.of == () and np.isnan(solved.at_host_s)
    assert Sample("natnet-1/markers", raw).frame is raw
    assert Sample("natnet-1/markers", ClockSample(1.0, 2.0, 1e-4)) == ("natnet-1/markers", ClockSample(1.0, 2.0, 1e-4))
