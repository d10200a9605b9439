"""A file that is played is recorded whole: every frame, from the first to the last, at its own time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.device_kinds import device_class
from app.file_device import FileDevice
from app.receiver import Receiver
from core.frames import MarkerFrame, RigidBody, Times
from core.profile import load_profile
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.app.command import phalanx
from tests.core.takes.frames import bits, plain_frame
from tests.data import case_path


def frames(n: int, rate_hz: float) -> list[MarkerFrame]:
    """Of a server that was started anew, changed its rate, stood still for a third of a second, and sees a prop."""
    body = RigidBody(3, "Bat", np.array([0.1, 1.0, 0.2]), np.array([0.6, 0.8, 0.0, 0.0]), True, 0.0004)
    made = []
    for i in range(n):
        t = min(i, (n + 2 * i) / 4) / rate_hz + (0.333 if i >= n // 3 else 0.0)
        made.append(
            replace(
                plain_frame(i, n=6),
                sequence=i if i < n // 3 else i - n // 3,
                times=Times(9000.0 + t if i < n // 3 else t, 500.0 + t, 500.003 + t),
                points_m=np.full((6, 3), 0.1) + 0.01 * np.arange(6)[:, None] + 0.0001 * i,
                residuals_m=np.full(6, 0.0002),
                rigid_bodies=(body,),
            )
        )
    return made


@pytest.fixture
def take(tmp_path: Path) -> Path:
    path = tmp_path / "played.mcap"
    writer = TakeWriter(path, TakeInfo("played", rate_hz=120.0), load_profile("han19"))
    for frame in frames(240, 120.0):
        writer.raw("", frame)
    writer.seal(TakeCounts(240, 240))
    return path


def recorded(path: Path, into: Path, *words: object) -> list[MarkerFrame]:
    ran = phalanx("record", "playback", "--file", path, "--out", into, "--json", *words)
    figures = ran.figures
    with open_take(into) as opened:
        got = list(opened.raw)
        assert opened.counts is not None and opened.counts.received == len(got)
    assert (figures["received"], figures["written"], figures["dropped"]) == (len(got), len(got), {})
    assert (figures["lost"], figures["late"], figures["repeated"], figures["rejected"]) == (0, 0, 0, 0)
    return got


def host_s(played: list[MarkerFrame]) -> np.ndarray:
    times = np.array([frame.times.host_s for frame in played])
    return times - times[0]


@pytest.mark.parametrize("speed", [pytest.param(1.0, marks=pytest.mark.long), 4.0])
def test_a_take_that_is_played_and_recorded_again_is_the_same(take: Path, tmp_path: Path, speed: float) -> None:
    got = recorded(take, tmp_path / "again.mcap", "--speed", speed)
    sent = frames(240, 120.0)
    assert len(got) == len(sent)
    for again, frame in zip(got, sent, strict=True):
        assert again.sequence == frame.sequence
        assert again.times.device_s == frame.times.device_s
        assert bits(replace(again, times=frame.times)) == bits(frame)  # points, ids, residuals, rigid bodies
    assert np.abs(host_s(got) - host_s(sent) / speed).max() < 1e-6
    with open_take(take) as before, open_take(tmp_path / "again.mcap") as after:
        assert len(before.holes) == len(after.holes) == 1
        assert after.holes.seconds == pytest.approx(before.holes.seconds / speed, abs=0.01)


def test_the_take_of_the_case_loses_no_frame(tmp_path: Path) -> None:
    path = case_path("files", "13-rate-changes-in-mid-take", "nat_ratechange.mcap")
    got = recorded(path, tmp_path / "again.mcap")
    with open_take(path) as opened:
        sent = list(opened.raw)
    assert [frame.sequence for frame in got] == [frame.sequence for frame in sent]
    assert [frame.times.device_s for frame in got] == [frame.times.device_s for frame in sent]
    assert np.abs(host_s(got) - host_s(sent)).max() < 1e-6


def test_a_table_of_points_loses_no_frame(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    times = np.cumsum(np.r_[0.0, np.full(60, 0.01), 0.4, np.full(60, 0.01)])
    rows = (f"{i + 5},{t:.4f},{k},{0.1 * k},{1 + 0.001 * i},0.2" for i, t in enumerate(times) for k in range(4))
    path.write_text("\n".join(["frame,time_s,id,x_m,y_m,z_m", *rows]) + "\n", encoding="utf-8")
    got = recorded(path, tmp_path / "again.mcap")
    assert [frame.sequence for frame in got] == list(range(5, 127))
    assert [frame.times.device_s for frame in got] == read_recording(path).times_s.tolist()
    assert np.abs(host_s(got) - times).max() < 1e-6


def test_a_held_file_sends_nothing_until_it_is_told(take: Path) -> None:
    got: list[object] = []
    stream = Receiver(1, FileDevice, {"file": str(take), "speed": 20.0}, lambda _, f: got.append(f), lambda *_: None)
    for held in (True, False):
        got.clear()
        stream.connect(held=held)
        stream.wait_connected(10.0)
        if held:
            assert stream.streaming
            assert stream.health().received == 0
            assert stream.describe().rate_hz == 120.0 * 20
            assert not stream.join(0.3)
            assert got == []
            stream.begin()
        assert stream.join(20.0)
        assert stream.finished
        assert len(got) == 240
    stream.connect(held=True)
    stream.wait_connected(10.0)
    stream.disconnect()
    assert stream.join(5.0)


def test_only_files_have_an_end() -> None:
    assert device_class("playback").has_end
    assert not device_class("natnet").has_end
    assert not device_class("demo").has_end
