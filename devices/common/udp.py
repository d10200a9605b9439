"""UDP sockets of a device: one that speaks, and maybe one that listens; datagrams with the times of their arrival."""

from __future__ import annotations

import contextlib
import errno
import selectors
import socket
import struct
import sys
from collections import deque
from typing import NamedTuple

from core.errors import DeviceError
from devices.common.addresses import local_addresses
from devices.common.clock import host_clock
from devices.common.stamps import Stamps, Unstamped

RECEIVE_BUFFER = 4 << 20
"""Bytes of kernel buffer asked for: a second of frames while this process does something else."""

# Not named by the socket module; Linux on x86 and ARM.
_SO_TIMESTAMPNS = 35
_SO_RCVBUFFORCE = 33
_IP_MULTICAST_ALL = 49
_TIMESPEC = struct.Struct("@ll")
_LARGEST = 65535


class Datagram(NamedTuple):
    """One datagram.

    arrival_s: host clock, by the kernel's stamp where it gives one. spoken: to the socket that speaks, as answers are.
    port: it was sent from. slack_s: it may have arrived so much before arrival_s, 0 where that is known.
    """

    data: bytes
    address: str
    arrival_s: float
    spoken: bool = True
    port: int = 0
    slack_s: float = 0.0


class Udp:
    """Sockets and what arrives on them. Used by one thread.

    speaking: sends, and has what comes in answer. listening: takes what is sent to one port, None until `listen`.
    """

    def __init__(self, local: str, port: int = 0, *, follows: bool = False) -> None:
        """Raises DeviceError if the address is not of this machine, or the port is taken.

        local: address of the interface to use, "" for any. port: to speak from, 0 for any.
        follows: it was not chosen but is on the way to whom is spoken with, and may be another later.
        """
        self.local, self._port = local, port
        self.follows = follows
        self.granted_buffer = 0
        self._selector = selectors.DefaultSelector()
        self._ready: deque[socket.socket] = deque()
        self._memberships: list[tuple[socket.socket, bytes]] = []
        self._stamps, self._unstamped = Stamps(), Unstamped()
        self.speaking = self._new()
        self.listening: socket.socket | None = None
        try:
            self._bind()
        except OSError as error:
            self.close()
            raise _not_bound(local, port, error) from error

    def _bind(self) -> None:
        self.speaking.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self.speaking.bind((self.local, self._port))

    def move(self, local: str) -> None:
        """Speak from another address: this machine has another one now, or has another way out.

        Raises OSError; all is then as it was.
        """
        old, before = self.speaking, self.local
        self.speaking, self.local = self._new(), local
        try:
            self._bind()
        except OSError:
            self._discard(self.speaking)
            self.speaking, self.local = old, before
            raise
        self._discard(old)
        interfaces = {socket.inet_aton(before): socket.inet_aton(local)} if before else {}
        self._memberships = [
            (joined, request[:4] + interfaces.get(request[4:], request[4:])) for joined, request in self._memberships
        ]

    def _new(self) -> socket.socket:
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.setblocking(False)
        _enlarge(made)
        granted = made.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
        # Linux reports twice what it grants, for its own book-keeping.
        self.granted_buffer = granted // 2 if sys.platform == "linux" else granted
        if sys.platform == "linux":
            made.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        self._selector.register(made, selectors.EVENT_READ)
        return made

    def _discard(self, old: socket.socket) -> None:
        self._selector.unregister(old)
        with contextlib.suppress(ValueError):
            self._ready.remove(old)
        old.close()

    def listen(self, port: int, what: str, local: str = "") -> None:
        """Take a port as well, of one address or of all. Raises DeviceError if another program holds it.

        what: comes in there, for people ("NatNet").
        """
        made = self._new()
        try:
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if sys.platform == "darwin":
                made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            if sys.platform == "linux":  # only groups joined here, not those of other programs on this port
                made.setsockopt(socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0)
            made.bind((local, port))
        except OSError as error:
            self._selector.unregister(made)
            made.close()
            raise DeviceError(
                f"The data port {port} is in use by another program on this machine ({error.strerror}).",
                f"Close other programs that receive {what}, or choose another data port here and in the server.",
            ) from error
        self.listening = made

    def join(self, group: str, interfaces: list[str]) -> None:
        """Receive a multicast group on the given interfaces. Raises DeviceError if none of them can."""
        assert self.listening is not None
        last: OSError | None = None
        for interface in interfaces:
            request = socket.inet_aton(group) + socket.inet_aton(interface)
            try:
                self.listening.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, request)
                self._memberships.append((self.listening, request))
            except OSError as error:
                last = error
        if not self._memberships and last is not None:
            if last.errno in (errno.EADDRNOTAVAIL, errno.ENODEV):
                raise _not_bound(", ".join(interfaces), 0, last) from last
            raise DeviceError(
                f"The multicast group {group} cannot be joined on {', '.join(interfaces)} ({last.strerror}).",
                "Choose another local interface, or unicast.",
            ) from last

    def rejoin(self) -> None:
        """Join again: an interface that was down has forgotten."""
        for joined, request in self._memberships:
            for option in (socket.IP_DROP_MEMBERSHIP, socket.IP_ADD_MEMBERSHIP):
                with contextlib.suppress(OSError):  # the interface is still down; the next attempt comes
                    joined.setsockopt(socket.IPPROTO_IP, option, request)

    def send(self, packet: bytes, address: str, port: int) -> None:
        """Send from the socket that speaks. Raises OSError."""
        self.speaking.sendto(packet, (address, port))

    def receive(self, timeout_s: float) -> Datagram | None:
        """The next datagram, waiting at most `timeout_s`. Raises OSError if a socket has failed."""
        if not self._ready:
            self._wait(max(0.0, timeout_s))
        while self._ready:
            ready = self._ready.popleft()
            try:
                data, stamp, (address, port) = _receive(ready)
            except (BlockingIOError, ConnectionError):
                # Windows reports that an earlier datagram of ours met a closed port.
                continue
            came = self._stamps.arrival(stamp) if stamp is not None else self._unstamped.arrival()
            return Datagram(data, address, came.latest_s, ready is self.speaking, port, came.slack_s)
        return None

    def _wait(self, timeout_s: float) -> None:
        asked = host_clock()
        found = self._selector.select(0)
        if not found:
            self._unstamped.emptied(asked)
            self._stamps.emptied(asked)
            found = self._selector.select(timeout_s)
        self._ready.extend(key.fileobj for key, _ in found)  # type: ignore[misc]

    def drain(self) -> int:
        """Throw away what waits in the sockets; how many datagrams."""
        n = 0
        while self.receive(0.0) is not None and n < 100_000:
            n += 1
        return n

    @property
    def small_buffer(self) -> str:
        """What to say of a kernel buffer smaller than was asked for; else ""."""
        if self.granted_buffer >= RECEIVE_BUFFER:
            return ""
        return (
            f"this machine grants a buffer of {self.granted_buffer >> 10} kB instead of {RECEIVE_BUFFER >> 10}: frames "
            f"may be lost while it is busy. Linux: sysctl -w net.core.rmem_max={RECEIVE_BUFFER}"
        )

    def close(self) -> None:
        """Give the sockets back."""
        self._ready.clear()
        for key in list(self._selector.get_map().values()):
            self._selector.unregister(key.fileobj)
            key.fileobj.close()  # type: ignore[union-attr]
        self._selector.close()


