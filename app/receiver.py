"""A device in the session: its settings, and the one thread that drives it while it is connected."""

from __future__ import annotations

import logging
import math
import threading
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace

from core.errors import DeviceError, PhalanxError
from core.frames import InertialFrame, MarkerFrame, Standstill
from core.streams import ClockSample, Sample, StreamInfo, What
from devices.common.clock import host_clock
from devices.device import Description, Device, Health, Level, Value

LOG = logging.getLogger("phalanx")
READ_S = 0.1
REOPEN_S = 1.0
LOOK_S = 0.25
"""How often it is looked whether this program stood still."""
_FRAMES: dict[What, type] = {"markers": MarkerFrame, "inertial": InertialFrame}
_MOST_REFUSALS = 8


class Receiver:
    """One configured device. `connect` and `disconnect` return at once; the receiver thread does the work.

    A device names its streams when it is open, and what frames they have; a sample that is not of these is refused:
    counted, told once, and never handed on. Streams have keys in the session: "natnet-1/markers".

    All are called on the receiver thread. on_sample: for every sample, with its stream's key in the session. on_error:
    for what an operator must know. on_warning: for what connecting found amiss and went on without. on_standstill: this
    program stood still for a while and runs again. on_armed: its streams are there now, or are gone.
    """

    def __init__(
        self,
        number: int,
        device_class: type[Device],
        settings: Mapping[str, object],
        on_sample: Callable[[Receiver, Sample], None],
        on_error: Callable[[Receiver, BaseException], None],
        title: str = "",
        on_warning: Callable[[Receiver, str], None] = lambda stream, text: None,
        on_standstill: Callable[[Receiver, Standstill], None] = lambda stream, one: None,
        on_armed: Callable[[Receiver], None] = lambda stream: None,
    ) -> None:
        """number: among the devices of its kind in the session. Raises DeviceError for a setting that does not exist or
        is out of range."""
        self.key = f"{device_class.kind}-{number}"
        """What its streams begin with."""
        self.device_class = device_class
        self._device = device_class(**settings)
        self._custom_title = title
        self._on_sample, self._on_error, self._on_warning = on_sample, on_error, on_warning
        self._on_standstill, self._on_armed = on_standstill, on_armed
        self._stop = threading.Event()
        self._settled = threading.Event()
        self._settled.set()
        self._begin = threading.Event()
        self._begin.set()
        self._thread: threading.Thread | None = None
        self._state_lock = threading.Lock()
        self._opened = self._over = False
        self._finished = False
        self.connected_s = math.nan
        """Since when its streams are there, by the host's clock [s]."""
        self._streams: dict[str, StreamInfo] = {}  # by the device's own keys
        self._received: Counter[str] = Counter()  # frames, by the device's own keys
        self._refused: Counter[str] = Counter()  # samples, likewise; "": of no stream that is known
        self._refusals: dict[tuple[str, str], str] = {}  # why, of each stream likewise and kind of record
        self._before: dict[str, Health] = {"": Health()}
        self._fault: PhalanxError | None = None

    @property
    def title(self) -> str:
        """What the operator calls it: the system, and where it is reached, so that two of a kind are told apart."""
        system, address = self.system, self.address
        return f"{system} {address}" if address and address not in system else system

    @property
    def system(self) -> str:
        """Its title without the address."""
        return self._custom_title or self._device.describe().title or self.device_class.title

    @property
    def address(self) -> str:
        """Where it is reached, "" if nowhere in particular."""
        return self._device.address

    @property
    def settings(self) -> dict[str, Value]:
        """The parameters in force."""
        return dict(self._device.settings)

    @property
    def device(self) -> Device:
        """The device itself; only its thread-safe methods may be called."""
        return self._device

    @property
    def active(self) -> bool:
        """Connecting, streaming or being disconnected."""
        return self._thread is not None and self._thread.is_alive() and not self._over

    @property
    def opening(self) -> bool:
        """Asked to connect, not yet streaming."""
        return self.active and not self._opened and not self._stop.is_set()

    @property
    def streaming(self) -> bool:
        """Opened and started; whether frames come is in `health`."""
        return self.active and self._opened and not self._stop.is_set()

    @property
    def finished(self) -> bool:
        """A file was played to its end."""
        return self._finished

    @property
    def failed(self) -> bool:
        """Asked to connect, it could not be, and nobody has disconnected it since."""
        return self._fault is not None and not self.active and not self._stop.is_set()

    @property
    def several(self) -> bool:
        """It sends several streams, or did."""
        return len(self._streams) > 1

    def describe(self) -> Description:
        """What the device says of itself."""
        return self._device.describe()

    @property
    def streams(self) -> tuple[StreamInfo, ...]:
        """What it sends, by keys in the session; () until it is open."""
        return tuple(self._streams.values()) if self.streaming else ()

    def stream(self, key: str) -> StreamInfo:
        """What is said of a stream, by its key in the session, also once it is gone."""
        return self._streams[self._own(key)]

    @property
    def refused(self) -> int:
        """Samples that were not of what the device says it sends, ever."""
        return self._refused.total()

    def received(self, key: str) -> int:
        """Frames of a stream handed on since it was connected."""
        return self._received[self._own(key)]

    def counted(self, key: str = "") -> Health:
        """What the device says of a stream, or of all ("") of them, with what was refused among what was rejected; its
        counts since it was made."""
        own = self._own(key)
        health = self._device.stream_health(own) if own else self._device.health()
        refused = self._refused[own] if own else self._refused.total()
        if own and own == next(iter(self._streams), ""):  # what is of no stream is told of the first
            refused += self._refused[""]
        return replace(health, rejected=health.rejected + refused) if refused else health

    def health(self) -> Health:
        """The light and its reason, now; what was lost since it was connected."""
        return self.stream_health("")

    def stream_health(self, key: str) -> Health:
        """The same of one of its streams; "" for all."""
        if self.opening:
            return Health(Level.WARNING, "Connecting…")
        if self._fault is not None and (self.active or self.failed):
            return Health(Level.PROBLEM, str(self._fault), last_error=self._fault.what)
        if not self.active:
            reason = "Played to its end. Connect to play it again." if self._finished else "Not connected."
            return Health(Level.IDLE, reason)
        own = self._own(key)
        health = self.counted(key).since(self._before.get(own, Health()))
        why = "; ".join(why for (stream, _), why in tuple(self._refusals.items()) if not own or stream in ("", own))
        if why and health.level is not Level.PROBLEM:
            return replace(health, level=Level.WARNING, reason=f"Samples of {self.title} are refused: {why}.")
        return health

    def _own(self, key: str) -> str:
        """The device's own key of a stream."""
        return key.removeprefix(f"{self.key}/")

    def check(self, settings: Mapping[str, object]) -> Device:
        """The device as these other settings would make it. Raises DeviceError for wrong ones; nothing changes."""
        return self.device_class(**{**self._device.settings, **settings})

    def configure(self, settings: Mapping[str, object]) -> None:
        """Use other settings from the next connection on. Raises DeviceError; the old ones then stay."""
        if self.active:
            raise DeviceError(f"{self.title} is connected.", "Disconnect it to change its settings.")
        self._device = self.check(settings)
        self._fault = None

    def connect(self, held: bool = False) -> None:
        """Open and start the device on its receiver thread. Nothing happens if it is active.

        held: open it, and start it when `begin` is called; until then it sends nothing.
        """
        with self._state_lock:
            if self.active:
                return
            self._stop.clear()
            self._settled.clear()
            self._begin.set()
            if held:
                self._begin.clear()
            self._opened = self._finished = self._over = False
            self._fault = None
            self._thread = threading.Thread(target=self._run, name=f"phalanx-receiver-{self.key}", daemon=True)
            self._thread.start()

    def begin(self) -> None:
        """Start a device that is held."""
        self._begin.set()

    def disconnect(self) -> None:
        """Ask the receiver to stop; `join` waits for it."""
        self._stop.set()

    def join(self, timeout_s: float | None = None) -> bool:
        """Wait until the receiver has given everything back; False if it has not in time."""
        thread = self._thread
        if thread is not None:
            thread.join(timeout_s)
        return thread is None or not thread.is_alive()

    def wait_connected(self, timeout_s: float) -> None:
        """Wait until the device streams. Raises the DeviceError that opening gave, or one for the time that passed."""
        if not self._settled.wait(timeout_s):
            raise DeviceError(f"{self.title} did not answer within {timeout_s:g} s.", "Check that it is running.")
        if self._fault is not None:
            raise self._fault

    # The receiver thread.

    def _run(self) -> None:
        try:
            self._drive(self._device)
        finally:
            self._settled.set()
            self._over = True
            self._on_armed(self)

    def _drive(self, device: Device) -> None:
        while not self._stop.is_set():
            try:
                device.open()
                if not self._wait_to_begin(device):
                    return
                device.start()
            except Exception as error:
                self._close(device)
                self._fail(error, "Opening")
                if not self._opened:
                    return
                self._stop.wait(REOPEN_S)
                continue
            if not self._opened:
                self._arm(device)
                for text in device.warnings:
                    self._on_warning(self, text)
            else:
                self._hear(device)
            self._fault = None
            self._settled.set()
            try:
                self._receive(device)
                self._finished = device.finished
                return
            except Exception as error:  # against its contract: say so, and have the stream back
                self._fail(error, "Reading")
                self._stop.wait(REOPEN_S)
            finally:
                self._close(device)

    def _wait_to_begin(self, device: Device) -> bool:
        """False if it is disconnected before that; it is closed then."""
        if not self._begin.is_set():
            self._arm(device)
            self._settled.set()
        while not self._begin.wait(READ_S):
            if self._stop.is_set():
                self._close(device)
                return False
        return True

    def _arm(self, device: Device) -> None:
        """It is open, and what it sends is known."""
        self._received.clear()
        self._refusals.clear()
        self._hear(device)
        self._before = {"": self.counted(), **{own: self.counted(info.key) for own, info in self._streams.items()}}
        self.connected_s = host_clock()
        self._opened = True
        self._on_armed(self)

    def _hear(self, device: Device) -> None:
        """What the device says of its streams; a rate may come to be known, or change, while it is connected."""
        if said := device.streams():
            self._streams = {one.key: replace(one, key=f"{self.key}/{one.key}") for one in said}

    def _take(self, sample: Sample) -> None:
        own, frame = sample
        stream = self._streams.get(own)
        if stream is not None and type(frame) is _FRAMES[stream.what]:
            self._received[own] += 1
        elif stream is None or type(frame) is not ClockSample:
            self._refuse(own, type(frame).__name__)
            return
        self._on_sample(self, Sample(stream.key, frame))

    def _refuse(self, own: str, name: str) -> None:
        """Of no stream that is known, or not what the stream has."""
        stream, what = own if own in self._streams else "", f"{name} as {own!r}"
        self._refused[stream] += 1
        if len(self._refusals) < _MOST_REFUSALS and (stream, what) not in self._refusals:
            known = ", ".join(f"{one.what} as {key!r}" for key, one in self._streams.items()) or "nothing"
            why = self._refusals[stream, what] = f"it sent {what}, and said that it sends {known}"
            fault = f"Samples of {self.title} are refused: {why}."
            self._on_error(self, DeviceError(fault, "They are not recorded. Its driver is at fault: please report it."))

    def _receive(self, device: Device) -> None:
        told, look_at_s = len(device.health().standstills), host_clock()
        while not self._stop.is_set() and not device.finished:
            sample = device.read(READ_S)
            if sample is not None:
                self._take(sample)
            if (now_s := host_clock()) >= look_at_s:
                look_at_s = now_s + LOOK_S
                self._hear(device)
                standstills = device.health().standstills
                for one in standstills[told:]:
                    self._on_standstill(self, one)
                told = len(standstills)

    def _close(self, device: Device) -> None:
        for end in (device.stop, device.close):
            try:
                end()
            except Exception:
                LOG.exception("Closing %s", self.title)

    def _fail(self, error: Exception, doing: str) -> None:
        if isinstance(error, PhalanxError):
            self._fault = error
        else:
            self._fault = DeviceError(
                f"{doing} {self.title} failed: {str(error) or type(error).__name__}.",
                "It is tried again; if this stays, disconnect and connect, and see the log file.",
            )
            self._fault.__cause__ = error
        self._on_error(self, self._fault)
