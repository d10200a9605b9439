"""The built-in performer: its own process, the real wire, the real client; and a window that cannot draw."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from app import demo
from app.demo import DemoDevice
from app.props.offered import props_of
from app.props.picking import with_props
from app.session import Session
from core.errors import DeviceError
from core.frames import HandState
from core.profile import load_profile
from devices.device import Level
from tests.app.stage import own_threads, until
from tests.data import ROOT


@pytest.fixture
def session():
    made = Session(load_profile("han19"))
    made.start()
    made.wait_ready()
    yield made
    made.close()
    assert own_threads() == []


def test_its_process_ends_quietly_where_the_command_has_ended_while_it_started():
    """A traceback would end it with status 1."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    server = context.Process(target=demo._serve, args=(json.dumps(DemoDevice().settings), theirs))
    server.start()
    theirs.close()
    ours.close()
    server.join(60)
    assert server.exitcode == 0


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_the_performer_is_tracked_and_its_process_ends_with_the_connection(session):
    stream = session.add_device(DemoDevice, {"rate_hz": 100.0})
    session.connect(stream)
    stream.wait_connected(60)
    pid = stream.device.server_pid
    assert pid != os.getpid() and alive(pid)
    until(
        lambda: (
            (frame := session.latest.peek())
            and len(frame.solved.hands) == 2
            and all(hand.state is HandState.TRACKED for hand in frame.solved.hands)
        ),
        "both hands",
    )
    assert stream.describe().rate_hz == 100.0 and stream.health().level is Level.GOOD
    session.disconnect(stream)
    assert stream.join(30)
    until(lambda: not alive(pid), "the process to end")
    assert stream.health().level is Level.IDLE


def test_what_the_performer_handles_is_told_and_tracked(session):
    stream = session.add_device(DemoDevice, {})
    session.connect(stream)
    stream.wait_connected(60)
    props = props_of(stream.device.offers())
    assert len(props) == 3 and all(len(prop.markers_m) == 5 for prop in props)
    session.set_profile(with_props(session.profile, props))

    def tracked():
        frame = session.latest.peek()
        return frame is not None and [prop.rms_m < 2e-4 for prop in frame.solved.props if prop.tracked] == [True] * 3

    until(tracked, "three things")


def test_a_performer_that_was_killed_is_told_and_can_be_connected_again(session):
    stream = session.add_device(DemoDevice, {})
    session.connect(stream)
    stream.wait_connected(60)
    until(lambda: stream.health().received > 0)
    os.kill(stream.device.server_pid, signal.SIGTERM)
    until(lambda: stream.health().level is Level.PROBLEM and "has ended" in stream.health().reason, "red")
    session.disconnect(stream)
    assert stream.join(30)
    session.connect(stream)
    stream.wait_connected(60)
    until(lambda: stream.health().level is Level.GOOD, "green")


def test_a_performer_that_is_silent_is_told_in_words_of_its_own(session):
    stream = session.add_device(DemoDevice, {})
    session.connect(stream)
    stream.wait_connected(60)
    until(lambda: stream.health().level is Level.GOOD, "green")
    pid = stream.device.server_pid
    os.kill(pid, signal.SIGSTOP)
    try:
        until(lambda: stream.health().level is Level.PROBLEM, "red")
        assert "no longer answers" in stream.health().reason and "Motive" not in stream.health().reason
    finally:
        os.kill(pid, signal.SIGCONT)
    until(lambda: stream.health().level is Level.GOOD, "green again")


def test_a_layout_that_does_not_exist_is_refused():
    with pytest.raises(DeviceError, match="layout"):
        DemoDevice(layout="none")


def test_the_window_works_where_nothing_can_be_drawn(tmp_path: Path):
    """Qt's offscreen platform has no OpenGL: no 3D view, and everything else."""
    command = [sys.executable, "-m", "app", "demo", "--tour", "--seconds", "1", "--out", str(tmp_path), "--json"]
    done = subprocess.run(
        command,
        cwd=ROOT,
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout.splitlines()[-1])
    assert figures["received"] == figures["written"] > 0 and not figures["dropped"]
    assert all(Path(path).stat().st_size > 0 for path in figures["exports"] + figures["pictures"])


def test_a_performer_without_frames_is_waited_for_with_the_solver(session):
    """At the first start its frames come when the solver is prepared: to connect it again would help nobody."""
    stream = session.add_device(DemoDevice, {})
    session.connect(stream)
    stream.wait_connected(60)
    os.kill(stream.device.server_pid, signal.SIGSTOP)
    try:
        until(lambda: "sends no frames" in stream.health().reason, "words")
        assert "Wait until the solver is ready" in stream.health().reason
    finally:
        os.kill(stream.device.server_pid, signal.SIGCONT)
