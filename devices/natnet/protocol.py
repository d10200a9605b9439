"""NatNet, the wire format of OptiTrack Motive: packets and the messages of the command channel.

Bytes to records and back, no input or output. Frames are in `frames`, model definitions in `models`.
Source: NatNet SDK headers 2.5 to 4.1 and captures of Motive 1.5 to 3.2.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

from core.errors import FormatError
from devices.natnet.wire import F32, I32, Reader, Version, pack_padded_text, pack_text

COMMAND_PORT = 1510
DATA_PORT = 1511
MULTICAST_GROUP = "239.255.42.99"

MAX_PAYLOAD = 65503
NEWEST: Version = (4, 2)
"""The newest bitstream whose layout is known; later ones have not changed it (up to 4.4)."""

_HEADER = struct.Struct("<HH")
_CLOCK_AND_CONNECTION = struct.Struct("<QHB4s")
_ECHO = struct.Struct("<QQ")
_TICKS = struct.Struct("<Q")

_NAME_SIZE = 256
_SENDER_SIZE = 264
_CONNECT_SIZE = 269


class Message(IntEnum):
    """Message ids."""

    CONNECT = 0
    SERVERINFO = 1
    REQUEST = 2
    RESPONSE = 3
    REQUEST_MODELDEF = 4
    MODELDEF = 5
    REQUEST_FRAMEOFDATA = 6
    FRAMEOFDATA = 7
    MESSAGESTRING = 8
    DISCONNECT = 9
    KEEPALIVE = 10
    DISCONNECTBYTIMEOUT = 11
    ECHOREQUEST = 12
    ECHORESPONSE = 13
    DISCOVERY = 14
    UNRECOGNIZED_REQUEST = 100


def pack(message: int, payload: bytes = b"") -> bytes:
    """A packet. Raises FormatError for a payload that no datagram can carry."""
    if len(payload) > MAX_PAYLOAD:
        raise FormatError(
            f"A NatNet packet carries {MAX_PAYLOAD} bytes, not {len(payload)}.", "Send fewer points per frame."
        )
    return _HEADER.pack(message, len(payload)) + payload


def unpack(packet: bytes) -> tuple[int, bytes]:
    """Message id and payload of a packet. Raises FormatError if its length is not what it says."""
    if len(packet) < _HEADER.size:
        raise FormatError(f"A NatNet packet has at least {_HEADER.size} bytes, this one {len(packet)}.")
    message, size = _HEADER.unpack_from(packet)
    payload = packet[_HEADER.size :]
    if size != len(payload) and not (message == Message.CONNECT and len(payload) >= _SENDER_SIZE):
        # A known client declares one byte more than it sends when it connects.
        raise FormatError(f"NatNet message {message} says {size} bytes and has {len(payload)}.")
    return message, payload


@dataclass(frozen=True, slots=True)
class Sender:
    """Who speaks: name, version of the application, version of NatNet; both four numbers."""

    name: str
    app_version: tuple[int, int, int, int]
    natnet_version: tuple[int, int, int, int]

    @property
    def version(self) -> Version:
        """Bitstream version."""
        return self.natnet_version[0], self.natnet_version[1]

    def encode(self) -> bytes:
        """264 bytes."""
        return pack_padded_text(self.name, _NAME_SIZE) + bytes(self.app_version) + bytes(self.natnet_version)


def _read_sender(reader: Reader) -> Sender:
    name = reader.padded_text(_NAME_SIZE, "the name")
    return Sender(name, _four(reader, "the application's version"), _four(reader, "the NatNet version"))


def _four(reader: Reader, of: str) -> tuple[int, int, int, int]:
    a, b, c, d = reader.raw(4, of)
    return a, b, c, d


@dataclass(frozen=True, slots=True)
class Connect:
    """A client says hello (CONNECT, DISCOVERY).

    bitstream: the version it asks for, (0, 0) for the server's own; None in the short form of clients before 4.0.
    """

    sender: Sender
    bitstream: Version | None = (0, 0)
    subscribed_only: bool = False

    def encode(self) -> bytes:
        """Payload of CONNECT, 269 bytes, or 264 in the short form."""
        if self.bitstream is None:
            return self.sender.encode()
        return self.sender.encode() + bytes((self.subscribed_only, *self.bitstream, 0, 0))


def decode_connect(payload: bytes) -> Connect:
    """Raises FormatError. Clients exist that send nothing, or only a name: they are taken for the oldest."""
    if len(payload) < _SENDER_SIZE:
        name = payload.split(b"\0", 1)[0].decode("utf-8", "surrogateescape")
        return Connect(Sender(name, (0, 0, 0, 0), (0, 0, 0, 0)), None)
    reader = Reader(payload, "CONNECT")
    sender = _read_sender(reader)
    if len(payload) < _CONNECT_SIZE:
        return Connect(sender, None)
    subscribed = reader.raw(1, "the subscription option") != b"\0"
    major, minor, _, _ = _four(reader, "the bitstream version")
    return Connect(sender, (major, minor), subscribed)


@dataclass(frozen=True, slots=True)
class ServerInfo:
    """A server introduces itself.

    clock_hz: ticks per second of its clock; 0 before NatNet 3.0, where the four fields are absent.
    data_port, multicast, group: where it sends frames. Servers that broadcast fill in nonsense here.
    """

    sender: Sender
    clock_hz: int = 0
    data_port: int = 0
    multicast: bool = False
    group: str = ""

    def encode(self) -> bytes:
        """Payload of SERVERINFO."""
        if self.sender.version < (3, 0):
            return self.sender.encode()
        group = bytes(int(part) for part in self.group.split(".")) if self.group else bytes(4)
        return self.sender.encode() + _CLOCK_AND_CONNECTION.pack(self.clock_hz, self.data_port, self.multicast, group)


def decode_server_info(payload: bytes) -> ServerInfo:
    """Raises FormatError."""
    reader = Reader(payload, "SERVERINFO")
    sender = _read_sender(reader)
    if sender.version < (3, 0):
        reader.finish()
        return ServerInfo(sender)
    clock_hz, data_port, multicast, group = reader.values(_CLOCK_AND_CONNECTION, "the connection")
    if sender.version <= NEWEST:
        reader.finish()
    return ServerInfo(sender, clock_hz, data_port, bool(multicast), ".".join(str(part) for part in group))


def encode_echo_request(client_ticks: int) -> bytes:
    """Payload of ECHOREQUEST."""
    return _TICKS.pack(client_ticks)


def decode_echo_request(payload: bytes) -> int:
    """The client's ticks. Raises FormatError."""
    reader = Reader(payload, "ECHOREQUEST")
    ticks: int = reader.values(_TICKS, "the client's time")[0]
    reader.finish()
    return ticks


