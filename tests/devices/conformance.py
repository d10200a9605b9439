"""What every kind of device must do, whatever is on its other end: checks that run against a `Kind`.

A kind says how to make its device, and how to take away and bring back the server or the file that it reads. All checks
of CHECKS then hold for it: docs/adding-a-device.md says how a new kind is put among the others.
"""

from __future__ import annotations

import math
import os
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType

import numpy as np
import pytest

from app.receiver import Receiver
from core.errors import DeviceError
from core.frames import InertialFrame, MarkerFrame
from core.streams import ClockSample, Sample
from devices.device import Description, Device, Health, Level
from devices.offers import Offers
from tests.some import some

PATIENCE_S = 60.0
"""Far beyond what anything here takes: a device that hangs fails instead."""

FEW = 5
"""Samples that show that it streams."""


class Kind(ABC):
    """A kind of device, and the server or the file that it reads, which is there while a `with` lasts.

    rounds: from open to close, how many are tried for leaks, by how many devices beside each other.
    sent: frames since `resume`, or that a device which ends must give; None where nobody knows.
    """

    rounds, beside = 200, 1
    sent: int | None = None

    @abstractmethod
    def device(self, ends: bool = False) -> Device:
        """A device that reads it. It goes on without an end unless `ends`, for what has one."""

    @abstractmethod
    def broken(self) -> Device:
        """One that cannot be opened."""

    @abstractmethod
    def bring_back(self) -> None:
        """Begin to serve, or write the file; the same as before if it was there before."""

    @abstractmethod
    def take_away(self) -> None:
        """Kill the server, remove the file."""

    def pause(self) -> None:  # noqa: B027
        """Send nothing."""

    def resume(self) -> None:  # noqa: B027
        """Send again."""

    def spoil(self) -> int:
        """Send what cannot be understood to whoever listens; how many packets."""
        return 0

    def spoilt(self) -> Iterable[Device]:
        """Devices that read damaged copies of the file."""
        return ()

    def __enter__(self) -> Kind:
        self.bring_back()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.take_away()


# What is checked.


def check_what_it_says_of_itself(kind: Kind) -> None:
    """Kind, title, settings that can be shown, set and refused, and what it can be asked to do."""
    device = kind.device()
    assert device.kind and device.kind == device.kind.lower() and device.title
    names = [parameter.name for parameter in device.parameters]
    assert len(set(names)) == len(names) and set(device.settings) == set(names)
    for parameter in device.parameters:
        assert parameter.label and parameter.check(parameter.default) == parameter.default
    with pytest.raises(DeviceError, match="has no setting 'colour'") as refused:
        type(device)(colour="red")
    assert refused.value.action
    assert type(device)(**device.settings).settings == device.settings
    for command in device.can:
        assert command.name and command.label
    with pytest.raises(DeviceError, match="cannot be asked to 'dance'") as refused:
        device.command("dance")
    assert refused.value.action


def check_before_it_is_open(kind: Kind) -> None:
    """It names no stream, says that it is not connected, and cannot be started."""
    device = kind.device()
    assert device.streams() == () and not device.finished
    _check_idle(device)
    with pytest.raises(DeviceError) as refused:
        device.start()
    assert refused.value.action
    device.close()


def check_opened_twice(kind: Kind) -> None:
    """As if it were opened once."""
    device = kind.device()
    device.open()
    device.open()
    try:
        device.start()
        read(device, FEW)
    finally:
        device.close()
        device.close()
    assert device.streams() == ()


def check_closed_after_an_open_that_failed(kind: Kind) -> None:
    """The error says what to do; the device is closed, and closing it again does nothing."""
    before = held()
    device = kind.broken()
    with pytest.raises(DeviceError) as refused:
        device.open()
    assert refused.value.what and refused.value.action
    assert device.streams() == ()
    device.close()
    device.close()
    _check_idle(device)
    until(lambda: not_more_than(before), "what it held")


def check_read_after_stop(kind: Kind) -> None:
    """Nothing comes, and it may be started again."""
    device = kind.device()
    device.open()
    try:
        for _ in range(3):
            device.start()
            read(device, FEW)
            device.stop()
            assert [device.read(0.0), device.read(0.02)] == [None, None]
            assert device.streams()
            device.stop()
    finally:
        device.close()
    assert device.read(0.0) is None


def check_samples_are_of_its_streams(kind: Kind) -> None:
    """Every stream is said once, and every sample is of one of them, and as it says."""
    device = kind.device()
    device.open()
    try:
        device.start()
        infos = {info.key: info for info in device.streams()}
        assert infos and len(infos) == len(device.streams())
        for key, info in infos.items():
            assert key and not any(character.isspace() for character in key)
            assert info.kind == device.kind and info.title
            assert math.isnan(info.rate_hz) or 0 < info.rate_hz <= 10_000
            assert (info.what == "inertial") == bool(info.bone_names) == (info.rotations != "none")
        missing = set(infos)

        def look(samples: list[Sample]) -> None:
            for sample in samples:
                _check_sample(device, sample)
                missing.discard(sample.stream)

        look(read(device, FEW))
        until(lambda: not missing, "each stream", lambda _: look(take(device)))
        assert {info.key: info.what for info in device.streams()} == {key: one.what for key, one in infos.items()}
    finally:
        device.close()


