"""The simulator contract, the twin of a device: a server that speaks as a kind of system does, for tests and the demo.

A simulator is handed frames and sends them on the real wire at their rate, on a thread of its own. It is safe to use
from any thread, and to build in a process of its own: nothing is shared.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from types import TracebackType
from typing import ClassVar, Generic, Self, TypeVar

from core.errors import DeviceError, PhalanxError
from core.frames import InertialFrame, MarkerFrame
from core.streams import What
from devices.common.clock import host_clock
from devices.parameter import Parameter, Value, checked

SLIP_S = 0.25
"""Later than this the schedule is moved instead of sending the backlog at once [s]."""

F = TypeVar("F", bound=MarkerFrame | InertialFrame)


class Simulator(ABC, Generic[F]):
    """Sends frames as a system of one kind does. Subclasses take what `parameters` declare as keywords of their own.

    frames: what to send; each frame's `sequence` is its number on the wire, and where the frames begin anew (`loop`)
        the numbers go on.
    sent: frames sent, to however many clients. unsent: packets that the network refused. slipped: times the schedule
        was moved because this machine was busy for longer than SLIP_S. error: why sending ended early, if it did.

    `open` takes what it serves on and answers clients, `start` begins to send.
    """

    title: ClassVar[str]
    """What it is like, for people ("a server like OptiTrack Motive")."""
    manner: ClassVar[str]
    """How it sends, in a sentence."""
    what: ClassVar[What]
    """Which frames it takes."""
    parameters: ClassVar[tuple[Parameter, ...]]
    """Where and how it serves."""
    anywhere: ClassVar[Mapping[str, Value]]
    """Of the parameters, those with which it serves on this machine alone, wherever there is room."""

    def __init__(self, frames: Iterable[F], rate_hz: float, *, loop: bool = False) -> None:
        """Raises DeviceError for a rate that no system has."""
        if not 0 < rate_hz <= 10_000:
            raise DeviceError(f"A rate of {rate_hz} Hz cannot be simulated.", "Choose up to 10000 Hz.")
        self.rate_hz = rate_hz
        self.loop = loop
        self.sent = 0
        self.unsent = 0
        self.slipped = 0
        self.error: PhalanxError | None = None
        self._frames = frames
        self._stopping = threading.Event()
        self._done = threading.Event()
        self._sender: threading.Thread | None = None

    @classmethod
    def of(
        cls, frames: Iterable[F], rate_hz: float, settings: Mapping[str, object], *, loop: bool = False, name: str = ""
    ) -> Self:
        """One with these settings of its parameters, and the defaults of the others. Raises DeviceError.

        name: what it calls itself, "" for what such a system does.
        """
        own: dict[str, object] = {**checked(cls.parameters, settings, cls.title), **({"name": name} if name else {})}
        return cls(frames, rate_hz, loop=loop, **own)

    @property
    @abstractmethod
    def settings(self) -> dict[str, Value]:
        """Those of a device of its kind that open it, once it is open itself."""

    @property
    @abstractmethod
    def place(self) -> str:
        """How and where it serves, for people, once it is open."""

    @property
    @abstractmethod
    def audience(self) -> str:
        """Whom it sends to, for people."""

    @abstractmethod
    def open(self) -> None:
        """Take ports or lines and answer clients; nothing happens if it is open. Raises DeviceError if it cannot."""

    @abstractmethod
    def _close(self) -> None:
        """Give them back, without a word to the clients: as a server that was killed. May be called twice."""

    @abstractmethod
    def _send(self, number: int, frame: F, exposed_s: float) -> None:
        """Send one frame under this number, taken at `exposed_s` by the host clock, to whoever listens. Raises
        PhalanxError for one that cannot be sent."""

    def start(self) -> None:
        """Send from the first frame on; opens if needed. Raises DeviceError."""
        self.open()
        self.stop()
        self._stopping.clear()
        self._done.clear()
        self._sender = threading.Thread(target=self._run, name=f"{type(self).__name__} frames", daemon=True)
        self._sender.start()

    def stop(self) -> None:
        """Send no more frames; go on answering."""
        self._stopping.set()
        if self._sender is not None:
            self._sender.join()
            self._sender = None

    def close(self) -> None:
        """Stop, and give everything back."""
        self.stop()
        self._close()

    def wait(self, timeout_s: float | None = None) -> bool:
        """Wait until the last frame was sent; False if the time was over first."""
        return self._done.wait(timeout_s)

    @property
    def finished(self) -> bool:
        """Whether the last frame was sent, or sending ended with `error`."""
        return self._done.is_set()

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # ---- the thread that sends

    def _run(self) -> None:
        try:
            self._stream()
        except PhalanxError as error:
            self.error = error
        except Exception as error:  # the frames are made by others; their fault must be told, not lost with a thread
            self.error = DeviceError(f"The frames to be sent failed: {type(error).__name__}: {error}.")
        finally:
            self._done.set()

    def _stream(self) -> None:
        period = 1.0 / self.rate_hz
        begin = host_clock()
        for count, (number, frame) in enumerate(self._numbered()):
            due = begin + count * period
            while (wait := due - host_clock()) > 0:
                if self._stopping.wait(wait):
                    return
            if self._stopping.is_set():
                return
            if -wait > SLIP_S:
                begin -= wait
                due -= wait
                self.slipped += 1
            self._send(number, frame, due)
            self.sent += 1

    def _numbered(self) -> Iterator[tuple[int, F]]:
        """Frames and ever-increasing numbers."""
        offset, last = 0, -1
        while True:
            any_sent = False
            for frame in self._frames:
                if any_sent is False and frame.sequence + offset <= last:
                    offset = last + 1 - frame.sequence
                any_sent = True
                last = max(last, frame.sequence + offset)
                yield frame.sequence + offset, frame
            if not (self.loop and any_sent):
                return