def _receive_plain(ready: socket.socket) -> tuple[bytes, int | None, tuple[str, int]]:
    """Data, no stamp, sender."""
    data, address = ready.recvfrom(_LARGEST)
    return data, None, address


def _receive_stamped(ready: socket.socket) -> tuple[bytes, int | None, tuple[str, int]]:
    """Data, when the kernel had it by the wall clock [ns], however late this process came to read it, and sender."""
    data, extra, _, address = ready.recvmsg(_LARGEST, 64)
    for level, kind, stamp in extra:
        if level == socket.SOL_SOCKET and kind == _SO_TIMESTAMPNS and len(stamp) == _TIMESPEC.size:
            seconds, nanoseconds = _TIMESPEC.unpack(stamp)
            return data, seconds * 1_000_000_000 + nanoseconds, address
    return data, None, address


_receive = _receive_stamped if sys.platform == "linux" else _receive_plain


def _enlarge(made: socket.socket) -> None:
    """Ask for a large buffer: past the limit with the rights for it, else as Linux cuts it and macOS refuses it."""
    options = [(_SO_RCVBUFFORCE, RECEIVE_BUFFER)] if sys.platform == "linux" else []
    options += [(socket.SO_RCVBUF, size) for size in (RECEIVE_BUFFER, RECEIVE_BUFFER // 2, RECEIVE_BUFFER // 4)]
    for option, size in options:
        with contextlib.suppress(OSError):
            made.setsockopt(socket.SOL_SOCKET, option, size)
            return


def _not_bound(local: str, port: int, error: OSError) -> DeviceError:
    if error.errno in (errno.EADDRNOTAVAIL, errno.ENODEV) or getattr(error, "winerror", 0) == 10049:
        return DeviceError(
            f"The local interface {local} is not an address of this machine.",
            "Choose one of " + ", ".join(local_addresses()) + ", or leave it empty.",
        )
    at = f"{local or 'any interface'}, port {port}" if port else local or "any interface"
    advice = "Choose another port, or end the program that holds it." if port else "Choose another local interface."
    return DeviceError(f"No socket can be opened on {at} ({error.strerror}).", advice)