def check_asked_from_other_threads(kind: Kind) -> None:
    """How it is, what it is and what it sends may be asked at any time."""
    device = kind.device()
    done, faults, asked = threading.Event(), [], [0, 0]

    def ask(i: int) -> None:
        try:
            while not done.is_set():
                health, described, streams = device.health(), device.describe(), device.streams()
                assert isinstance(health, Health) and isinstance(described, Description)
                assert health.reason and described.title and isinstance(device.offers(), Offers)
                for info in streams:
                    assert device.stream_health(info.key).reason
                assert isinstance(device.address, str) and isinstance(device.finished, bool)
                assert all(isinstance(text, str) for text in device.warnings)
                asked[i] += 1
                time.sleep(0.001)
        except BaseException as error:
            faults.append(error)

    askers = [threading.Thread(target=ask, args=(i,), daemon=True) for i in range(2)]
    for asker in askers:
        asker.start()
    try:
        device.open()
        for _ in range(2):
            device.start()
            read(device, FEW)
            device.stop()
    finally:
        device.close()
        done.set()
        for asker in askers:
            asker.join()
    assert faults == [] and min(asked) > 0


def check_what_is_received_is_handed_on_or_counted(kind: Kind) -> None:
    """Every frame that was sent comes, or is counted as lost; each received one is handed on."""
    kind.pause()
    device = kind.device(ends=True)
    device.open()
    try:
        device.start()
        before = device.health()
        kind.resume()
        got = [*read(device, 20)]
        kind.pause()
        got += rest(device, kind)
        health = device.health().since(before)
        frames = [sample for sample in got if not isinstance(sample.frame, ClockSample)]
        assert device.health().received - before.received == len(frames) > 0
        keys = [info.key for info in device.streams()]
        if len(keys) > 1:
            assert sum(device.stream_health(key).received for key in keys) == device.health().received
        if kind.sent is not None:
            assert len(frames) + health.lost == kind.sent
        for key in some(keys):
            numbers = [sample.frame.sequence for sample in frames if sample.stream == key]
            assert numbers == sorted(set(numbers))
    finally:
        device.close()
        kind.resume()


def check_spoilt_packets(kind: Kind) -> None:
    """They are refused and counted, and cost no frame."""
    kind.pause()
    device = kind.device()
    device.open()
    try:
        device.start()
        kind.resume()
        got = [*read(device, FEW)]
        n = kind.spoil()
        assert n > 0
        until(lambda: device.health().rejected > 0, "a packet that is refused", lambda _: got.extend(take(device)))
        got += read(device, 20)
        kind.pause()
        got += rest(device, kind)
        health = device.health()
        assert 0 < health.rejected <= n and health.last_error
        frames = [sample for sample in got if not isinstance(sample.frame, ClockSample)]
        assert len(frames) == health.received
        assert kind.sent is None or len(frames) + health.lost == kind.sent
        for sample in some(frames):
            _check_sample(device, sample)
    finally:
        device.close()
        kind.resume()


def check_spoilt_files(kind: Kind) -> None:
    """One is refused in words, or played as far as it goes."""
    before, played, refused = held(), 0, 0
    for device in some(kind.spoilt()):
        try:
            device.open()
            device.start()
            played += 1
            for _ in range(40):
                sample = device.read(0.0)
                assert sample is None or sample.stream in {info.key for info in device.streams()}
        except DeviceError as error:
            assert error.what
            refused += 1
        finally:
            device.close()
    assert played and refused
    until(lambda: not_more_than(before), "what it held")


def check_server_gone_and_back(kind: Kind) -> None:
    """Reading goes on; the light says that nothing comes, and then that it comes again."""
    device = kind.device()
    device.open()
    try:
        device.start()
        read(device, FEW)
        kind.take_away()
        until(lambda: device.health().level is not Level.GOOD, "its light", lambda _: take(device))
        assert device.health().reason and device.streams()
        received = device.health().received
        kind.bring_back()
        until(lambda: device.health().received > received + FEW, "frames again", lambda _: take(device))
        until(lambda: device.health().connected, "its server", lambda _: take(device))
        for sample in some(read(device, FEW)):
            _check_sample(device, sample)
    finally:
        device.close()


def check_late_start(kind: Kind) -> None:
    """What is not there yet is told, or waited for; once it is there, the same device reads it."""
    kind.take_away()
    device = kind.device()
    try:
        try:
            device.open()
        except DeviceError as error:
            assert error.what and error.action
            kind.bring_back()
            device.open()
            device.start()
        else:
            device.start()
            assert device.read(0.02) is None
            kind.bring_back()
        read(device, FEW)
    finally:
        device.close()


