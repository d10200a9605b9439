"""A serial port, or what pyserial makes look like one (socket://host:port, rfc2217://host:port): bytes as they come.

It is held by one thread. A port that is pulled out in mid-session is tried again until it is back.
"""

from __future__ import annotations

import contextlib
import errno
import select
import time
from typing import NamedTuple

import serial
from serial.tools import list_ports

from core.errors import DeviceError
from core.printable import printable
from devices.common.clock import host_clock
from devices.common.stamps import Unstamped

MOST_BYTES = 1 << 16
"""Handed on at once. What waits beyond stays where it is: in the port's own buffer, which the system bounds."""

REOPEN_S = 1.0
"""How often a port that is gone is looked for [s]."""

WRITE_S = 1.0
"""How long a port may take nothing of what is sent [s]."""

_TURN_S = 0.02
"""Where the system cannot wait for a port, one byte is waited for so long at a time [s]."""

_GONE, _TAKEN, _FORBIDDEN = (errno.ENOENT, errno.ENODEV, errno.ENXIO), (errno.EAGAIN, errno.EBUSY), (errno.EACCES,)


class Bytes(NamedTuple):
    """What came. arrival_s: when it was read, host clock; it may have come so much before as slack_s, 0 where it did
    not wait."""

    data: bytes
    arrival_s: float
    slack_s: float


def serial_ports() -> tuple[str, ...]:
    """The ports that this machine has now: a `Parameter.choices`."""
    return tuple(sorted(printable(port.device) for port in list_ports.comports()))


class SerialLine:
    """One port, exclusively. Used by one thread; attributes are read by any.

    lost_since_s: when it went, host clock; None while it is there. reconnects: times it came back. last_error: why it
    went, or cannot be opened again.
    """

    def __init__(self, port: str, baud: int) -> None:
        """port: its name, or a URL of pyserial's. baud: bits per second."""
        self.port, self.baud = port, baud
        self.lost_since_s: float | None = None
        self.reconnects = 0
        self.last_error = ""
        self._line: serial.SerialBase | None = None
        self._descriptor = -1  # what the system waits for, -1 where it cannot
        self._unstamped = Unstamped()
        self._look_s = 0.0

    def open(self) -> None:
        """Take the port. Raises DeviceError: it is not there, another program holds it, or this user may not."""
        self.close()
        self.lost_since_s = None
        self._open()

    def _open(self) -> None:
        try:
            line = serial.serial_for_url(self.port, self.baud, timeout=0, write_timeout=WRITE_S, exclusive=True)
        except (OSError, ValueError) as error:
            raise _not_opened(self.port, self.baud, error) from error
        try:
            self._descriptor = line.fileno()
        except (OSError, AttributeError):  # Windows, a remote port, loop://
            self._descriptor = -1
            line.timeout = _TURN_S
        self._line = line
        self._unstamped.emptied(host_clock())

    def read(self, timeout_s: float) -> Bytes | None:
        """What has come, up to MOST_BYTES, waiting at most `timeout_s` for the first of it; None if nothing came, or
        the port is gone. Never raises."""
        if self._line is None and not self._back(timeout_s):
            return None
        try:
            data = self._waited(timeout_s)
        except (OSError, TypeError, ValueError) as error:  # pyserial's own, and what it does with a port that went
            self._lose(error)
            return None
        return Bytes(data, *self._unstamped.arrival()) if data else None

    def write(self, data: bytes) -> bool:
        """Send; False if the port is gone, or has taken nothing for WRITE_S. Never raises."""
        if self._line is None:
            return False
        try:
            self._line.write(data)
        except serial.SerialTimeoutException:
            self.last_error = f"{self.port} takes no more bytes: nobody reads them."
            return False
        except (OSError, TypeError, ValueError) as error:
            self._lose(error)
            return False
        return True

    def drain(self) -> None:
        """Throw away what waits."""
        end = host_clock() + 1.0
        while self._line is not None and host_clock() < end and self.read(0.0) is not None:
            pass

    def close(self) -> None:
        """Give the port back."""
        line, self._line = self._line, None
        if line is not None:
            with contextlib.suppress(OSError, TypeError, ValueError):
                line.close()

    def _waited(self, timeout_s: float) -> bytes:
        line = self._line
        assert line is not None
        if self._descriptor < 0:
            return self._in_turns(line, timeout_s)
        asked_s = host_clock()
        if not select.select([self._descriptor], [], [], 0.0)[0]:
            self._unstamped.emptied(asked_s)
            if not select.select([self._descriptor], [], [], max(timeout_s, 0.0))[0]:
                return b""
        return bytes(line.read(MOST_BYTES))  # what is there: it is not waited for more

    def _in_turns(self, line: serial.SerialBase, timeout_s: float) -> bytes:
        end = host_clock() + timeout_s
        while True:
            asked_s = host_clock()
            if not line.in_waiting:
                self._unstamped.emptied(asked_s)
            first = bytes(line.read(1))
            if first:
                return first + bytes(line.read(min(line.in_waiting, MOST_BYTES - 1)))
            if host_clock() >= end:
                return b""

    def _lose(self, error: Exception) -> None:
        self.close()
        self.last_error = f"{self.port} went away: {_reason(error)}."
        self.lost_since_s = host_clock()
        self._look_s = self.lost_since_s + REOPEN_S

    def _back(self, timeout_s: float) -> bool:
        """Whether a port that went is there again, waiting at most `timeout_s` until it may be looked for."""
        if self.lost_since_s is None:
            return False  # it is not open
        wait_s = self._look_s - host_clock()
        if wait_s > 0:
            time.sleep(min(wait_s, max(timeout_s, 0.0)))
            return False
        self._look_s = host_clock() + REOPEN_S
        try:
            self._open()
        except DeviceError as error:
            self.last_error = str(error)
            return False
        self.lost_since_s = None
        self.reconnects += 1
        return True


def _not_opened(port: str, baud: int, error: Exception) -> DeviceError:
    number = getattr(error, "errno", None)
    there = serial_ports()
    others = "There are: " + ", ".join(there) + "." if there else "This machine has no serial port now."
    text = str(error).lower()
    if number in _GONE or "filenotfound" in text:
        return DeviceError(f"There is no serial port {port}.", f"Plug it in, or choose another. {others}")
    if number in _TAKEN or "permissionerror" in text:  # so does Windows say it
        return DeviceError(f"The serial port {port} is held by another program.", "Close that, and connect again.")
    if number in _FORBIDDEN:
        return DeviceError(
            f"This user may not open the serial port {port}.",
            "On Linux: sudo usermod -aG dialout $USER, then log in anew.",
        )
    return DeviceError(f"The serial port {port} cannot be opened at {baud} baud ({_reason(error)}).", others)


def _reason(error: Exception) -> str:
    return str(error).rstrip(".") or type(error).__name__
