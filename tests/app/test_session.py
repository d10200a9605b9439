"""The session on real sockets, the real client, the real engine and real takes."""

from __future__ import annotations

import shutil
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from app.left_behind.run_file import RunFile, recorded_now
from app.live_numbers import SKIPPED
from app.notifications import NotificationCentre, Severity
from app.session import Session
from app.take_summary import TakeSummary
from core.engine import Engine
from core.errors import DeviceError, PhalanxError, TakeError
from core.frames import HandState, MarkerFrame, TrackedFrame
from core.profile import Profile, load_profile
from core.takes.disk import RESERVE
from core.takes.reader import open_take
from core.takes.take import TakeInfo
from devices.device import Level
from devices.natnet.client import NatNetDevice
from tests.app.stage import own_threads, server, settings_for, until


class SlowEngine(Engine):
    """Takes its time, as on a machine that is too small."""

    def step(self, frame: MarkerFrame) -> TrackedFrame:
        time.sleep(0.05)
        return super().step(frame)


class BrittleEngine(Engine):
    """Fails at every tenth frame."""

    def step(self, frame: MarkerFrame) -> TrackedFrame:
        if frame.sequence % 10 == 0:
            raise ValueError("a fault of the engine")
        return super().step(frame)


@pytest.fixture
def stage():
    with server() as simulator:
        yield simulator


def make_session(**options: object) -> Session:
    session = Session(load_profile("han19"), **options)  # type: ignore[arg-type]
    session.start()
    session.wait_ready()
    return session


@pytest.fixture
def session():
    made = make_session()
    yield made
    made.close()
    assert own_threads() == []


def connected(session: Session, simulator) -> None:
    stream = session.add_device(NatNetDevice, settings_for(simulator))
    session.connect(stream)
    stream.wait_connected(30)
    until(lambda: stream.health().received > 0, "the first frame")


def record(session: Session, path: Path, frames: int) -> TakeSummary:
    session.start_recording(path, TakeInfo(path.stem))
    until(lambda: session.numbers().recording.received >= frames, "frames")
    return session.stop_recording().result(60)


def check_take(summary: TakeSummary) -> None:
    """The invariants that hold for every take, whatever happened."""
    assert summary.received == summary.written + sum(summary.dropped.values())
    assert summary.received == summary.solved + sum(summary.unsolved.values())
    with open_take(summary.path) as take:
        assert take.sealed and not take.damage
        assert take.counts is not None and take.counts.balanced
        assert (take.counts.received, take.counts.written) == (summary.received, summary.written)
        assert len(take.raw) == summary.written
        assert len(take.solved) == summary.solved
        raw = [frame.sequence for frame in take.raw]
        solved = [frame.sequence for frame in take.solved]
        assert raw == sorted(set(raw))
        assert solved == sorted(set(solved)) and set(solved) <= set(raw)


def test_frames_arrive_are_solved_and_are_written_in_order(session, stage, tmp_path):
    connected(session, stage)
    until(lambda: (frame := session.latest.peek()) and all(h.state is HandState.TRACKED for h in frame.solved.hands))
    frame = session.latest.peek()
    assert frame.raw.sequence == frame.solved.sequence
    summary = record(session, tmp_path / "a.mcap", 200)
    check_take(summary)
    assert summary.verdict.whole and summary.written >= 200 and set(summary.unsolved) <= {SKIPPED}
    with open_take(summary.path) as take:
        assert np.all(np.diff([frame.sequence for frame in take.raw]) == 1)
        solved = [frame.sequence for frame in take.solved]
        assert summary.unsolved or solved == [frame.sequence for frame in take.raw]