def check_stopped_while_opening(kind: Kind) -> None:
    """Whenever an operator disconnects it, its thread ends and all is given back."""
    before = held()
    for wait_s in (0.0, 0.05):
        made = kind.device()
        receiver = Receiver(1, type(made), made.settings, lambda *_: None, lambda *_: None)
        receiver.connect()
        time.sleep(wait_s)
        receiver.disconnect()
        assert receiver.join(PATIENCE_S), "it did not end"
        assert receiver.device.streams() == ()
    until(lambda: not_more_than(before), "what it held")


def check_stopped_while_opening_in_vain(kind: Kind) -> None:
    """The same where nobody answers."""
    kind.take_away()
    check_stopped_while_opening(kind)
    kind.bring_back()


def check_nothing_is_leaked(kind: Kind) -> None:
    """However often it is connected, threads and open files are as many as before."""

    def connected(rounds: int) -> None:
        device = kind.device()
        for _ in range(rounds):
            device.open()
            device.start()
            read(device, 1)
            device.stop()
            device.close()

    connected(1)  # what is made once for all
    before = held()
    with ThreadPoolExecutor(kind.beside) as pool:
        list(pool.map(connected, [kind.rounds // kind.beside] * kind.beside))
    until(lambda: not_more_than(before), f"{before} threads and files, as before {kind.rounds} rounds")


CHECKS: tuple[Callable[[Kind], None], ...] = (
    check_what_it_says_of_itself,
    check_before_it_is_open,
    check_opened_twice,
    check_closed_after_an_open_that_failed,
    check_read_after_stop,
    check_samples_are_of_its_streams,
    check_asked_from_other_threads,
    check_what_is_received_is_handed_on_or_counted,
    check_stopped_while_opening,
    check_nothing_is_leaked,
)
"""Of every kind."""

SERVED = (check_server_gone_and_back, check_late_start, check_stopped_while_opening_in_vain, check_spoilt_packets)
"""Of those that have a server."""

FILED = (check_late_start, check_stopped_while_opening_in_vain, check_spoilt_files)
"""Of those that read a file."""


# How.


def until(condition: Callable[[], object], what: str, poll: Callable[[float], object] = time.sleep) -> None:
    """Wait for a condition."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, f"waited {PATIENCE_S:g} s for {what}"
        poll(0.01)


def take(device: Device) -> list[Sample]:
    """The next sample, if one comes soon."""
    sample = device.read(0.01)
    return [] if sample is None else [sample]


def read(device: Device, n: int) -> list[Sample]:
    """The next n samples."""
    got: list[Sample] = []
    until(lambda: len(got) >= n, f"{n} samples of {device.title}", lambda _: got.extend(take(device)))
    return got


def rest(device: Device, kind: Kind) -> list[Sample]:
    """All that still comes: of what has an end to that end, else until it is silent, or nothing waits of what nobody
    can pause."""
    got: list[Sample] = []
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        sample = device.read(0.0 if kind.sent is None else 0.3)
        if sample is not None:
            got.append(sample)
        elif device.finished or not device.has_end:
            return got
    raise AssertionError(f"it did not end: {device.health()}")


def held() -> tuple[int, int]:
    """Threads and open files of this process; of the latter 0 where the system does not tell."""
    files = "/proc/self/fd"
    return threading.active_count(), len(os.listdir(files)) if os.path.isdir(files) else 0  # noqa: PTH112, PTH208


def not_more_than(before: tuple[int, int]) -> bool:
    """Whether as much is held as before, or less: what a test before this one left may end meanwhile."""
    return all(now <= then for now, then in zip(held(), before, strict=True))


def _check_idle(device: Device) -> None:
    health = device.health()
    assert health.level is not Level.GOOD and not health.connected and health.reason
    assert device.describe().title


def _check_sample(device: Device, sample: Sample) -> None:
    """One sample is as its stream says."""
    infos = {info.key: info for info in device.streams()}
    assert sample.stream in infos, f"{sample.stream} is none of {list(infos)}"
    info, frame = infos[sample.stream], sample.frame
    if isinstance(frame, ClockSample):
        assert math.isfinite(frame.device_s) and math.isfinite(frame.host_s)
        return
    assert type(frame) is {"markers": MarkerFrame, "inertial": InertialFrame}[info.what]
    assert math.isfinite(frame.times.arrival_s)
    assert not frame.times.host_s > frame.times.arrival_s
    if isinstance(frame, MarkerFrame):
        n = len(frame.points_m)
        assert frame.points_m.shape == (n, 3) and frame.ids.shape == frame.residuals_m.shape == (n,)
        assert frame.points_m.dtype == np.float64 and frame.ids.dtype == np.int64
        assert info.quality != "none" or np.isnan(frame.residuals_m).all()
    else:
        n = len(info.bone_names)
        assert frame.bone_names == info.bone_names and frame.rotations_wxyz.shape == (n, 4)
        assert frame.positions_m.shape == frame.angular_radps.shape == frame.acceleration_mps2.shape == (n, 3)
        assert frame.side is None or frame.side in info.sides
        lengths = np.linalg.norm(frame.rotations_wxyz, axis=1)
        assert np.abs(lengths - 1.0).max() < 1e-6
