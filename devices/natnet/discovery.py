"""Which NatNet servers there are, and what they are called."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

from core.errors import DeviceError, FormatError
from core.printable import named
from devices.common.addresses import local_addresses
from devices.common.clock import host_clock
from devices.common.udp import Datagram, Udp
from devices.device import Found
from devices.natnet import protocol
from devices.natnet.conversation import DISCOVERY
from devices.natnet.protocol import Message, ServerInfo


def discover(timeout_s: float) -> tuple[Found, ...]:
    """Servers that answer a broadcast on any interface of this machine, on the usual command port."""
    found: dict[str, Found] = {}
    with contextlib.ExitStack() as closing:
        everywhere: list[Udp] = []
        for local in local_addresses():
            with contextlib.suppress(DeviceError):
                everywhere.append(Udp(local))
                closing.callback(everywhere[-1].close)
        for sockets in everywhere:
            net = sockets.local.rpartition(".")[0]
            for target in (sockets.local,) if net == "127.0.0" else ("255.255.255.255", f"{net}.255"):
                with contextlib.suppress(OSError):  # this interface reaches nobody
                    sockets.send(DISCOVERY, target, protocol.COMMAND_PORT)
        end = host_clock() + timeout_s
        while everywhere and host_clock() < end:
            for sockets in everywhere:
                datagram = sockets.receive(min(0.02, timeout_s))
                info = _server_info(datagram) if datagram else None
                if datagram and info:
                    title = f"{application(info)} at {datagram.address}"
                    settings = {"server": datagram.address, "local": sockets.local}
                    found.setdefault(datagram.address, Found(title, settings))
    return tuple(found.values())


def application(info: ServerInfo) -> str:
    """Name and version of the server's application; one without a name is called so."""
    return f"{named(info.sender.name, 'Unnamed server')} {dotted(info.sender.app_version)}"


def dotted(version: Sequence[int]) -> str:
    """Major and minor."""
    return f"{version[0]}.{version[1]}"


def _server_info(datagram: Datagram) -> ServerInfo | None:
    with contextlib.suppress(FormatError):
        message, payload = protocol.unpack(datagram.data)
        if message == Message.SERVERINFO:
            return protocol.decode_server_info(payload)
    return None
