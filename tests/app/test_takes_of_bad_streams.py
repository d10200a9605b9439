"""Takes of streams that begin anew, and of networks that overtake: what is missing is said, what is there is kept."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.session import Session
from app.take_summary import TakeSummary
from core.frames import MarkerFrame, TrackedFrame
from core.profile import load_profile
from core.takes.reader import open_take
from core.takes.take import TakeInfo
from core.takes.verify import verify
from devices.natnet.client import NatNetDevice
from devices.natnet.simulator import NatNetSimulator
from tests.app.stage import settings_for, until
from tests.devices.natnet.streams import make_frames


class NoEngine:
    """Sees no hands, at once."""

    def __init__(self, profiles: object) -> None:
        pass

    def step(self, frame: MarkerFrame) -> TrackedFrame:
        return TrackedFrame(frame.sequence, frame.times, ())

    def reset(self) -> None:
        pass

    search = change = skip = lambda self, what: None


def recorded(numbers: list[int], path: Path, bitstream: tuple[int, int] = (3, 1)) -> TakeSummary:
    """The take of a server that sends frames of these numbers; all that it sends is recorded but the first."""
    made = make_frames(len(numbers) + 1, points=3)
    frames = [replace(frame, sequence=number) for frame, number in zip(made, [numbers[0], *numbers], strict=True)]
    with NatNetSimulator(frames, 240.0, command_port=0, data_port=0, bitstream=bitstream) as server:
        session = Session(load_profile("han19"), engine=NoEngine, warm_up=lambda: None)
        try:
            session.start()
            session.wait_ready()
            stream = session.add_device(NatNetDevice, settings_for(server))
            session.connect(stream)
            stream.wait_connected(30)
            session.start_recording(path, TakeInfo(path.stem, rate_hz=240.0))
            server.start()
            until(lambda: server.finished, "the last frame")
            until(lambda: stream.health().rate_hz == 0, "silence")
            health = stream.health()
            summary = session.stop_recording().result(60)
        finally:
            session.close()
    assert (summary.lost, summary.late, summary.repeated) == (health.lost, health.late, health.repeated)
    return summary


@pytest.mark.parametrize("loop", [24, 120, 240])
def test_a_loop_is_recorded_whole(tmp_path, loop):
    numbers = [k % loop for k in range(1, 600)]
    summary = recorded(numbers, tmp_path / "loop.mcap")
    assert summary.received == summary.written >= 599  # the first was sent twice
    assert (summary.lost, summary.late) == (0, 0)
    with open_take(summary.path) as take:
        assert [frame.sequence for frame in take.raw][-599:] == numbers
        steps = np.diff([frame.times.host_s for frame in take.raw])
        assert np.all(steps >= 0)
    assert verify(summary.path).ok


def test_what_came_late_is_in_the_totals_and_the_take_is_not_whole(tmp_path):
    numbers = list(range(1, 400))
    for k in range(20, 380, 40):
        numbers[k], numbers[k + 1] = numbers[k + 1], numbers[k]
    # Of this version the server stamps frames by their numbers; so a network would swap them.
    summary = recorded(numbers, tmp_path / "late.mcap", (2, 9))
    assert (summary.lost, summary.late, summary.repeated) == (9, 9, 1)
    assert summary.received + summary.lost == 399
    assert not summary.verdict.whole
    assert "lost before this machine: 9 (9 of them came too late); came twice: 1;" in summary.line
    with open_take(summary.path) as take:
        sequences = [frame.sequence for frame in take.raw]
        assert sequences == sorted(set(sequences))
        assert take.counts is not None
        assert take.counts.lost == 9 == int((np.diff(sequences) - 1).sum())
