"""IPv4 addresses: of names, of this machine, and on the way to another."""

from __future__ import annotations

import contextlib
import ipaddress
import socket
import threading

from core.errors import DeviceError


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
