"""OptiTrack Motive as a device: a NatNet client."""

from __future__ import annotations

import contextlib
import math
from collections import deque
from collections.abc import Sequence

from core.errors import DeviceError, FormatError
from core.frames import MarkerFrame, Times
from devices.device import Description, Device, Found, Health, Level, Parameter
from devices.natnet import protocol
from devices.natnet.clock import ClockSync
from devices.natnet.convert import POINT_CHOICES, Conversion, UpAxis
from devices.natnet.frames import decode_frame, detect_version
from devices.natnet.models import AssetModel, RigidBodyModel, decode_models
from devices.natnet.protocol import Connect, Message, Sender, ServerInfo
from devices.natnet.records import FrameFlag, FrameOfData
from devices.natnet.transport import RECEIVE_BUFFER, Datagram, Transport, local_addresses, resolve, route_to
from devices.natnet.wire import Version
from devices.stream import Arrival, RateMeter, SequenceCounter, host_clock

CONNECT_TRIES = (0.0, 0.7, 1.4, 2.1, 2.8)
"""When CONNECT is sent [s]; the last two in the short form of old servers."""
CONNECT_TIMEOUT_S = 3.5
SETUP_TIMEOUT_S = 3.0
REQUEST_TIMEOUT_S = 1.0
REQUEST_TRIES = 3
ECHO_INTERVAL_S = 0.5
KEEPALIVE_INTERVAL_S = 1.0
SILENCE_S = 2.0
"""A server silent for this long is gone: it answers an echo twice a second [s]."""
NO_FRAMES_S = 1.0
LONGEST_BACKOFF_S = 5.0
RECENT_S = 5.0

_AUTOMATIC, _UNICAST, _MULTICAST, _LISTEN = "automatic", "unicast", "multicast", "listen only"
_BITSTREAMS = ("auto", "2.5", "2.6", "2.7", "2.8", "2.9", "2.10", "3.0", "3.1", "4.0", "4.1", "4.2", "4.3", "4.4")
_MODES = {0: "live", 1: "recording", 2: "edit"}
_WHO = Sender("Phalanx", (0, 1, 0, 0), (4, 2, 0, 0))
_WHO_OLD = Sender("Phalanx", (0, 1, 0, 0), (3, 0, 0, 0))


