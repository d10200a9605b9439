"""Streams instead of a stream: a glove beside cameras, and two camera systems, each recorded as one take. What was sent
is in it to the last bit; so it is once the take is cut off and recovered, and once it is played as a device.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.file_device import FileDevice
from app.receiver import Receiver
from app.review.document import ReviewDocument
from app.session import Session
from app.take_summary import TakeSummary
from core.frames import InertialFrame, MarkerFrame
from core.profile import load_profile
from core.takes.container import INFO
from core.takes.formats.bvh import read_bvh
from core.takes.formats.bvh_frames import frames_of
from core.takes.reader import Take, open_take
from core.takes.recover import recover
from core.takes.take import FORMAT_VERSION
from core.takes.verify import verify
from devices.natnet.client import NatNetDevice
from tests.app.stage import own_threads, performance, server, settings_for, until
from tests.core.takes.frames import bits
from tests.data import DATA
from tests.devices.kinds import inertial_recording
from tests.some import some

SUIT = DATA / "neuron" / "openPerform_freya_edit.bvh"
"""733 frames of 59 bones, where the recordings are that are not part of the project; else a smaller one is made."""

Frame = MarkerFrame | InertialFrame


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session(load_profile("han19"))
    made.start()
    made.wait_ready()
    yield made
    made.close()
    assert own_threads() == []


@pytest.fixture
def glove(tmp_path: Path) -> Path:
    if SUIT.exists():
        return SUIT
    made = inertial_recording(tmp_path)
    made.bring_back()
    return tmp_path / "glove.bvh"


def connected(session: Session, *args: object) -> Receiver:
    receiver = session.add_device(*args)  # type: ignore[arg-type]
    session.connect(receiver, held=receiver.device_class.has_end)
    receiver.wait_connected(30)
    if not receiver.device_class.has_end:
        until(lambda: receiver.health().received > 0, "the first frame")
    return receiver


def recorded(session: Session, path: Path, over: Callable[[], object], begin: Callable[[], object]) -> TakeSummary:
    session.start_recording(path, session.take_info(path.stem))
    begin()
    until(over, "the end of the take")
    return session.stop_recording().result(60)


def frames_in(take: Take) -> dict[str, list[Frame]]:
    """Of every stream, by its key."""
    return {key: list(stream.frames) for key, stream in take.streams.items()}


def check_sent(frames: list[Frame]) -> None:
    """Frames of a server of tests.app.stage: of each number there is one, as it left, in the 32 bits of the wire."""
    numbers = [frame.sequence for frame in frames]
    assert numbers == sorted(set(numbers))
    for frame in some(frames):
        sent = performance()[frame.sequence % len(performance())]
        assert isinstance(frame, MarkerFrame)
        assert np.array_equal(frame.points_m, sent.points_m.astype(np.float32).astype(np.float64))
        assert np.array_equal(frame.ids, sent.ids)
        assert np.array_equal(frame.residuals_m, np.nan_to_num(sent.residuals_m).astype(np.float32).astype(np.float64))


def check_counts(summary: TakeSummary, held: dict[str, list[Frame]]) -> None:
    """Received are those written and those dropped, of each stream; written are those that the take holds."""
    assert summary.sealed and set(summary.streams) == set(held)
    for key, figures in some(summary.streams.items()):
        assert figures.received == figures.written + sum(figures.dropped.values())
        assert figures.written == len(held[key]) > 0 and figures.dropped == {}
    with open_take(summary.path) as take:
        assert take.counts is not None and take.counts.balanced and take.complete
        for key, stream in take.streams.items():
            assert stream.counts is not None and stream.counts.written == len(held[key])


def check_verified(path: Path, held: dict[str, list[Frame]], solving: str) -> None:
    """Every record is read; nothing is a problem."""
    report = verify(path)
    assert report.ok and report.sealed, report.findings
    assert report.raw == len(held[solving])
    assert report.streams == {key: len(frames) for key, frames in held.items() if key != solving}


def check_cut_and_recovered(path: Path, held: dict[str, list[Frame]], folder: Path) -> None:
    """Wherever the file ends, each stream has what came first, and recovering it keeps that."""
    whole = path.read_bytes()
    for share in (0.35, 0.8):
        cut = folder / f"cut{share}.mcap"
        cut.write_bytes(whole[: int(share * len(whole))])
        with open_take(cut) as take:
            left = frames_in(take)
            assert not take.sealed
        recovered = recover(cut)
        with open_take(recovered.path) as take:
            assert take.sealed and take.complete
            again = frames_in(take)
        assert again.keys() == left.keys() == held.keys()
        assert 0 < sum(map(len, left.values())) < sum(map(len, held.values()))
        for key, frames in some(held.items()):
            n = len(left[key])
            assert bits(tuple(left[key])) == bits(tuple(again[key])) == bits(tuple(frames[:n]))
        assert verify(recovered.path).ok


def check_played(path: Path, held: dict[str, list[Frame]]) -> None:
    """As a device it sends every frame of every stream, each at its own time by one clock."""
    device = FileDevice(file=str(path), speed=20.0)
    device.open()
    played: dict[str, list[Frame]] = {info.key: [] for info in device.streams()}
    with open_take(path) as take:
        assert {info.key: info.bone_names for info in device.streams()} == {
            key: stream.info.bone_names for key, stream in take.streams.items()
        }
    device.start()
    while not device.finished:
        sample = device.read(0.2)
        if sample is not None and isinstance(sample.frame, MarkerFrame | InertialFrame):
            played[sample.stream].append(sample.frame)
    assert device.health().received == sum(map(len, held.values())) and not device.health().last_error
    device.close()
    begins_s = {}
    for key, frames in some(held.items()):
        assert len(played[key]) == len(frames)
        for again, frame in zip(played[key], frames, strict=True):
            assert again.times.device_s == frame.times.device_s
            assert bits(replace(again, times=frame.times)) == bits(frame)
        host_s = np.array([frame.times.host_s for frame in played[key]])
        own_s = np.array([frame.times.host_s for frame in frames])
        increasing = np.diff(own_s) > 0
        assert np.abs((np.diff(host_s) - np.diff(own_s) / 20.0)[increasing]).max() < 1e-6
        begins_s[key] = host_s[0] - own_s[0] / 20.0
    assert np.ptp(list(begins_s.values())) < 1e-6


def check_reviewed(path: Path, held: dict[str, list[Frame]], solving: str) -> None:
    """The document of review has the stream that was solved on its time line, and names the others."""
    document = ReviewDocument(path)
    assert len(document.times_s) == len(held[solving]) and document.recorded is not None
    assert [one.name for one in document.streams] == list(held)
    assert [one.name for one in document.streams if one.solved] == [solving]
    assert document.n_beside == sum(len(frames) for key, frames in held.items() if key != solving)
    assert document.counts is not None and document.counts.solved > 0
    document.close()


def check_take(summary: TakeSummary, solving: str, folder: Path) -> dict[str, list[Frame]]:
    """All of the above; what the take holds."""
    with open_take(summary.path) as take:
        assert take.index.metadata[INFO]["version"] == str(FORMAT_VERSION) and take.solving == solving
        held = frames_in(take)
    check_counts(summary, held)
    check_verified(summary.path, held, solving)
    check_cut_and_recovered(summary.path, held, folder)
    check_played(summary.path, held)
    check_reviewed(summary.path, held, solving)
    return held


def test_a_glove_beside_cameras_is_one_take(session: Session, glove: Path, tmp_path: Path) -> None:
    with server() as simulator:
        cameras = connected(session, NatNetDevice, settings_for(simulator))
        worn = connected(session, FileDevice, {"file": str(glove), "speed": 4.0})
        assert [stream.key for stream in session.streams] == ["natnet-1/markers", "playback-1/inertial"]
        assert (session.solving, session.solving_receiver) == ("natnet-1/markers", cameras)
        summary = recorded(session, tmp_path / "beside.mcap", lambda: worn.finished, worn.begin)
    held = check_take(summary, "natnet-1/markers", tmp_path)
    check_sent(held["natnet-1/markers"])
    sent = list(frames_of(read_bvh(glove)))
    got = held["playback-1/inertial"]
    assert len(got) == len(sent)
    for frame, bones in zip(got, some(sent), strict=True):
        assert frame.times.device_s == bones.times.device_s
        assert bits(replace(frame, times=bones.times)) == bits(bones)
    host_s = np.array([frame.times.host_s for frame in got])
    assert np.abs(np.diff(host_s) - 1 / 500).max() < 1e-6 or not SUIT.exists()


def test_two_camera_systems_are_one_take(session: Session, tmp_path: Path) -> None:
    with server() as one, server(rate_hz=100.0) as other:
        first = connected(session, NatNetDevice, settings_for(one))
        second = connected(session, NatNetDevice, settings_for(other))
        assert [stream.key for stream in session.streams] == ["natnet-1/markers", "natnet-2/markers"]
        assert session.solving_receiver is first
        since = second.health().received
        summary = recorded(session, tmp_path / "two.mcap", lambda: second.health().received > since + 200, lambda: None)
    held = check_take(summary, "natnet-1/markers", tmp_path)
    for frames in some(held.values()):
        check_sent(frames)
        assert len(frames) > 150
