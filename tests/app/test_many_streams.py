"""A session of several devices on real sockets: each stream by itself, one of them solved, all of them in the take."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.notifications import Severity
from app.receiver import Receiver
from app.session import Session
from app.take_summary import TakeSummary
from core.errors import DeviceError
from core.frames import MarkerFrame, TrackedFrame
from core.level import Level
from core.profile import load_profile
from core.streams import ClockSample, Sample
from core.takes.reader import Take, open_take
from core.takes.verify import verify
from devices.natnet.client import NatNetDevice
from devices.natnet.simulator import NatNetSimulator
from tests.app.glove import Glove
from tests.app.stage import own_threads, settings_for, until
from tests.core.takes.frames import plain_bones, plain_frame
from tests.devices.natnet.streams import make_frames
from tests.some import some

FIRST, SECOND, GLOVE = "natnet-1/markers", "natnet-2/markers", "glove-1/right"
POINTS = {FIRST: 3, SECOND: 5}
"""Points in a frame, by which frames are told apart."""


class NoEngine:
    """Sees no hands, at once. seen: the frames that it was given."""

    def __init__(self, profiles: object) -> None:
        self.seen: list[MarkerFrame] = []

    def step(self, frame: MarkerFrame) -> TrackedFrame:
        self.seen.append(frame)
        return TrackedFrame(frame.sequence, frame.times, ())

    def reset(self) -> None:
        pass

    search = change = skip = pass_over = lambda self, what: None


@contextmanager
def camera(points: int, rate_hz: float = 100.0, ports: tuple[int, int] = (0, 0)) -> Iterator[NatNetSimulator]:
    simulator = NatNetSimulator(
        make_frames(500, points), rate_hz, command_port=ports[0], data_port=ports[1], loop=True, name=f"{points} points"
    )
    simulator.start()
    with simulator:
        yield simulator


@pytest.fixture(scope="module")
def cameras() -> Iterator[tuple[NatNetSimulator, NatNetSimulator]]:
    with camera(POINTS[FIRST]) as first, camera(POINTS[SECOND], 60.0) as second:
        yield first, second


@pytest.fixture
def session() -> Iterator[Session]:
    engines: list[NoEngine] = []

    def engine(profiles: object) -> NoEngine:
        engines.append(NoEngine(profiles))
        return engines[-1]

    made = Session(load_profile("han19"), engine=engine, warm_up=lambda: None)
    made.engines = engines  # type: ignore[attr-defined]
    made.start()
    made.wait_ready()
    yield made
    made.close()
    assert own_threads() == []


def seen(session: Session) -> list[int]:
    """Points of each frame that was solved."""
    (engine,) = session.engines  # type: ignore[attr-defined]
    return [len(frame.points_m) for frame in engine.seen]


def connect(session: Session, *wanted: NatNetSimulator | type[Glove]) -> list[Receiver]:
    """One after another."""
    made = []
    for one in wanted:
        if isinstance(one, NatNetSimulator):
            receiver = session.add_device(NatNetDevice, settings_for(one))
        else:
            receiver = session.add_device(one)
        session.connect(receiver)
        receiver.wait_connected(30)
        until(
            lambda receiver=receiver: all(receiver.received(info.key) for info in receiver.streams), "a frame of each"
        )
        made.append(receiver)
    return made


def begin(session: Session, path: Path) -> None:
    session.start_recording(path, session.take_info(path.stem, performer="Ann"))


def recorded(session: Session, key: str) -> int:
    numbers = session.numbers().recording
    assert numbers is not None
    return numbers.streams[key].received


def end(session: Session) -> TakeSummary:
    summary = session.stop_recording().result(60)
    for one in some(summary.streams.values()):
        assert one.received == one.written + one.dropped_total
    return summary


def told(session: Session, *words: str) -> int:
    """How often all of these were told together."""
    return sum(note.count for note in session.notifications.history if all(word in note.line for word in words))


def test_each_stream_has_its_own_counts_and_light_and_the_first_is_solved(session, cameras) -> None:
    first, second, glove = connect(session, *cameras, Glove)
    assert [one.key for one in session.streams] == [FIRST, SECOND, GLOVE]
    assert [one.receiver for one in session.streams] == [first, second, glove]
    assert [receiver.streams[0].key for receiver in session.receivers] == [FIRST, SECOND, GLOVE]
    assert session.solving == FIRST and session.solving_receiver is first
    before = {one.key: one.received for one in session.streams}
    until(lambda: all(one.received > before[one.key] + 20 for one in session.streams), "frames of all")
    until(lambda: all(one.health().level is Level.GOOD and one.rate_hz > 0 for one in session.streams), "green lights")
    assert set(seen(session)) == {POINTS[FIRST]}
    glove.device.lost = 5
    assert [one.health().lost for one in session.streams][2] == 5
    assert not any(note.severity is Severity.PROBLEM for note in session.notifications.history)


def test_another_device_beside_disturbs_nothing_of_what_is_solved(session, cameras) -> None:
    connect(session, cameras[0])
    until(lambda: len(seen(session)) > 10, "solved frames")
    n, dropped = len(seen(session)), dict(session.numbers().solver.dropped)
    number, _ = session.latest.newer(0)
    (_, glove) = connect(session, cameras[1], Glove)
    session.disconnect(glove)
    assert glove.join(10)
    until(lambda: len(seen(session)) > n + 50, "more of them")
    assert set(seen(session)) == {POINTS[FIRST]} and session.latest.newer(0)[0] > number
    assert dict(session.numbers().solver.dropped) == dropped and session.latest.peek() is not None
    numbers = np.array([frame.sequence for frame in session.engines[0].seen])
    assert np.all(np.diff(numbers) == 1)


def test_the_operator_chooses_what_is_solved(session, cameras, tmp_path) -> None:
    _, second, _ = connect(session, *cameras, Glove)
    session.solve(SECOND)
    assert session.solving == SECOND and session.solving_receiver is second
    n = len(seen(session))
    until(lambda: len(seen(session)) > n + 20, "frames of the other")
    changed = seen(session).index(POINTS[SECOND])
    assert set(seen(session)[:changed]) == {POINTS[FIRST]} and set(seen(session)[changed:]) == {POINTS[SECOND]}
    with pytest.raises(DeviceError, match="'natnet-9/markers' is connected"):
        session.solve("natnet-9/markers")
    with pytest.raises(DeviceError, match="no markers"):
        session.solve(GLOVE)
    begin(session, tmp_path / "a.mcap")
    with pytest.raises(DeviceError, match="while a take is recorded"):
        session.solve(FIRST)
    session.solve(SECOND)
    assert session.solving == SECOND
    end(session)
    session.solve(FIRST)
    assert session.solving == FIRST and not told(session, "is solved now"), "who chose it knows"


def test_the_next_one_takes_over_and_what_was_chosen_comes_back(session, cameras) -> None:
    first, second, _ = connect(session, *cameras, Glove)
    session.disconnect(first)
    assert session.solving == SECOND and told(session, f"{SECOND} is solved now", FIRST) == 1
    until(lambda: seen(session)[-1] == POINTS[SECOND], "its frames")
    assert first.join(10)
    session.connect(first)
    first.wait_connected(30)
    assert session.solving == SECOND, "who is there stays"
    session.solve(FIRST)
    session.disconnect(first)
    assert session.solving == SECOND and first.join(10)
    session.connect(first)
    first.wait_connected(30)
    assert session.solving == FIRST
    session.disconnect(second)
    session.disconnect(first)
    assert session.solving == "" and session.solving_receiver is None and session.latest.peek() is None
    assert [one.key for one in session.streams] == [GLOVE]


def check_take(summary: TakeSummary, keys: list[str], solving: str) -> Take:
    """What holds of every take: all frames of all streams, each once and in order; whoever asks is told the same."""
    take = open_take(summary.path)
    assert take.sealed and take.complete and take.counts is not None and take.solving == solving
    assert list(take.streams) == list(summary.streams) == keys
    assert take.verdict == summary.verdict
    for key, stream in some(take.streams.items()):
        mine = summary.streams[key]
        assert stream.counts is not None and stream.counts.balanced and stream.info.key == key
        assert len(stream.frames) == stream.counts.written == mine.written > 0
        numbers = [frame.sequence for frame in stream.frames]
        assert numbers == sorted(set(numbers))
    solved = {frame.sequence for frame in take.solved}
    assert solved <= {frame.sequence for frame in take.raw}
    return take


def test_a_take_holds_all_streams_that_are_armed(session, cameras, tmp_path) -> None:
    first, _, _ = connect(session, *cameras, Glove)
    session.solve(SECOND)
    begin(session, tmp_path / "a.mcap")
    until(lambda: all(recorded(session, key) > 60 for key in (FIRST, SECOND, GLOVE)), "frames of all")
    numbers = session.numbers().recording
    assert numbers is not None and numbers.solving == SECOND
    assert numbers.received == numbers.streams[SECOND].received
    summary = end(session)
    assert summary.verdict.whole and summary.solving == SECOND
    with check_take(summary, [SECOND, FIRST, GLOVE], SECOND) as take:
        assert {len(frame.points_m) for frame in take.raw} == {POINTS[SECOND]}
        assert {len(frame.points_m) for frame in take.streams[FIRST].frames} == {POINTS[FIRST]}
        assert take.streams[GLOVE].info.sides == ("right",) and take.streams[GLOVE].clock
        assert len(take.solved) + sum(take.counts.unsolved.values()) == len(take.raw)
        assert (take.info.performer, take.info.rate_hz) == ("Ann", 60.0)
        device = take.info.device
        assert (
            device["kind"] == "natnet" and device["natnet-1: kind"] == "natnet" and device["glove-1: Hand"] == "right"
        )
        assert str(cameras[1].command_port) in device["Server"]
        assert str(cameras[0].command_port) in device["natnet-1: Server"]
        assert {note.line for note in session.notifications.history if "is saved" in note.line}
        assert not any("pose" in text for text in take.verdict.texts)
    assert verify(summary.path).ok and first.streaming


def test_one_optical_device_alone_makes_a_take_of_the_first_version(session, cameras, tmp_path) -> None:
    connect(session, cameras[0])
    begin(session, tmp_path / "a.mcap")
    until(lambda: recorded(session, FIRST) > 20, "frames")
    with check_take(end(session), [FIRST], FIRST) as take:
        assert take.index.metadata["phalanx.take"]["version"] == "1"
        assert take.info.device == {"kind": "natnet", **{k: v for k, v in take.info.device.items() if k != "kind"}}
        assert not any(": " in key for key in take.info.device)


def test_a_glove_alone_is_recorded_and_nothing_is_missing(session, tmp_path) -> None:
    connect(session, Glove)
    assert session.solving == ""
    begin(session, tmp_path / "a.mcap")
    until(lambda: recorded(session, GLOVE) > 40, "frames")
    numbers = session.numbers().recording
    assert numbers is not None and numbers.solving is None and numbers.received > 40
    summary = end(session)
    assert summary.verdict.whole and summary.received == summary.written > 40 and "solved" not in summary.line
    check_take(summary, [GLOVE], "").close()


def test_a_second_device_that_receives_from_the_same_place_is_said_once(session, cameras) -> None:
    first, _, glove = connect(session, cameras[0], cameras[1], Glove)
    words = "natnet-3 receives from the same place as natnet-1", first.address, "one stream is recorded twice"
    assert told(session, "the same place") == 0
    connect(session, cameras[0])
    until(lambda: told(session, *words) == 1, "it to be said")
    session.disconnect(glove)
    assert glove.join(10) and told(session, "the same place") == 1


def test_who_comes_later_is_not_in_the_take_and_who_is_in_it_stays(session, cameras, tmp_path) -> None:
    first, glove = connect(session, cameras[0], Glove)
    begin(session, tmp_path / "a.mcap")
    for device in (first, glove):
        with pytest.raises(DeviceError, match="disconnected while a take is recorded"):
            session.disconnect(device)
        with pytest.raises(DeviceError, match="removed while a take is recorded"):
            session.remove_device(device)
    (late,) = connect(session, cameras[1])
    assert told(session, late.title, "is not in take a", "begin another take") == 1
    until(lambda: recorded(session, FIRST) > 20 and recorded(session, GLOVE) > 20, "frames")
    numbers = session.numbers().recording
    assert numbers is not None and set(numbers.streams) == {FIRST, GLOVE}
    session.disconnect(late)
    assert late.join(10)
    summary = end(session)
    check_take(summary, [FIRST, GLOVE], FIRST).close()
    session.disconnect(glove)
    connect(session, cameras[1])
    assert told(session, "is not in take") == 1


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (Sample("right", plain_frame(1)), "MarkerFrame as 'right'"),
        (Sample("left", plain_bones(1)), "InertialFrame as 'left'"),
        (Sample("left", ClockSample(1.0, 1.0, 0.0)), "ClockSample as 'left'"),
        (Sample("right", "nonsense"), "str as 'right'"),  # type: ignore[arg-type]
    ],
)
def test_a_sample_of_no_stream_is_refused_counted_and_told_once(session, tmp_path, wrong: Sample, words: str) -> None:
    (glove,) = connect(session, Glove)
    begin(session, tmp_path / "a.mcap")
    glove.device.next.extend([wrong] * 30)
    until(lambda: glove.refused == 30, "all of them")
    n = recorded(session, GLOVE)
    until(lambda: recorded(session, GLOVE) > n + 10, "its own frames")
    for health in (glove.health(), session.streams[0].health()):
        assert health.rejected == 30 and health.level is Level.WARNING and words in health.reason
    assert told(session, "Samples of Test glove are refused", words, "inertial as 'right'") == 1
    summary = end(session)
    assert summary.streams[GLOVE].rejected == 30 and not summary.streams[GLOVE].dropped
    assert not summary.verdict.whole and "30 unreadable" in summary.verdict.headline
    check_take(summary, [GLOVE], "").close()
    session.disconnect(glove)
    assert glove.join(10)
    session.connect(glove)
    glove.wait_connected(10)
    assert glove.health().level is Level.GOOD and glove.health().rejected == 0 and glove.refused == 30


def test_a_device_that_fails_in_mid_take_costs_no_other_a_frame(session, cameras, tmp_path) -> None:
    _, glove = connect(session, cameras[0], Glove)
    begin(session, tmp_path / "a.mcap")
    until(lambda: recorded(session, GLOVE) > 10, "frames")
    glove.device.next.append(OSError("the port is gone"))
    until(lambda: told(session, "the port is gone"), "that it is told")
    n = recorded(session, GLOVE)
    until(lambda: recorded(session, GLOVE) > n + 30, "frames again")
    summary = end(session)
    assert [one.key for one in session.streams] == [FIRST, GLOVE]
    assert len(summary.streams[GLOVE].holes) == 1 and "without frames" in summary.verdict.headline
    assert all(text.startswith(f"Stream {GLOVE}: ") for text in summary.verdict.texts if "without frames" in text)
    check_take(summary, [FIRST, GLOVE], FIRST).close()


def test_a_server_that_is_lost_in_mid_take_is_a_hole_of_its_stream_alone(session, cameras, tmp_path) -> None:
    with camera(POINTS[SECOND]) as second:
        connect(session, cameras[0], second)
        begin(session, tmp_path / "a.mcap")
        until(lambda: recorded(session, SECOND) > 20 and recorded(session, FIRST) > 20, "frames")
        ports = second.command_port, second.data_port
    until(lambda: session.streams[1].health().level is Level.PROBLEM, "its light to turn red")
    assert session.streams[0].health().level is not Level.PROBLEM and session.recording
    numbers = session.numbers().recording
    assert numbers is not None and numbers.streams[SECOND].silent_s > 0.5
    n = recorded(session, SECOND)
    with camera(POINTS[SECOND], ports=ports):
        until(lambda: recorded(session, SECOND) > n + 20, "frames again")
        summary = end(session)
    assert summary.streams[SECOND].holes.longest_s > 0.5
    with check_take(summary, [FIRST, SECOND], FIRST) as take:
        assert f"{SECOND}: " in take.verdict.headline and take.verdict.level is Level.PROBLEM
        own = summary.streams[FIRST]
        assert own.lost + own.holes.missing < 50  # of a machine that was held up


def test_a_bad_stream_and_frames_too_large_disturb_no_other(session, cameras, tmp_path) -> None:
    _, glove = connect(session, cameras[0], Glove)
    begin(session, tmp_path / "a.mcap")
    n = 40_000
    huge = replace(plain_bones(1), bone_names=("a",) * n, rotations_wxyz=np.ones((n, 4)))
    glove.device.next.extend([Sample("right", huge)] * 5)
    until(lambda: recorded(session, FIRST) > 40 and recorded(session, GLOVE) > 40, "frames")
    summary = end(session)
    assert summary.sealed and not summary.problem and summary.streams[GLOVE].dropped == {"cannot be written": 5}
    assert told(session, "A record of glove-1/right cannot be written", "1024 at most") == 1
    with open_take(summary.path) as take:
        assert take.complete and len(take.raw) == summary.streams[FIRST].written == summary.streams[FIRST].received
