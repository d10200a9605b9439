"""A NatNet server: whatever frames it is handed go out on the real wire, at their rate."""

from __future__ import annotations

import contextlib
import socket
import sys
import threading
from collections.abc import Iterable, Sequence

import numpy as np

from core.errors import DeviceError, FormatError
from core.frames import MarkerFrame
from devices.common.clock import host_clock
from devices.natnet import protocol
from devices.natnet.frames import encode_frame
from devices.natnet.models import RigidBodyModel, encode_models
from devices.natnet.protocol import Message, Sender, ServerInfo
from devices.natnet.records import LABELLED, RIGID_BODY, Bodies, FrameFlag, FrameOfData, MarkerFlag
from devices.natnet.wire import Version
from devices.parameter import Parameter, Value
from devices.simulator import Simulator

CLOCK_HZ = 10_000_000
"""Ticks per second of the simulated server's clock."""

CLIENT_TIMEOUT_S = 10.0
"""A unicast client silent for this long gets no more frames [s]."""
MAX_CLIENTS = 64
MARKER_SIZE_M = 0.0065
HOST = "127.0.0.1"
_UNLABELLED = int(MarkerFlag.UNLABELLED | MarkerFlag.POINT_CLOUD_SOLVED)


class NatNetSimulator(Simulator[MarkerFrame]):
    """A server that speaks as Motive does.

    frames: in metres, Y up. Points go out as unlabelled markers with their ids.
    command_port, data_port: 0 takes any free one, told by the attributes of the same name once open.
    multicast: send to `group` on the interface `host`, instead of to each client that connects.
    bitstream: of the frames, 2.5 to 4.2, also as text.
    """

    title = "a server like OptiTrack Motive"
    manner = "Serves frames as OptiTrack Motive does: points without labels, ids that break at every gap."
    what = "markers"
    parameters = (
        Parameter("host", "Interface", HOST, help="Interface to serve on."),
        Parameter(
            "command_port", "Command port", protocol.COMMAND_PORT, minimum=0, maximum=65535, help="0: any free one."
        ),
        Parameter("data_port", "Data port", protocol.DATA_PORT, minimum=0, maximum=65535, help="0: any free one."),
        Parameter("bitstream", "Bitstream", "4.1", help="Version of the frames, 2.5 to 4.2."),
        Parameter("multicast", "Multicast", False, help="Send to a multicast group, not to each client."),
    )
    anywhere = {"host": HOST, "command_port": 0, "data_port": 0}  # noqa: RUF012 - never written

    def __init__(
        self,
        frames: Iterable[MarkerFrame],
        rate_hz: float,
        *,
        host: str = HOST,
        command_port: int = protocol.COMMAND_PORT,
        data_port: int = protocol.DATA_PORT,
        bitstream: Version | str = (4, 1),
        loop: bool = False,
        multicast: bool = False,
        group: str = protocol.MULTICAST_GROUP,
        name: str = "Motive",
    ) -> None:
        """Raises DeviceError for a rate or version that no server has."""
        super().__init__(frames, rate_hz, loop=loop)
        self.bitstream = _version(bitstream) if isinstance(bitstream, str) else bitstream
        if not (2, 5) <= self.bitstream <= protocol.NEWEST:
            major, minor = self.bitstream
            raise DeviceError(f"Bitstream {major}.{minor} cannot be simulated.", "Choose 2.5 to 4.2.")
        self.host = host
        self.command_port = command_port
        self.data_port = data_port
        self.multicast = multicast
        self.group = group
        self._name = name
        self._names: dict[int, str] = {}
        if isinstance(frames, Sequence) and len(frames):
            self._names = {body.id: body.name for body in frames[0].rigid_bodies}
        self._clients: dict[tuple[str, int], float] = {}  # address: last heard
        self._versions: dict[tuple[str, int], Version] = {}  # of clients that chose another than ours
        self._lock = threading.Lock()
        self._command: socket.socket | None = None
        self._data: socket.socket | None = None
        self._closing = threading.Event()
        self._threads: list[threading.Thread] = []

    @property
    def settings(self) -> dict[str, Value]:  # noqa: D102
        return {"server": self.host, "command_port": self.command_port, "data_port": self.data_port}

    @property
    def place(self) -> str:  # noqa: D102
        major, minor = self.bitstream
        ways = f"multicast to {self.group}" if self.multicast else "unicast"
        return (
            f"NatNet {major}.{minor}, {ways}, server {self.host}, command port {self.command_port}, "
            f"data port {self.data_port}"
        )

    @property
    def audience(self) -> str:  # noqa: D102
        return "the group" if self.multicast else f"{len(self.clients)} clients"

    def open(self) -> None:
        """Take the ports and answer clients. Raises DeviceError if a port is taken or the address is not here."""
        if self._command is not None:
            return
        self._closing.clear()
        try:
            self._command = _bind(self.host, self.command_port)
            self._data = _bind(self.host, self.data_port, shared=self.multicast)
        except DeviceError:
            self.close()
            raise
        self.command_port = self._command.getsockname()[1]
        self.data_port = self._data.getsockname()[1]
        if self.multicast:
            self._data.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(self.host))
            self._data.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
            self._data.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 1)
        self._command.settimeout(0.1)
        answering = threading.Thread(target=self._answer, name="natnet simulator commands", daemon=True)
        self._threads = [answering]
        answering.start()

    def _close(self) -> None:
        self._closing.set()
        for thread in self._threads:
            thread.join()
        self._threads = []
        for held in (self._command, self._data):
            if held is not None:
                held.close()
        self._command = self._data = None
        with self._lock:
            self._clients.clear()
            self._versions.clear()

    @property
    def clients(self) -> tuple[tuple[str, int], ...]:
        """Clients that get frames by unicast."""
        with self._lock:
            return tuple(self._clients)

    # ---- frames

    def _send(self, number: int, frame: MarkerFrame, exposed_s: float) -> None:
        targets = self._targets()
        record = self._record(number, frame, exposed_s)
        packets: dict[Version, bytes] = {}
        for address, version in targets:
            if version not in packets:
                packets[version] = protocol.pack(Message.FRAMEOFDATA, encode_frame(record, version))
            assert self._data is not None
            try:
                self._data.sendto(packets[version], address)
            except OSError:
                self.unsent += 1

    def _targets(self) -> list[tuple[tuple[str, int], Version]]:
        if self.multicast:
            return [((self.group, self.data_port), self.bitstream)]
        oldest = host_clock() - CLIENT_TIMEOUT_S
        with self._lock:
            for address in [a for a, heard in self._clients.items() if heard < oldest]:
                del self._clients[address]
                self._versions.pop(address, None)
            return [(address, self._versions.get(address, self.bitstream)) for address in self._clients]

    def _record(self, number: int, frame: MarkerFrame, exposed_s: float) -> FrameOfData:
        """The frame as Motive would send it; exposure is when it was due."""
        if len(frame.ids) and not (int(frame.ids.min()) >= -(1 << 31) and int(frame.ids.max()) < 1 << 31):
            raise FormatError(f"A point's id {int(np.abs(frame.ids).max())} is too large for NatNet (32 bits).")
        labelled = np.zeros(len(frame.ids), LABELLED)
        labelled["id"] = frame.ids
        labelled["position"] = frame.points_m
        labelled["size"] = MARKER_SIZE_M
        labelled["params"] = _UNLABELLED
        labelled["residual"] = np.nan_to_num(frame.residuals_m)
        poses = np.zeros(len(frame.rigid_bodies), RIGID_BODY)
        for i, body in enumerate(frame.rigid_bodies):
            w, x, y, z = body.quaternion_wxyz
            poses[i] = (body.id, body.position_m, (x, y, z, w), np.nan_to_num(body.mean_error_m), int(body.tracked))
        names = {body.id: body.name for body in frame.rigid_bodies}
        changed = any(self._names.get(identity) != name for identity, name in names.items())
        if changed:
            with self._lock:
                self._names.update(names)
        old = self.bitstream < (3, 0)
        now = host_clock()
        return FrameOfData(
            number=number,
            unlabelled=np.asarray(frame.points_m, np.float32),
            rigid_bodies=Bodies(poses),
            labelled=labelled[:0] if old else labelled,  # before 3.0 only markers of a model were labelled
            timecode=_packed(frame.timecode),
            timestamp_s=number / self.rate_hz,
            mid_exposure_ticks=int(exposed_s * CLOCK_HZ),
            data_received_ticks=int(exposed_s * CLOCK_HZ),
            transmit_ticks=int(now * CLOCK_HZ),
            precision_s=int(exposed_s),
            params=int(FrameFlag.MODELS_CHANGED) if changed else 0,
        )

    # ---- commands

    def _answer(self) -> None:
        assert self._command is not None
        while not self._closing.is_set():
            try:
                packet, address = self._command.recvfrom(65535)
            except (TimeoutError, ConnectionError):
                continue
            except OSError:
                self._closing.wait(0.1)  # the interface is down
                continue
            with contextlib.suppress(FormatError, OSError):  # nonsense gets no answer, one that has gone neither
                message, payload = protocol.unpack(packet)
                answer = self._reply(message, payload, address)
                if answer is not None:
                    self._command.sendto(answer, address)

    def _reply(self, message: int, payload: bytes, address: tuple[str, int]) -> bytes | None:
        with self._lock:
            if address in self._clients:
                self._clients[address] = host_clock()
        match message:
            case Message.CONNECT:
                hello = protocol.decode_connect(payload)
                self._welcome(address, hello.bitstream)
                return protocol.pack(Message.SERVERINFO, self._info().encode())
            case Message.DISCOVERY:
                return protocol.pack(Message.SERVERINFO, self._info().encode())
            case Message.REQUEST_MODELDEF:
                with self._lock:
                    models = [RigidBodyModel(name, identity) for identity, name in self._names.items()]
                    version = self._versions.get(address, self.bitstream)
                return protocol.pack(Message.MODELDEF, encode_models(models, version))
            case Message.REQUEST:
                return self._respond(protocol.decode_request(payload), address)
            case Message.ECHOREQUEST:
                ticks = protocol.decode_echo_request(payload)
                now = int(host_clock() * CLOCK_HZ)
                return protocol.pack(Message.ECHORESPONSE, protocol.encode_echo_response(ticks, now))
            case Message.DISCONNECT:
                with self._lock:
                    self._clients.pop(address, None)
                    self._versions.pop(address, None)
        return None

    def _welcome(self, address: tuple[str, int], wanted: Version | None) -> None:
        if self.multicast:
            return
        with self._lock:
            if address not in self._clients and len(self._clients) >= MAX_CLIENTS:
                return
            self._clients[address] = host_clock()
            self._choose(address, wanted or (0, 0))

    def _choose(self, address: tuple[str, int], wanted: Version) -> None:
        """Servers from 4.0 on speak older bitstreams to a client that asks for one."""
        if (3, 0) <= wanted <= self.bitstream and self.bitstream >= (4, 0):
            self._versions[address] = wanted

    def _respond(self, command: str, address: tuple[str, int]) -> bytes:
        match command:
            case "FrameRate":
                answer = protocol.encode_float(self.rate_hz)
            case "UnitsToMillimeters":
                answer = protocol.encode_float(1000.0)
            case "UpAxis":
                answer = protocol.encode_int(1)
            case "AnalogSamplesPerMocapFrame" | "CurrentMode":
                answer = protocol.encode_int(0)
            case _ if command.split(",")[0] == "Bitstream" and self.bitstream >= (4, 0) and not self.multicast:
                parts = command.partition(",")[2].split(".")
                with self._lock:
                    if len(parts) >= 2 and parts[0].isdecimal() and parts[1].isdecimal():
                        self._choose(address, (int(parts[0]), int(parts[1])))
                    major, minor = self._versions.get(address, self.bitstream)
                answer = f"Bitstream,{major}.{minor}.0.0\0".encode()
            case _:
                return protocol.pack(Message.UNRECOGNIZED_REQUEST)
        return protocol.pack(Message.RESPONSE, answer)

    def _info(self) -> ServerInfo:
        major, minor = self.bitstream
        sender = Sender(self._name, (3, 1, 0, 0), (major, minor, 0, 0))
        return ServerInfo(sender, CLOCK_HZ, self.data_port, self.multicast, self.group)


def _version(text: str) -> Version:
    major, _, minor = text.partition(".")
    if not (major.isdecimal() and minor.isdecimal()):
        raise DeviceError(f"Bitstream {text!r} is no version.", "Give one from 2.5 to 4.2.")
    return int(major), int(minor)


def _packed(timecode: str) -> int:
    """As it is on the wire; 0 for none."""
    parts = timecode.split(":")
    whole = len(parts) == 4 and all(part.isdecimal() and int(part) < 256 for part in parts)
    return int.from_bytes(bytes(map(int, parts)), "big") if whole else 0


def _bind(host: str, port: int, *, shared: bool = False) -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        if shared:  # multicast clients of this machine hold the data port as well
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if sys.platform == "darwin":
                made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        made.bind((host, port))
    except OSError as error:
        made.close()
        raise DeviceError(
            f"Port {port} of {host} cannot be taken for the simulated server ({error.strerror}).",
            "Close the server that holds it (Motive?), or choose another port.",
        ) from error
    return made