def test_look_ahead_delays_what_is_shown_and_not_what_is_recorded(session, stage, tmp_path):
    shown: list = []
    put = session.latest.put
    session.latest.put = lambda frame: (shown.append(frame), put(frame))
    session.set_look_ahead(0.1)
    connected(session, stage)
    until(lambda: len(shown) > 60 and session.numbers().solver.rate_hz > 0)
    assert session.numbers().solver.latency_s >= 0.1 and session.numbers().solver.look_ahead_s == 0.1
    first = len(shown)
    summary = record(session, tmp_path / "a.mcap", 240)
    check_take(summary)
    last = summary.received
    until(lambda: len(shown) > first + last + 60)
    with open_take(summary.path) as take:
        engine = {frame.sequence: frame for frame in take.solved}
    by_number = {frame.raw.sequence: frame for frame in shown}
    changed = 0
    for number, solved in engine.items():
        live = by_number[number]
        assert live.raw.sequence == live.solved.sequence and live.solved.times == live.raw.times
        for a, b in zip(solved.hands, live.solved.hands, strict=True):
            np.testing.assert_array_equal(a.point, b.point)
            np.testing.assert_array_equal(a.markers_world_m[a.observed], b.markers_world_m[b.observed])
            changed += not np.array_equal(a.theta_rad, b.theta_rad)
    assert changed > 0  # gaps were filled on the screen, and left in the take
    sequence = [frame.raw.sequence for frame in shown]
    assert sequence == sorted(sequence)


def test_numbers_of_a_live_session(session, stage, tmp_path):
    connected(session, stage)
    until(lambda: session.numbers().solver.solved > 100)
    numbers = session.numbers()
    assert numbers.ready and numbers.recording is None
    assert numbers.solver.rate_hz > 0 and numbers.solver.latency_s > 0 and numbers.solver.step_s > 0
    assert set(numbers.solver.stage_s) == {"label", "solve", "validate", "find", "smooth"}
    trail = session.trail.view(10.0)
    assert len(trail.times_s) > 50 and np.all(np.diff(trail.times_s) > 0)
    session.start_recording(tmp_path / "a.mcap", TakeInfo("a"))
    until(lambda: session.numbers().recording.seconds_left < float("inf"), "an estimate of the disk")
    recording = session.numbers().recording
    assert recording.bytes_written > 0 and recording.bytes_per_s > 0 and recording.disk_free > 0


def test_many_takes_one_after_another(session, stage, tmp_path):
    connected(session, stage)
    futures = []
    for i in range(8):
        session.start_recording(tmp_path / f"{i}.mcap", TakeInfo(str(i)))
        until(lambda: session.numbers().recording.received >= 10)
        futures.append(session.stop_recording())
    taken: list[int] = []
    for future in futures:
        summary = future.result(60)
        check_take(summary)
        assert summary.verdict.whole and set(summary.unsolved) <= {SKIPPED}
        with open_take(summary.path) as take:
            taken += [frame.sequence for frame in take.raw]
    assert taken == sorted(set(taken))


def test_marks_lie_within_the_take(session, stage, tmp_path):
    connected(session, stage)
    session.start_recording(tmp_path / "a.mcap", TakeInfo("a"))
    until(lambda: session.numbers().recording.received >= 30)
    session.mark("first")
    until(lambda: session.numbers().recording.received >= 60)
    session.mark("second")
    until(lambda: session.numbers().recording.received >= 90)
    summary = session.stop_recording().result(60)
    with open_take(summary.path) as take:
        assert [mark.text for mark in take.marks] == ["first", "second"]
        assert 0 < take.marks[0].time_s < take.marks[1].time_s < take.duration_s


def test_server_gone_and_back_in_mid_recording(session, tmp_path):
    with server() as first:
        connected(session, first)
        ports = first.command_port, first.data_port
        session.start_recording(tmp_path / "a.mcap", TakeInfo("a"))
        until(lambda: session.numbers().recording.received >= 60)
    stream = session.receivers[0]
    until(lambda: stream.health().level is Level.PROBLEM, "the light to turn red")
    assert stream.health().reason and session.recording
    before = session.numbers().recording.received
    with server(*ports):
        until(lambda: session.numbers().recording.received >= before + 60, "frames after the server came back")
        until(lambda: stream.health().level is Level.GOOD, "the light to turn green")
        summary = session.stop_recording().result(60)
    assert summary.received == summary.written and summary.sealed and summary.written >= before + 60
    assert summary.solved + sum(summary.unsolved.values()) == summary.written