class NatNetDevice(Device):
    """An OptiTrack server on the network.

    One thread opens, starts, reads, stops and closes; `describe` and `health` may be called from any.
    """

    kind = "natnet"
    title = "OptiTrack (NatNet)"
    parameters = (
        Parameter(
            "server",
            "Server address",
            "127.0.0.1",
            help="IPv4 address or name of the computer that runs Motive (there: Settings, Streaming).",
        ),
        Parameter(
            "local",
            "Local interface",
            "",
            help="IPv4 address of this machine on the cameras' network. Empty: the one that reaches the server.",
        ),
        Parameter(
            "transmission",
            "Transmission",
            _AUTOMATIC,
            choices=(_AUTOMATIC, _UNICAST, _MULTICAST, _LISTEN),
            help="Automatic asks the server. Listen only receives multicast without a word to the server.",
        ),
        Parameter(
            "command_port",
            "Command port",
            protocol.COMMAND_PORT,
            minimum=1,
            maximum=65535,
            step=1,
            help="As in Motive.",
        ),
        Parameter("data_port", "Data port", protocol.DATA_PORT, minimum=1, maximum=65535, step=1, help="As in Motive."),
        Parameter(
            "group",
            "Multicast group",
            protocol.MULTICAST_GROUP,
            help="Used unless the server names another: 224.0.0.0 to 239.255.255.255.",
        ),
        Parameter(
            "bitstream",
            "Bitstream version",
            "auto",
            choices=_BITSTREAMS,
            help="The version of the frames. Auto asks the server, and recognises the layout where it cannot.",
        ),
        Parameter(
            "points",
            "Points",
            POINT_CHOICES[0],
            choices=POINT_CHOICES,
            help="All points, or only those that belong to no rigid body or skeleton of the server.",
        ),
    )

    def __init__(self, **settings: object) -> None:
        super().__init__(**settings)
        self._group = _multicast_group(str(self.settings["group"]))
        self._transport: Transport | None = None
        self._opened_s = 0.0
        self._streaming = False
        self._server = ""
        self._info: ServerInfo | None = None
        self._version: Version | None = None
        self._multicast = False
        self._conversion = Conversion(points=str(self.settings["points"]))
        self._names: dict[int, str] = {}
        self._frame_rate_hz = 0.0
        self._mode = -1
        self._clock = ClockSync()
        self._latest: FrameOfData | None = None

        self._greeting = False  # SERVERINFO is awaited
        self._short_form = False
        self._requests: deque[str] = deque()
        self._request_tries = 0
        self._models_wanted = False
        self._due = dict.fromkeys(("connect", "request", "models", "echo", "keepalive"), 0.0)
        self._backoff_s = 0.0

        self._lost_since_s: float | None = None
        self._heard_s = 0.0
        self._frame_s = 0.0
        self._source = ""
        self._heard: dict[str, list[int]] = {}  # by address: frames, other packets, rejected
        self._sequence = SequenceCounter()
        self._rate = RateMeter()
        self._rate_hz = 0.0
        self._received = 0
        self._rejected = 0
        self._rejected_s = -math.inf
        self._gap_s = -math.inf
        self._gap_frames = 0
        self._reconnects = 0
        self._latency_s = math.nan
        self._last_error = ""
        self._without_ids = False

    # ---- the contract

    @classmethod
    def discover(cls, timeout_s: float = 1.0) -> Sequence[Found]:
        """Servers of the local networks that answer on the usual port."""
        packet = protocol.pack(Message.DISCOVERY, _WHO_OLD.encode())
        found: dict[str, Found] = {}
        transports: list[Transport] = []
        try:
            for local in local_addresses():
                try:
                    transport = Transport(local)
                except DeviceError:
                    continue
                transports.append(transport)
                nets = [local] if local.startswith("127.") else ["255.255.255.255", local.rpartition(".")[0] + ".255"]
                for target in nets:
                    _try_send(transport, packet, target, protocol.COMMAND_PORT)
            end = host_clock() + timeout_s
            while transports and host_clock() < end:
                for transport in transports:
                    datagram = transport.receive(min(0.02, timeout_s))
                    info = _server_info(datagram) if datagram else None
                    if datagram and info:
                        title = (
                            f"{_printable(info.sender.name)} {_dotted(info.sender.app_version)} at {datagram.address}"
                        )
                        settings = {"server": datagram.address, "local": transport.local}
                        found.setdefault(datagram.address, Found(title, settings))
        finally:
            for transport in transports:
                transport.close()
        return tuple(found.values())

    def open(self) -> None:
        """Take the sockets and greet the server. Raises DeviceError; the device is then closed."""
        self.close()
        try:
            self._open()
        except BaseException:
            self.close()
            raise

    def start(self) -> None:
        """Hand on frames from now on."""
        if self._transport is None:
            raise DeviceError(f"{self.title} is not open.", "Connect it first.")
        self._transport.drain()
        self._sequence.forget()
        now = host_clock()
        self._frame_s = self._heard_s = now
        if self._speaks:
            self._greeting = True  # a server forgets a client that was silent for a while
            self._due["connect"] = now
        self._streaming = True

    def read(self, timeout_s: float) -> MarkerFrame | None:
        """The next frame, waiting at most `timeout_s`."""
        if self._transport is None or not self._streaming:
            return None
        return self._pump(timeout_s)

    def stop(self) -> None:
        """Hand on no more frames."""
        self._streaming = False

    def close(self) -> None:
        """Say goodbye and give the sockets back."""
        self._streaming = False
        transport, self._transport = self._transport, None
        if transport is None:
            return
        if self._speaks and self._info is not None:
            _try_send(transport, protocol.pack(Message.DISCONNECT), self._server, self._command_port)
        transport.close()

    # ---- opening

    @property
    def _command_port(self) -> int:
        return int(self.settings["command_port"])

    @property
    def _speaks(self) -> bool:
        return self.settings["transmission"] != _LISTEN

    def _open(self) -> None:
        local = str(self.settings["local"]).strip()
        if local:
            local = resolve(local)
        if self._speaks:
            self._server = resolve(str(self.settings["server"]))
        self._transport = Transport(local)
        self._opened_s = self._heard_s = host_clock()
        self._info, self._version, self._source, self._lost_since_s = None, None, "", None
        self._heard.clear()
        self._clock.reset()
        bitstream = str(self.settings["bitstream"])
        if bitstream != "auto":
            major, minor = bitstream.split(".")
            self._version = int(major), int(minor)
        if not self._speaks:
            self._multicast = True
            self._transport.listen(int(self.settings["data_port"]))
            self._transport.join(self._group, [local] if local else local_addresses())
            return
        self._greet()
        info = self._info
        assert info is not None
        transmission = self.settings["transmission"]
        self._multicast = transmission == _MULTICAST or (transmission == _AUTOMATIC and info.multicast)
        if self._multicast:
            port, group = int(self.settings["data_port"]), self._group
            # A server that broadcasts fills these in with nonsense.
            if info.data_port > 1023 and transmission == _AUTOMATIC:
                port = info.data_port
            if 224 <= int(info.group.split(".")[0] or 0) <= 239 and transmission == _AUTOMATIC:
                group = info.group
            self._transport.listen(port)
            self._transport.join(group, [local or route_to(self._server) or "127.0.0.1"])
        self._settle()

    def _greet(self) -> None:
        """CONNECT until SERVERINFO. Raises DeviceError."""
        assert self._transport is not None
        begin = host_clock()
        for attempt, at in enumerate((*CONNECT_TRIES, CONNECT_TIMEOUT_S)):
            while self._info is None and (left := begin + at - host_clock()) > 0:
                self._pump(left, until_info=True)
            if self._info is not None:
                return
            if attempt < len(CONNECT_TRIES):
                self._short_form = attempt >= 3
                try:
                    self._send(Message.CONNECT, self._hello())
                except OSError as error:
                    raise DeviceError(
                        f"{self._server} cannot be reached from {self._transport.local or 'here'} ({error.strerror}).",
                        "Check the server address, the cable and the local interface.",
                    ) from error
        heard = self._heard_text()
        raise DeviceError(
            f"No NatNet server answers at {self._server}, port {self._command_port}.",
            "Start Motive and switch on streaming (Settings, Streaming), check the address and the firewall."
            + (f" Heard so far: {heard}" if heard else ""),
        )

    def _settle(self) -> None:
        """Wait until the server has answered what was asked; what it does not know keeps its default."""
        end = host_clock() + SETUP_TIMEOUT_S
        while host_clock() < end and (self._requests or self._models_wanted or not self._clock_settled):
            self._pump(0.02)

    @property
    def _clock_settled(self) -> bool:
        return self._info is None or not self._info.clock_hz or self._clock.synchronised

    # ---- the conversation

    def _pump(self, timeout_s: float, *, until_info: bool = False) -> MarkerFrame | None:
        """Send what is due, take what comes, until a frame is ready or the time is over."""
        transport = self._transport
        assert transport is not None
        now = host_clock()
        end = now + timeout_s
        while True:
            wake = end if until_info else min(end, self._housekeeping(now))
            try:
                datagram = transport.receive(wake - now)
            except OSError as error:
                self._last_error = f"Receiving failed: {error.strerror}."
                datagram = None
            if datagram is not None:
                frame = self._take(datagram)
                if frame is not None:
                    return frame
                if until_info and self._info is not None:
                    return None
            now = host_clock()
            if now >= end:
                self._rate_hz = self._rate.rate_hz(now)
                return None

    def _housekeeping(self, now: float) -> float:
        """Send what is due at `now`; when to come again."""
        if not self._speaks:
            if self._lost_since_s is None and now - self._heard_s > SILENCE_S and self._received:
                self._lost_since_s = self._heard_s
            return now + 0.1
        due = self._due
        silent = now - self._heard_s > SILENCE_S
        if silent and self._lost_since_s is None:
            self._lost_since_s = self._heard_s
            self._greeting, self._backoff_s, due["connect"] = True, 0.5, now
        elif not self._multicast and self._streaming and now - max(self._frame_s, due["connect"]) > SILENCE_S:
            self._greeting = True  # it answers and sends nothing: it may have forgotten this client
        if self._greeting and now >= due["connect"]:
            self._attempt(Message.CONNECT, self._hello())
            if self._lost_since_s is not None and self._transport is not None:
                self._transport.rejoin()
                self._backoff_s = min(2 * self._backoff_s, LONGEST_BACKOFF_S)
            due["connect"] = now + max(1.0, self._backoff_s)
        if self._lost_since_s is not None:
            return min(due["connect"], now + 0.1)
        if self._requests and now >= due["request"]:
            if self._request_tries == REQUEST_TRIES:
                self._next_request()
            if self._requests:
                self._attempt(Message.REQUEST, protocol.encode_request(self._requests[0]))
                self._request_tries += 1
                due["request"] = now + REQUEST_TIMEOUT_S
        if self._models_wanted and now >= due["models"]:
            self._attempt(Message.REQUEST_MODELDEF)
            due["models"] = now + REQUEST_TIMEOUT_S
        if self._info is not None and self._info.clock_hz and now >= due["echo"]:
            self._attempt(Message.ECHOREQUEST, protocol.encode_echo_request(int(host_clock() * 1e9)))
            due["echo"] = now + ECHO_INTERVAL_S
        if not self._multicast and now >= due["keepalive"]:
            self._attempt(Message.KEEPALIVE)
            due["keepalive"] = now + KEEPALIVE_INTERVAL_S
        return now + 0.1

    def _hello(self) -> bytes:
        if self._short_form:
            return Connect(_WHO_OLD, None).encode()
        chosen = self.settings["bitstream"] != "auto" and self._version is not None and self._version >= (4, 0)
        return Connect(_WHO, self._version if chosen else (0, 0)).encode()

    def _send(self, message: int, payload: bytes = b"") -> None:
        assert self._transport is not None
        self._transport.send(protocol.pack(message, payload), self._server, self._command_port)

    def _attempt(self, message: int, payload: bytes = b"") -> None:
        try:
            self._send(message, payload)
        except OSError as error:
            self._last_error = f"Sending to {self._server} failed: {error.strerror}."

    def _take(self, datagram: Datagram) -> MarkerFrame | None:
        """One datagram: a frame to hand on, or None."""
        heard = self._heard.get(datagram.address)
        if heard is None:
            if len(self._heard) >= 16:  # whoever else there is, sixteen names tell enough
                heard = [0, 0, 0]
            else:
                heard = self._heard[datagram.address] = [0, 0, 0]
        try:
            message, payload = protocol.unpack(datagram.data)
            if message == Message.FRAMEOFDATA:
                frame = self._take_frame(payload, datagram)
                heard[0] += 1
                return frame
            if self._speaks and datagram.address == self._server:
                self._take_answer(message, payload, datagram)
                self._alive(datagram.arrival_s)
            heard[1] += 1
        except FormatError as error:
            heard[2] += 1
            self._rejected += 1
            self._rejected_s = datagram.arrival_s
            self._last_error = f"Packet from {datagram.address} not understood: {error}"
        return None

    def _take_answer(self, message: int, payload: bytes, datagram: Datagram) -> None:
        match message:
            case Message.SERVERINFO:
                self._introduced(protocol.decode_server_info(payload))
            case Message.RESPONSE:
                if self._requests:
                    self._answered(self._requests[0], payload)
                    self._next_request()
            case Message.UNRECOGNIZED_REQUEST:
                if self._requests:
                    self._next_request()
            case Message.MODELDEF:
                version = self._version or protocol.NEWEST
                self._names = {
                    model.id: _printable(model.name)
                    for model in decode_models(payload, version)
                    if isinstance(model, RigidBodyModel | AssetModel)
                }
                self._models_wanted = False
            case Message.ECHORESPONSE:
                client, server = protocol.decode_echo_response(payload)
                if self._info is not None and self._info.clock_hz:
                    self._clock.echo(client * 1e-9, server / self._info.clock_hz, datagram.arrival_s)
            case _:
                pass  # a message string, or one of a later version

    def _introduced(self, info: ServerInfo) -> None:
        """SERVERINFO: ask for all the rest."""
        again = self._info is not None
        changed = info != self._info
        self._info = info
        self._greeting = False
        self._backoff_s = 0.0
        if self.settings["bitstream"] == "auto" and (changed or self._version is None):
            self._version = info.sender.version
        if again and changed:
            self._clock.reset()
        self._requests.clear()
        self._requests.extend(("FrameRate", "UnitsToMillimeters", "UpAxis", "CurrentMode"))
        if info.sender.version >= (4, 0) and not info.multicast:
            self._requests.append("Bitstream")
        self._request_tries = 0
        self._models_wanted = True
        now = host_clock()
        self._due.update(request=now, models=now, echo=now)

    def _next_request(self) -> None:
        self._requests.popleft()
        self._request_tries = 0
        self._due["request"] = 0.0

    def _answered(self, command: str, payload: bytes) -> None:
        """A RESPONSE; it does not say to what, so one request is under way at a time."""
        conversion = self._conversion
        match command:
            case "FrameRate":
                rate = protocol.decode_float(payload)
                if 0 < rate < 1e5:
                    self._frame_rate_hz = rate
            case "UnitsToMillimeters":
                scale = protocol.decode_float(payload) / 1000.0
                if 0 < scale < 1e6:
                    self._conversion = Conversion(conversion.up_axis, scale, conversion.points)
            case "UpAxis":
                axis = protocol.decode_int(payload)
                if axis in (0, 1, 2):
                    self._conversion = Conversion(UpAxis(axis), conversion.scale_m, conversion.points)
            case "CurrentMode":
                self._mode = protocol.decode_int(payload)
            case "Bitstream":
                version = protocol.decode_bitstream(payload)
                if version >= (2, 5):
                    self._version = version

    def _alive(self, now: float) -> None:
        """Something understandable came."""
        self._heard_s = now
        if self._lost_since_s is not None:
            self._lost_since_s = None
            self._reconnects += 1
            self._clock.reset()  # it may have been started anew, with another clock
            if self._speaks:
                self._greeting, self._due["connect"] = True, now

    # ---- frames

    def _take_frame(self, payload: bytes, datagram: Datagram) -> MarkerFrame | None:
        if not self._is_ours(datagram.address) or not self._streaming:
            return None
        frame = self._decode(payload)
        self._source = datagram.address
        arrival = datagram.arrival_s
        self._alive(arrival)
        self._frame_s = arrival
        self._latest = frame
        times = self._times(frame, arrival)
        live = not frame.params & FrameFlag.EDIT_MODE
        before = self._sequence.lost
        rate = self._frame_rate_hz or self._rate_hz or 120.0
        if self._sequence.arrived(frame.number, times.device_s, rate, live=live) is Arrival.LATE:
            return None
        if self._sequence.lost > before:
            fresh = arrival - self._gap_s > RECENT_S
            self._gap_frames = self._sequence.lost - before + (0 if fresh else self._gap_frames)
            self._gap_s = arrival
        if frame.params & FrameFlag.MODELS_CHANGED and self._speaks:
            self._models_wanted = True
        self._without_ids = bool(len(frame.unlabelled)) and not len(frame.labelled)
        self._received += 1
        self._rate.add(arrival)
        self._rate_hz = self._rate.rate_hz(arrival)
        self._latency_s = times.latency_s
        return self._conversion.frame(frame, times, self._names)

    def _is_ours(self, address: str) -> bool:
        """Whether frames from there are wanted.

        The server's, or of the first that sends any: a server with several network cards may stream from an
        address other than the one that answers.
        """
        return address == self._server or self._source in ("", address)

    def _decode(self, payload: bytes) -> FrameOfData:
        """Raises FormatError. Where nobody told the version, or it was changed, the layout tells itself."""
        version = self._version
        if version is not None:
            try:
                return decode_frame(payload, version)
            except FormatError:
                if self.settings["bitstream"] != "auto" or (found := detect_version(payload)) is None:
                    raise
                self._version = found
                return decode_frame(payload, found)
        found = detect_version(payload)
        if found is None:
            raise FormatError("The frame is of no known NatNet version (2.5 to 4.4).", "Choose the bitstream version.")
        self._version = found
        return decode_frame(payload, found)

    def _times(self, frame: FrameOfData, arrival_s: float) -> Times:
        """By the device's clock, by ours, and the arrival.

        Before 3.0 there is only the frame's timestamp: its exposure is taken to be when the quickest frame came.
        """
        hz = self._info.clock_hz if self._info is not None else 0
        if not hz or not frame.mid_exposure_ticks:
            self._clock.packet(frame.timestamp_s, arrival_s)
            return Times(frame.timestamp_s, self._clock.host_s(frame.timestamp_s, arrival_s), arrival_s)
        exposed = frame.mid_exposure_ticks / hz
        self._clock.packet(frame.transmit_ticks / hz, arrival_s)
        return Times(exposed, self._clock.host_s(exposed, arrival_s), arrival_s)

    # ---- what is told, from any thread

    @property
    def latest(self) -> FrameOfData | None:
        """The last frame as it was on the wire."""
        return self._latest

    def describe(self) -> Description:
        """The server by its own words."""
        info, version, frame = self._info, self._version, self._latest
        details: dict[str, str] = {}
        title = self.title
        if info is not None:
            title = f"{_printable(info.sender.name)} {_dotted(info.sender.app_version)}"
            details["Server"] = f"{self._server}, command port {self._command_port}"
            details["NatNet"] = _dotted(info.sender.natnet_version)
            details["Transmission"] = "multicast" if self._multicast else "unicast"
        if version is not None:
            details["Bitstream"] = f"{version[0]}.{version[1]}"
        if self._mode in _MODES:
            details["Mode"] = _MODES[self._mode]
        if self._conversion.up_axis is not UpAxis.Y:
            details["Up axis"] = f"{self._conversion.up_axis.name}, turned to Y"
        if self._names:
            details["Rigid bodies"] = ", ".join(self._names.values())
        if info is not None and info.clock_hz and frame is not None:
            details["System latency"] = f"{1000 * frame.system_latency_s(info.clock_hz):.2f} ms"
            details["Software latency"] = f"{1000 * frame.software_delay_s(info.clock_hz):.2f} ms"
        if self._clock.synchronised:
            details["Round trip"] = f"{1000 * self._clock.round_trip_s:.2f} ms"
        return Description(title, self._frame_rate_hz or round(self._rate_hz, 1), details)

    def health(self) -> Health:
        """The light and why."""
        level, reason = self._light(host_clock())
        fresh = host_clock() - self._frame_s < NO_FRAMES_S
        return Health(
            level=level,
            reason=reason,
            connected=self._transport is not None and self._lost_since_s is None and (self._speaks or fresh),
            received=self._received,
            lost=self._sequence.lost,
            rejected=self._rejected,
            reconnects=self._reconnects,
            rate_hz=self._rate_hz if fresh else 0.0,
            latency_s=self._latency_s,
            last_error=self._last_error,
            heard=self._heard_text(),
        )

    def _light(self, now: float) -> tuple[Level, str]:
        transport = self._transport
        if transport is None:
            return Level.IDLE, "Not connected."
        name = self.describe().title
        where = f"{name} at {self._server}" if self._speaks else f"multicast {self._group}"
        if self._lost_since_s is not None:
            return Level.PROBLEM, (
                f"{where} has been silent for {now - self._lost_since_s:.0f} s; "
                + ("trying to reach it again. " if self._speaks else "")
                + "Check that Motive runs, the cable and the network."
            )
        if not self._streaming:
            return Level.IDLE, f"Connected to {where}, not streaming."
        if now - self._frame_s > NO_FRAMES_S:
            if now - self._rejected_s < RECENT_S:
                return Level.PROBLEM, f"Packets come from {where} but none is understood. {self._last_error}"
            return Level.WARNING, (
                f"{where} "
                + ("answers but sends no frames. " if self._speaks else "is silent. ")
                + "Check that streaming is on in Motive, and in playback that it plays"
                + (
                    f"; that it sends on interface {transport.local or 'of this network'} "
                    "and no firewall stops multicast."
                    if self._multicast
                    else "."
                )
            )
        if now - self._rejected_s < RECENT_S:
            return Level.WARNING, f"{self._rejected} packets could not be understood. {self._last_error}"
        if now - self._gap_s < RECENT_S:
            return Level.WARNING, (
                f"{self._gap_frames} frames lost on the way just now, {self._sequence.lost} in all. "
                "Use a cable, and a network of its own for the cameras."
            )
        if transport.granted_buffer < RECEIVE_BUFFER:
            return Level.WARNING, (
                f"Receiving, but the system grants a buffer of only {transport.granted_buffer // 1024} kB "
                f"of {RECEIVE_BUFFER // 1024}: frames may be lost while the machine is busy. "
                "Linux: sysctl net.core.rmem_max=4194304."
            )
        if self._without_ids:
            return Level.WARNING, "Points come without ids. Switch on Labeled Markers in Motive (Settings, Streaming)."
        return Level.GOOD, f"Receiving from {where}."

    def _heard_text(self) -> str:
        version = self._version
        texts = []
        for address, (frames, others, rejected) in list(self._heard.items()):
            ours = "" if frames == 0 or address in (self._source, self._server) else ", not used"
            of = f" of NatNet {version[0]}.{version[1]}" if version and frames and not ours else ""
            parts = [f"{frames} frames{of}{ours}"] * bool(frames) + [f"{others} answers"] * bool(others)
            parts += [f"{rejected} not understood"] * bool(rejected)
            texts.append(f"{address}: " + ", ".join(parts))
        if not texts:
            return ""
        interface = self._transport.local if self._transport is not None and self._transport.local else "any interface"
        by = "multicast" if self._multicast else "unicast"
        return "; ".join(texts) + f" ({by}, on {interface})."


def _multicast_group(text: str) -> str:
    group = resolve(text)
    if not 224 <= int(group.split(".")[0]) <= 239:
        raise DeviceError(
            f"{text} is no multicast group.", "Choose 224.0.0.0 to 239.255.255.255; Motive: 239.255.42.99."
        )
    return group


def _server_info(datagram: Datagram) -> ServerInfo | None:
    try:
        message, payload = protocol.unpack(datagram.data)
        return protocol.decode_server_info(payload) if message == Message.SERVERINFO else None
    except FormatError:
        return None


def _try_send(transport: Transport, packet: bytes, address: str, port: int) -> None:
    with contextlib.suppress(OSError):  # this interface reaches nobody
        transport.send(packet, address, port)


def _printable(name: str) -> str:
    return name.encode("utf-8", "replace").decode("utf-8", "replace")


def _dotted(version: Sequence[int]) -> str:
    return ".".join(str(part) for part in version[:2])
