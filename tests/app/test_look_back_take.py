"""What just happened, saved as a take: from real servers, with the real engine beside, in all that may befall it."""

from __future__ import annotations

import errno
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from app import look_back_take
from app.look_back_solving import solved_beside
from app.session import Session
from app.take_summary import TakeSummary
from core.errors import CancelledError, TakeError
from core.level import Level
from core.profile import load_profile
from core.streams import ClockSample
from core.takes.codec import decode_solved, encode_solved
from core.takes.reader import open_take
from core.takes.reprocess import solve
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from devices.natnet.client import NatNetDevice
from devices.natnet.simulator import NatNetSimulator
from tests.app.command import phalanx
from tests.app.glove import Glove
from tests.app.stage import RATE_HZ, own_threads, performance, server, settings_for, until
from tests.core.takes.frames import bits
from tests.some import some


@pytest.fixture
def session():
    made = Session(load_profile("han19"))
    made.start()
    made.wait_ready()
    yield made
    made.close()
    assert own_threads() == []


def connected(session: Session, simulator: NatNetSimulator):
    receiver = session.add_device(NatNetDevice, settings_for(simulator))
    session.connect(receiver)
    receiver.wait_connected(30)
    until(lambda: receiver.health().received > 0, "the first frame")
    return receiver


def wait_for(session: Session, seconds: float) -> None:
    until(lambda: session.look_back.seconds >= seconds, f"{seconds} s in the ring")


def save(session: Session, path: Path, **words: str) -> TakeSummary:
    return session.save_look_back(path, session.take_info(path.stem, **words)).result(120)


def check_take(summary: TakeSummary) -> None:
    """The file says what the summary says, and both add up."""
    with open_take(summary.path) as take:
        assert take.sealed and take.complete and take.info.looked_back
        assert take.counts.balanced
        if not summary.problem:  # which no file tells
            assert take.verdict == summary.verdict
        for key, stream in some(summary.streams.items()):
            assert stream.balanced and len(take.streams[key].frames) == stream.written
        assert len(take.solved) == summary.solved
        assert summary.duration_s == pytest.approx(take.duration_s, abs=0.5)
    assert verify(summary.path).verdict.whole == summary.verdict.whole


def test_what_two_servers_sent_is_a_take_with_poses_while_another_take_runs(session, tmp_path) -> None:
    with server() as stage, server() as other:
        connected(session, stage)
        connected(session, other)
        session.start_recording(tmp_path / "running.mcap", session.take_info("running"))
        wait_for(session, 2.0)
        asked = datetime.now(UTC)
        past = session.look_back.recent()
        info = session.take_info("before", performer="Ann", shot="clap")
        finished = session.save_look_back(tmp_path / "before.mcap", info, past)
        assert session.recording_name == "running"
        n = sum(len(past.frames(key)) for key in past.streams)
        lines = [note.line for note in session.notifications.history if note.source == "Recorder"]
        assert f"Take before, the last 2 s with {n:,} frames, is written now and solved." in lines
        summary = finished.result(120)
        assert session.recording and session.numbers().recording.received > 0
        running = session.stop_recording().result(60)
    assert running.dropped == {} and running.sealed and not running.problem
    check_take(summary)
    keys = ["natnet-1/markers", "natnet-2/markers"]
    assert list(summary.streams) == keys and summary.solving == keys[0]
    assert summary.verdict.level is Level.GOOD and summary.solved == summary.written > RATE_HZ
    with open_take(summary.path) as take:
        assert (take.info.name, take.info.performer, take.info.shot) == ("before", "Ann", "clap")
        assert take.info.device["title"].startswith("Stage") and take.info.rate_hz == pytest.approx(RATE_HZ)
        ended = take.info.created_utc + timedelta(seconds=take.duration_s)
        assert abs(ended - asked) < timedelta(seconds=5)
        for key in keys:
            sent, written = past.frames(key), list(take.streams[key].frames)
            assert [frame.sequence for frame in written] == [frame.sequence for frame in sent]
            assert [frame.times for frame in written] == [frame.times for frame in sent]
            np.testing.assert_array_equal(
                np.concatenate([f.points_m for f in written]), np.concatenate([f.points_m for f in sent])
            )
            assert len(take.streams[key].clock) == sum(
                one.stream.key == key and isinstance(one.record, ClockSample) for one in past.kept
            )
        solved = solve(past.frames(keys[0]), session.profiles)
        for live, again in zip(take.solved, solved, strict=True):
            told = decode_solved(encode_solved(again))
            for one, two in zip(live.hands, told.hands, strict=True):
                assert one.state is two.state
                np.testing.assert_array_equal(one.theta_rad, two.theta_rad)
                np.testing.assert_array_equal(one.point, two.point)
    assert take.counts.tracked == summary.tracked and min(summary.tracked.values()) > 0
    told = phalanx("info", str(summary.path), "--json")
    assert told.code == 0 and "Looked back" in told.out and '"looked_back": true' in told.out
    assert "Looked back" not in phalanx("info", str(running.path)).out