def encode_echo_response(client_ticks: int, server_ticks: int) -> bytes:
    """Payload of ECHORESPONSE."""
    return _ECHO.pack(client_ticks, server_ticks)


def decode_echo_response(payload: bytes) -> tuple[int, int]:
    """The client's ticks, as sent, and the server's. Raises FormatError."""
    reader = Reader(payload, "ECHORESPONSE")
    client, server = reader.values(_ECHO, "the two times")
    reader.finish()
    return client, server


def encode_request(command: str) -> bytes:
    """Payload of REQUEST."""
    return pack_text(command)


def decode_request(payload: bytes) -> str:
    """The command. Raises FormatError."""
    reader = Reader(payload, "REQUEST")
    command = reader.text("the command")
    reader.finish()
    return command


def encode_float(value: float) -> bytes:
    """A RESPONSE of one number."""
    return F32.pack(value)


def encode_int(value: int) -> bytes:
    """A RESPONSE of one integer."""
    return I32.pack(value)


def decode_float(payload: bytes) -> float:
    """A RESPONSE of one number. Raises FormatError."""
    if len(payload) != F32.size:
        raise FormatError(f"RESPONSE: a number has {F32.size} bytes, not {len(payload)}.")
    value: float = F32.unpack(payload)[0]
    return value


def decode_int(payload: bytes) -> int:
    """A RESPONSE of one integer. Raises FormatError."""
    if len(payload) != I32.size:
        raise FormatError(f"RESPONSE: a number has {I32.size} bytes, not {len(payload)}.")
    value: int = I32.unpack(payload)[0]
    return value


def decode_bitstream(payload: bytes) -> Version:
    """The version in a RESPONSE "Bitstream,4.1.0.0". Raises FormatError."""
    text = payload.split(b"\0", 1)[0].decode("ascii", "replace")
    name, _, version = text.partition(",")
    parts = version.split(".")
    if name != "Bitstream" or len(parts) < 2 or not all(part.isdecimal() for part in parts[:2]):
        raise FormatError(f"RESPONSE: {text[:40]!r} is no bitstream version.")
    return int(parts[0]), int(parts[1])
