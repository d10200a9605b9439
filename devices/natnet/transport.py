"""The sockets of a NatNet client: one for commands, one for multicast frames; datagrams with their arrival times."""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import math
import selectors
import socket
import struct
import sys
import threading
import time
from collections import deque
from typing import NamedTuple

from core.errors import DeviceError
from devices.stream import host_clock

RECEIVE_BUFFER = 4 << 20
"""Bytes of kernel buffer asked for: a second of frames while this process does something else."""

# Not named by the socket module; Linux on x86 and ARM.
_SO_TIMESTAMPNS = 35
_SO_RCVBUFFORCE = 33
_IP_MULTICAST_ALL = 49
_TIMESPEC = struct.Struct("@ll")
_LARGEST = 65535
_UNINTERRUPTED_S = 20e-6


class Datagram(NamedTuple):
    """One datagram. arrival_s: host clock, by the kernel's stamp where it gives one. command: on that socket."""

    data: bytes
    address: str
    arrival_s: float
    command: bool = True


def resolve(host: str, timeout_s: float = 3.0) -> str:
    """The IPv4 address of a host name. Raises DeviceError."""
    host = host.strip()
    try:
        return str(ipaddress.IPv4Address(host))
    except ValueError:
        if not host or all(part.isdecimal() for part in host.split(".")):
            raise DeviceError(f"{host!r} is no IPv4 address.", "Write it like 192.168.0.10.") from None
    addresses = _look_up(host, timeout_s)
    if not addresses:
        raise DeviceError(f"No computer called {host!r} is known here.", "Write its IPv4 address, like 192.168.0.10.")
    return addresses[0]


def _look_up(host: str, timeout_s: float) -> list[str]:
    """IPv4 addresses of a name. A name server that does not answer can hold a look-up for half a minute."""
    answers: list[str] = []

    def ask() -> None:
        with contextlib.suppress(OSError, UnicodeError):
            answers.extend(socket.gethostbyname_ex(host)[2])

    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    thread.join(timeout_s)
    return list(answers)


def is_multicast(address: str) -> bool:
    """Whether `address` is an IPv4 multicast group."""
    with contextlib.suppress(ValueError):
        return ipaddress.IPv4Address(address).is_multicast
    return False


def local_addresses(towards: str = "192.0.2.1") -> list[str]:
    """IPv4 addresses of this machine, as far as they can be learnt without asking each interface."""
    found = [*_look_up(socket.gethostname(), 1.0), route_to(towards), "127.0.0.1"]
    return [address for address in dict.fromkeys(found) if address and address != "0.0.0.0"]