def test_disk_error_in_mid_recording_ends_the_take_and_not_the_session(session, stage, tmp_path):
    resource = pytest.importorskip("resource")
    connected(session, stage)
    finished: list[TakeSummary] = []
    session.on_take = finished.append
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    session.start_recording(tmp_path / "a.mcap", TakeInfo("a"))
    until(lambda: session.numbers().recording.received >= 30)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, ((tmp_path / "a.mcap").stat().st_size + 50_000, hard))
        until(lambda: not session.recording, "the recording to end by itself")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    until(lambda: finished, "the summary")
    summary = finished[0]
    assert summary.problem and summary.written >= 30
    assert summary.received == summary.written + sum(summary.dropped.values())
    assert {*summary.dropped, *summary.unsolved} >= {"disk error"}  # whichever record was the first that did not fit
    assert set(summary.dropped) <= {"disk error"}
    with open_take(summary.path) as take:
        assert len(take.raw) == summary.written
    assert any(note.severity is Severity.PROBLEM and "a.mcap" in note.text for note in session.notifications.history)
    check_take(record(session, tmp_path / "b.mcap", 30))


@pytest.mark.parametrize("befall", ["moved", "deleted"])
def test_a_take_that_goes_on_elsewhere_is_known_to_the_next_start_by_that_name_alone(
    session, stage, tmp_path, monkeypatch, befall
):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    path, now = tmp_path / "a.mcap", tmp_path / ("elsewhere.mcap" if befall == "moved" else "a_rescued.mcap")
    with RunFile("phalanx record") as file:
        file.follow(session)
        connected(session, stage)
        session.start_recording(path, TakeInfo("a"))
        until(lambda: session.numbers().recording.received >= 10, "frames")
        assert recorded_now() == {path}
        if befall == "moved":
            path.rename(now)
        else:
            path.unlink()
        until(lambda: recorded_now() != {path}, "the other name")
        assert recorded_now() == {now}
        summary = session.stop_recording().result(60)
        session.seal(60)
        assert summary.sealed and summary.path == now and recorded_now() == set()
        with session._intake:  # no frame comes
            session.start_recording(path, TakeInfo("none"))
            session.discard_recording().result(60)
        session.seal(60)
        assert not path.exists() and recorded_now() == set()


def test_a_disk_that_fills_ends_the_take_while_there_is_room_to_seal_it(session, stage, tmp_path, monkeypatch):
    room = shutil.disk_usage(tmp_path)._replace(free=RESERVE + 400_000)
    monkeypatch.setattr("app.disk_room.shutil.disk_usage", lambda folder: room)
    connected(session, stage)
    summaries = []
    session.on_take = summaries.append
    session.start_recording(tmp_path / "filling.mcap", TakeInfo("filling"))
    until(lambda: summaries, "the end of the take")
    summary = summaries[0]
    assert summary.sealed and summary.received == summary.written > 0
    told = [note.text for note in session.notifications.history]
    assert sum("nearly full" in text for text in told) == 1
    assert sum("more of recording" in text for text in told) <= 1


def test_a_full_disk_is_told_before_the_take_begins(stage, tmp_path):
    session = make_session(disk_reserve_bytes=1 << 60)
    try:
        connected(session, stage)
        with pytest.raises(TakeError, match="GB are free"):
            session.start_recording(tmp_path / "a.mcap", TakeInfo("a"))
        assert not session.recording and not (tmp_path / "a.mcap").exists()
    finally:
        session.close()


def test_a_slow_engine_drops_poses_and_no_raw_frame(stage, tmp_path):
    session = make_session(engine=SlowEngine, engine_queue_frames=8)
    try:
        connected(session, stage)
        summary = record(session, tmp_path / "a.mcap", 120)
        check_take(summary)
        assert summary.received == summary.written and not summary.dropped
        assert summary.unsolved[SKIPPED] > 0
        assert session.numbers().solver.dropped[SKIPPED] >= summary.unsolved[SKIPPED]
    finally:
        session.close()


def test_faults_of_the_engine_never_stop_a_recording(stage, tmp_path):
    session = make_session(engine=BrittleEngine)
    try:
        connected(session, stage)
        summary = record(session, tmp_path / "a.mcap", 100)
        check_take(summary)
        with open_take(summary.path) as take:
            faults = sum(frame.sequence % 10 == 0 for frame in take.raw)
        skipped = summary.unsolved.pop(SKIPPED, 0)  # on a machine that is busy
        assert summary.unsolved.keys() == {"solver error"}
        assert faults - skipped <= summary.unsolved["solver error"] <= faults and faults >= 9
        told = [note for note in session.notifications.history if "a fault of the engine" in note.text]
        assert len(told) == 1 and told[0].count >= summary.unsolved["solver error"] and "ValueError" in told[0].details
    finally:
        session.close()


