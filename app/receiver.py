"""A device in the session: its settings, and the one thread that drives it while it is connected."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping

from core.errors import DeviceError, PhalanxError
from core.frames import Standstill
from core.streams import Sample
from devices.common.clock import host_clock
from devices.device import Description, Device, Health, Level, Value

LOG = logging.getLogger("phalanx")
READ_S = 0.1
REOPEN_S = 1.0
LOOK_S = 0.25
"""How often it is looked whether this program stood still."""


class Receiver:
    """One configured device. `connect` and `disconnect` return at once; the receiver thread does the work.

    on_sample: called on the receiver thread for every sample. on_error: for what an operator must know. on_warning: for
    what connecting found amiss and went on without. on_standstill: this program stood still for a while and runs again.
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
    ) -> None:
        """Raises DeviceError for a setting that does not exist or is out of range."""
        self.number = number
        self.device_class = device_class
        self._device = device_class(**settings)
        self._custom_title = title
        self._on_sample, self._on_error, self._on_warning = on_sample, on_error, on_warning
        self._on_standstill = on_standstill
        self._stop = threading.Event()
        self._settled = threading.Event()
        self._settled.set()
        self._begin = threading.Event()
        self._begin.set()
        self._thread: threading.Thread | None = None
        self._state_lock = threading.Lock()
        self._opened = False
        self._finished = False
        self._before = Health()
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
        return self._thread is not None and self._thread.is_alive()

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

    def describe(self) -> Description:
        """What the device says of itself."""
        return self._device.describe()

    def health(self) -> Health:
        """The light and its reason, now; what was lost since it was connected."""
        if self.opening:
            return Health(Level.WARNING, "Connecting…")
        if self._fault is not None:
            return Health(Level.PROBLEM, str(self._fault), last_error=self._fault.what)
        if not self.active:
            reason = "Played to its end. Connect to play it again." if self._finished else "Not connected."
            return Health(Level.IDLE, reason)
        return self._device.health().since(self._before)

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
            self._opened = self._finished = False
            self._fault = None
            self._thread = threading.Thread(
                target=self._run, name=f"phalanx-receiver-{self.device_class.kind}-{self.number}", daemon=True
            )
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
        return not self.active

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
                self._before = device.health()
                for text in device.warnings:
                    self._on_warning(self, text)
            self._opened = True
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
            self._before = device.health()
            self._opened = True
            self._settled.set()
        while not self._begin.wait(READ_S):
            if self._stop.is_set():
                self._close(device)
                return False
        return True

    def _receive(self, device: Device) -> None:
        told, look_at_s = len(device.health().standstills), host_clock()
        while not self._stop.is_set() and not device.finished:
            sample = device.read(READ_S)
            if sample is not None:
                self._on_sample(self, sample)
            if (now_s := host_clock()) >= look_at_s:
                look_at_s = now_s + LOOK_S
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