def route_to(address: str) -> str:
    """The local address from which `address` is reached, "" if there is no route."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((address, 9))  # sends nothing
            name: str = probe.getsockname()[0]
        except OSError:
            return ""
    return name


class Transport:
    """Sockets and what arrives on them. Used by one thread."""

    def __init__(self, local: str) -> None:
        """`local`: address of the interface to use, "" for any. Raises DeviceError if it is not of this machine."""
        self.local = local
        self.granted_buffer = 0
        self._selector = selectors.DefaultSelector()
        self._ready: deque[socket.socket] = deque()
        self._memberships: list[tuple[socket.socket, bytes]] = []
        self.command = self._new()
        self.data: socket.socket | None = None
        try:
            self.command.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            self.command.bind((local, 0))
        except OSError as error:
            self.close()
            raise _wrong_interface(local, error) from error

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

    def listen(self, port: int) -> None:
        """Take the data port as well. Raises DeviceError if another program holds it."""
        made = self._new()
        try:
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if sys.platform == "darwin":
                made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            if sys.platform == "linux":  # only groups joined here, not those of other programs on this port
                made.setsockopt(socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0)
            made.bind(("", port))
        except OSError as error:
            self._selector.unregister(made)
            made.close()
            raise DeviceError(
                f"The data port {port} is in use by another program on this machine ({error.strerror}).",
                "Close other programs that receive NatNet, or choose another data port here and in the server.",
            ) from error
        self.data = made

    def join(self, group: str, interfaces: list[str]) -> None:
        """Receive a multicast group on the given interfaces. Raises DeviceError if none of them can."""
        assert self.data is not None
        last: OSError | None = None
        for interface in interfaces:
            request = socket.inet_aton(group) + socket.inet_aton(interface)
            try:
                self.data.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, request)
                self._memberships.append((self.data, request))
            except OSError as error:
                last = error
        if not self._memberships and last is not None:
            if last.errno in (errno.EADDRNOTAVAIL, errno.ENODEV):
                raise _wrong_interface(", ".join(interfaces), last) from last
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
        """Send from the command socket. Raises OSError."""
        self.command.sendto(packet, (address, port))

    def receive(self, timeout_s: float) -> Datagram | None:
        """The next datagram, waiting at most `timeout_s`. Raises OSError if a socket has failed."""
        if not self._ready:
            self._ready.extend(key.fileobj for key, _ in self._selector.select(max(0.0, timeout_s)))  # type: ignore[misc]
        while self._ready:
            ready = self._ready.popleft()
            try:
                data, address, arrival_s = _receive(ready)
                return Datagram(data, address, arrival_s, ready is self.command)
            except (BlockingIOError, ConnectionError):
                # Windows reports that an earlier datagram of ours met a closed port.
                continue
        return None

    def drain(self) -> int:
        """Throw away what waits in the sockets; how many datagrams."""
        n = 0
        while self.receive(0.0) is not None and n < 100_000:
            n += 1
        return n

    def close(self) -> None:
        """Give the sockets back."""
        self._ready.clear()
        for key in list(self._selector.get_map().values()):
            self._selector.unregister(key.fileobj)
            key.fileobj.close()  # type: ignore[union-attr]
        self._selector.close()


def _receive_plain(ready: socket.socket) -> tuple[bytes, str, float]:
    """Data, sender, and the time at which this process came to read it."""
    data, address = ready.recvfrom(_LARGEST)
    return data, address[0], host_clock()


def _receive_stamped(ready: socket.socket) -> tuple[bytes, str, float]:
    """Data, sender, and the time at which the kernel had it, however late this process came to read it."""
    data, extra, _, address = ready.recvmsg(_LARGEST, 64)
    now = host_clock()
    for level, kind, stamp in extra:
        if level == socket.SOL_SOCKET and kind == _SO_TIMESTAMPNS and len(stamp) == _TIMESPEC.size:
            seconds, nanoseconds = _TIMESPEC.unpack(stamp)
            arrival = _from_wall_clock(seconds * 1_000_000_000 + nanoseconds)
            if now - 10.0 < arrival <= now:  # else the wall clock was set meanwhile
                now = arrival
    return data, address[0], now


def _from_wall_clock(wall_ns: int) -> float:
    """A recent time of the wall clock, by the host clock [s]."""
    best, offset = math.inf, 0.0
    for _ in range(3):
        before = host_clock()
        age = (time.time_ns() - wall_ns) * 1e-9
        took = host_clock() - before
        if took < best:
            best, offset = took, before + took / 2 - age
        if best < _UNINTERRUPTED_S:
            break  # no other thread ran between the two clocks
    return offset


_receive = _receive_stamped if sys.platform == "linux" else _receive_plain


def _enlarge(made: socket.socket) -> None:
    """Ask for a large buffer: past the limit with the rights for it, else as Linux cuts it and macOS refuses it."""
    options = [(_SO_RCVBUFFORCE, RECEIVE_BUFFER)] if sys.platform == "linux" else []
    options += [(socket.SO_RCVBUF, size) for size in (RECEIVE_BUFFER, RECEIVE_BUFFER // 2, RECEIVE_BUFFER // 4)]
    for option, size in options:
        with contextlib.suppress(OSError):
            made.setsockopt(socket.SOL_SOCKET, option, size)
            return


def _wrong_interface(local: str, error: OSError) -> DeviceError:
    if error.errno in (errno.EADDRNOTAVAIL, errno.ENODEV) or getattr(error, "winerror", 0) == 10049:
        return DeviceError(
            f"The local interface {local} is not an address of this machine.",
            "Choose one of " + ", ".join(local_addresses()) + ", or leave it empty.",
        )
    return DeviceError(f"No socket can be opened on {local or 'any interface'} ({error.strerror}).", "")