def test_closing_while_recording_saves_the_take(stage, tmp_path):
    session = make_session()
    connected(session, stage)
    finished: list[TakeSummary] = []
    session.on_take = finished.append
    session.start_recording(tmp_path / "a.mcap", TakeInfo("a"))
    until(lambda: session.numbers().recording.received >= 30)
    session.close()
    assert own_threads() == []
    check_take(finished[0])


def test_what_cannot_be_recorded_is_refused_with_the_reason(session, stage, tmp_path):
    with pytest.raises(TakeError, match="No device"):
        session.start_recording(tmp_path / "a.mcap", TakeInfo("a"))
    with pytest.raises(TakeError, match="No take"):
        session.stop_recording()
    with pytest.raises(TakeError, match="mark"):
        session.mark()
    connected(session, stage)
    (tmp_path / "there.mcap").write_bytes(b"x")
    with pytest.raises(TakeError, match="exists already"):
        session.start_recording(tmp_path / "there.mcap", TakeInfo("there"))
    assert (tmp_path / "there.mcap").read_bytes() == b"x"
    session.start_recording(tmp_path / "a.mcap", TakeInfo("a"))
    with pytest.raises(TakeError, match="still being recorded"):
        session.start_recording(tmp_path / "b.mcap", TakeInfo("b"))
    with pytest.raises(DeviceError, match="while a take is recorded"):
        session.disconnect(session.receivers[0])
    with pytest.raises(PhalanxError, match="locked"):
        session.set_profile(load_profile("qualisys13"))
    session.stop_recording().result(60)


def test_recording_waits_for_the_solver(stage, tmp_path):
    go = threading.Event()
    session = Session(load_profile("han19"), warm_up=lambda: go.wait(60))
    session.start()
    try:
        connected(session, stage)
        with pytest.raises(TakeError, match="Preparing"):
            session.start_recording(tmp_path / "a.mcap", TakeInfo("a"))
        until(lambda: session.latest.peek() is not None, "points on the screen meanwhile")
        go.set()
        session.wait_ready()
        check_take(record(session, tmp_path / "a.mcap", 20))
    finally:
        go.set()
        session.close()


def test_an_unreachable_server_is_one_clear_message(session):
    with server() as gone:
        settings = settings_for(gone)
    stream = session.add_device(NatNetDevice, settings)
    session.connect(stream)
    until(lambda: stream.health().level is Level.PROBLEM, "the light to turn red")
    assert stream.health().reason
    session.disconnect(stream)
    assert stream.join(30)


def test_wrong_settings_are_refused_and_the_old_ones_stay(session):
    stream = session.add_device(NatNetDevice, {})
    before = stream.settings
    with pytest.raises(DeviceError):
        stream.configure({"command_port": 0})
    with pytest.raises(DeviceError):
        session.add_device(NatNetDevice, {"nonsense": 1})
    assert stream.settings == before and session.receivers == [stream]


def test_profile_and_search_take_effect_between_frames(session, stage):
    connected(session, stage)
    until(lambda: session.numbers().solver.solved > 20)
    changed: Profile = load_profile("qualisys13")
    session.set_profile(changed)
    until(lambda: (frame := session.latest.peek()) and frame.solved.hands and len(frame.solved.hands[0].point) == 13)
    session.set_profile(load_profile("han19"))
    until(
        lambda: (
            (frame := session.latest.peek())
            and len(frame.solved.hands) == 2
            and all(hand.state is HandState.TRACKED for hand in frame.solved.hands)
        )
    )
    session.search_again()
    assert session.profile.layout.name == "han19"


def test_the_same_message_is_told_once_and_counted():
    centre = NotificationCentre()
    heard = []
    centre.subscribe(heard.append)
    for _ in range(100):
        centre.error(ValueError("again"), "Solver", "Solving a frame")
    assert len(centre.history) == 1 and centre.history[0].count == 100
    assert {note.number for note in heard} == {1}
    assert "Traceback" in centre.history[0].details or "ValueError" in centre.history[0].details