def test_frames_that_a_server_lost_are_counted_and_said(session, tmp_path) -> None:
    """Every sixtieth number is left out."""
    spotty = [frame for frame in performance() if frame.sequence % 60 != 30]
    with closing(NatNetSimulator(spotty, RATE_HZ, command_port=0, data_port=0, loop=True, name="Stage")) as stage:
        stage.start()
        receiver = connected(session, stage)
        wait_for(session, 2.5)
        summary = save(session, tmp_path / "spotty.mcap")
        assert receiver.health().lost >= summary.lost
    check_take(summary)
    with open_take(summary.path) as take:
        lost = int(np.sum(np.diff([frame.sequence for frame in take.raw]) - 1))
    assert summary.lost == lost >= 3
    assert not summary.verdict.whole and f"{lost:,} never arrived" in summary.verdict.headline


def test_what_came_before_a_server_went_away_can_be_saved_long_after(session, tmp_path) -> None:
    with server() as stage:
        receiver = connected(session, stage)
        wait_for(session, 1.0)
    until(lambda: session.look_back.silent_s > 2.0, "silence")
    session.disconnect(receiver)
    receiver.join(30)
    session.remove_device(receiver)
    sent = session.look_back.recent().frames("natnet-1/markers")
    summary = save(session, tmp_path / "before.mcap")
    check_take(summary)
    assert summary.verdict.level is Level.GOOD and summary.received == len(sent) == summary.solved
    with open_take(summary.path) as take:
        ended = take.info.created_utc + timedelta(seconds=take.duration_s)
        assert timedelta(seconds=1.5) < datetime.now(UTC) - ended
        assert take.info.device["kind"] == "natnet" and take.info.device["title"].startswith("Stage")


def test_with_nothing_there_or_no_place_for_it_one_error_says_so_and_no_file_is_left(session, tmp_path) -> None:
    with pytest.raises(TakeError, match="Nothing has come from a device yet"):
        save(session, tmp_path / "nothing.mcap")
    with server() as stage:
        connected(session, stage)
        wait_for(session, 0.3)
        (tmp_path / "file").write_text("no folder")
        with pytest.raises(TakeError, match="cannot be"):
            save(session, tmp_path / "file" / "before.mcap")
        (tmp_path / "taken.mcap").write_text("a take")
        with pytest.raises(TakeError, match="never overwritten"):
            save(session, tmp_path / "taken.mcap")
        session._reserve = 1 << 60
        with pytest.raises(TakeError, match="free"):
            save(session, tmp_path / "full.mcap")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "taken.mcap"]
    assert session.numbers().sealing == () and session.unsealed == ()


def test_solving_that_is_cancelled_leaves_every_frame(session, tmp_path) -> None:
    with server() as stage:
        connected(session, stage)
        wait_for(session, 1.0)
        finished = session.save_look_back(tmp_path / "raw.mcap", session.take_info("raw"))
        session.save_look_back(tmp_path / "next.mcap", session.take_info("next"))
        said = session.notifications.history[-1]
        assert said.source == "Recorder" and said.line.endswith("is written now, and solved after raw.")
        sealing, _ = session.numbers().sealing
        assert sealing.solving and sealing.doing == "Solving" and sealing.name == "raw"
        assert [path.name for path in session.unsealed] == ["raw.mcap", "next.mcap"]
        until(lambda: (n := session.numbers().sealing[0]).written == n.received, "all frames on the disk")
        with open_take(tmp_path / "raw.mcap") as take:  # as if the machine went down now
            assert not take.sealed and take.info.looked_back and len(take.raw) == sealing.received
        session.solve_no_more()
        summary = finished.result(60)
    check_take(summary)
    assert summary.written == summary.received > 0
    assert summary.unsolved == {look_back_take.CANCELLED: summary.received - summary.solved}
    assert summary.verdict.level is Level.WARNING and summary.verdict.whole
    assert "Solve it again in review" in summary.verdict.texts[0]


def test_a_session_that_is_closed_meanwhile_waits_for_the_frames_and_not_for_the_poses(tmp_path) -> None:
    session = Session(load_profile("han19"))
    session.start()
    session.wait_ready()
    with server() as stage:
        connected(session, stage)
        wait_for(session, 1.0)
        begun, sealed = [], []
        session.on_begun, session.on_sealed = begun.append, sealed.append
        finished = session.save_look_back(tmp_path / "last.mcap", session.take_info("last"))
        session.close()
        assert finished.done()
    check_take(finished.result())
    assert begun == sealed == [tmp_path / "last.mcap"] and own_threads() == []
    with pytest.raises(TakeError, match="being closed"):
        save(session, tmp_path / "later.mcap")


def test_an_engine_that_cannot_begin_costs_no_frame_and_is_told(session, tmp_path, monkeypatch) -> None:
    """The network that the profile names has gone since it was loaded."""
    with server() as stage:
        connected(session, stage)
        wait_for(session, 0.5)
        other = load_profile("han19")
        object.__setattr__(other, "network", str(tmp_path / "gone.onnx"))
        session._profiles = (other,)
        summary = save(session, tmp_path / "raw.mcap")
    check_take(summary)
    assert summary.unsolved == {look_back_take.BROKE_DOWN: summary.received}
    assert any("gone.onnx" in note.line for note in session.notifications.history)


def test_a_glove_alone_is_saved_and_there_is_nothing_to_solve(session, tmp_path) -> None:
    receiver = session.add_device(Glove)
    session.connect(receiver)
    wait_for(session, 1.0)
    past = session.look_back.recent()
    summary = session.save_look_back(tmp_path / "glove.mcap", session.take_info("glove"), past).result(60)
    session.disconnect(receiver)
    check_take(summary)
    assert summary.solving is None and summary.solved == 0 and summary.verdict.level is Level.GOOD
    with open_take(summary.path) as take:
        (stream,) = take.streams.values()
        assert [bits(frame) for frame in stream.frames] == [bits(frame) for frame in past.frames("glove-1/right")]
        assert len(stream.clock) == sum(isinstance(one.record, ClockSample) for one in past.kept) > 0


def test_a_device_that_was_connected_and_sent_nothing_is_in_it_with_a_hole_as_long_as_the_take(
    session, tmp_path
) -> None:
    with server() as stage:
        glove = session.add_device(Glove)
        glove.device.silent = True
        session.connect(glove)
        glove.wait_connected(30)
        connected(session, stage)
        wait_for(session, 1.0)
        summary = save(session, tmp_path / "before.mcap")
    check_take(summary)
    assert list(summary.streams) == ["natnet-1/markers", "glove-1/right"] and summary.solving == "natnet-1/markers"
    hole = summary.streams["glove-1/right"].holes
    assert summary.streams["glove-1/right"].received == 0 and hole.seconds == pytest.approx(summary.duration_s, abs=0.1)
    assert summary.verdict.level is Level.PROBLEM and "glove-1/right" in " ".join(summary.verdict.texts)
    assert summary.solved == summary.streams["natnet-1/markers"].written
    with open_take(summary.path) as take:
        assert "Test glove" in take.info.device.values()


@pytest.mark.long
def test_several_are_solved_in_turn_and_each_is_whole(session, tmp_path) -> None:
    with server() as stage:
        connected(session, stage)
        wait_for(session, 0.5)
        paths = [tmp_path / f"{n}.mcap" for n in range(2)]
        asked = [session.save_look_back(path, session.take_info(path.stem)) for path in paths]
        taken = [one.result(120) for one in asked]
    for summary in some(taken):
        check_take(summary)
        assert summary.solved == summary.received
    assert taken[1].received >= taken[0].received


def test_a_disk_that_is_full_meanwhile_is_one_error_and_all_is_counted(session, tmp_path, monkeypatch) -> None:
    with server() as stage:
        connected(session, stage)
        wait_for(session, 1.0)
        limit, raw = 40, TakeWriter.raw

        def fills(self, stream, record):
            if self.acknowledged >= limit:
                raise OSError(errno.ENOSPC, "No space left on device")
            raw(self, stream, record)

        monkeypatch.setattr(TakeWriter, "raw", fills)
        summary = save(session, tmp_path / "full.mcap")
    check_take(summary)
    assert summary.written == limit and summary.dropped == {"disk error": summary.received - limit}
    assert "No space left" in summary.problem and summary.verdict.level is Level.PROBLEM
    assert sum("No space left" in note.line for note in session.notifications.history) >= 1


def test_poses_beside_are_cancelled_at_any_moment() -> None:
    stop_after = 70
    poses = []
    with pytest.raises(CancelledError):
        for pose in solved_beside(performance()[:200], (load_profile("han19"),), lambda: len(poses) >= stop_after):
            poses.append(pose)
    assert stop_after <= len(poses) < 200
    with pytest.raises(CancelledError):
        list(solved_beside(performance()[:5], (load_profile("han19"),), lambda: True))
    assert list(solved_beside([], (load_profile("han19"),), lambda: False)) == []
