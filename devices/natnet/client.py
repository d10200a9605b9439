"""OptiTrack Motive as a device: a NatNet client."""

from __future__ import annotations

import contextlib
import math
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import replace

from core.errors import DeviceError, FormatError, NoAnswerError
from core.streams import Record, Sample, StreamInfo
from devices.common.addresses import is_multicast, local_addresses, resolve, route_to
from devices.common.clock import StandstillWatch, host_clock
from devices.common.health import NO_FRAMES_S
from devices.common.hearing import Hearing
from devices.common.source import Source
from devices.common.udp import Datagram, Udp
from devices.device import Description, Device, Found, Health, Level, Parameter
from devices.natnet import protocol
from devices.natnet.conversation import SILENCE_S, Conversation
from devices.natnet.convert import POINT_CHOICES, UpAxis
from devices.natnet.discovery import application, discover, dotted
from devices.natnet.intake import Intake
from devices.natnet.protocol import Message, ServerInfo
from devices.natnet.records import FrameOfData
from devices.natnet.wire import Version

CONNECT_AT_S = (0.0, 0.7, 1.4, 2.1, 2.8)
"""When CONNECT is sent [s]; from the fourth on in the short form that servers before 4.0 know."""
LONG_FORMS = 3
CONNECT_TIMEOUT_S = 3.5
SETUP_TIMEOUT_S = 3.0
MARKERS = "markers"
"""Key of its stream."""
_AUTOMATIC, _UNICAST, _MULTICAST, _LISTEN = "automatic", "unicast", "multicast", "listen only"
_BITSTREAMS = ("auto", "2.5", "2.6", "2.7", "2.8", "2.9", "2.10", "3.0", "3.1", "4.0", "4.1", "4.2", "4.3", "4.4")
_MODES = {0: "live", 1: "recording", 2: "edit"}


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
        """Raises DeviceError for a setting that is unknown or out of range."""
        super().__init__(**settings)
        self._group = str(self.settings["group"]).strip()
        if not is_multicast(self._group):
            raise DeviceError(f"{self._group!r} is no multicast group.", "Motive's own is 239.255.42.99.")
        self._sockets: Udp | None = None
        self._conversation: Conversation | None = None
        self._intake = Intake(str(self.settings["points"]))
        self._hearing = Hearing()
        self._reconnects = 0  # of conversations that are over
        self._streaming = False
        self._ready: deque[Sample] = deque()  # taken, not yet handed on
        self._started_s = 0.0
        self._watch = StandstillWatch()
        self._source = Source("")
        self._data_port_tried = False

    @property
    def address(self) -> str:
        """That of the server; of the group where the server is not asked. The port, where it is not Motive's own."""
        listening = self.settings["transmission"] == _LISTEN
        host = self._group if listening else str(self.settings["server"])
        port = int(self.settings["data_port" if listening else "command_port"])
        usual = protocol.DATA_PORT if listening else protocol.COMMAND_PORT
        return host if port == usual else f"{host}:{port}"

    @classmethod
    def discover(cls, timeout_s: float = 1.0) -> Sequence[Found]:
        """Servers of the local networks that answer on the usual port."""
        return discover(timeout_s)

    def open(self) -> None:
        """Take the sockets and greet the server. Raises DeviceError; the device is then closed."""
        self.close()
        try:
            self._open()
        except BaseException:
            self.close()
            raise

    def start(self) -> None:
        """Hand on frames from now on. Raises DeviceError if the device is not open."""
        if self._sockets is None or self._conversation is None:
            raise DeviceError(f"{self.title} is not open.", "Connect it first.")
        self._sockets.drain()
        self._intake.tally.sequence.forget()
        self._ready.clear()
        self._started_s = host_clock()
        self._source.begin(self._started_s)
        self._watch.begin()
        self._conversation.resume()
        self._streaming = True

    def streams(self) -> tuple[StreamInfo, ...]:
        """All points of the server's cameras."""
        talk = self._conversation
        if talk is None:
            return ()
        return (
            StreamInfo(
                MARKERS,
                self.kind,
                self.describe().title,
                "markers",
                talk.frame_rate_hz or math.nan,
                ids="sight",
                quality="residual",
                clock_hz=talk.clock_hz or math.nan,
                axes=f"right-handed, {talk.up_axis.name} up",
            ),
        )

    def read(self, timeout_s: float) -> Sample | None:
        """The next frame, or comparison of the clocks, waiting at most `timeout_s`."""
        return self._pump(timeout_s) if self._streaming else None

    def stop(self) -> None:
        """Hand on no more frames."""
        self._streaming = False

    def close(self) -> None:
        """Say goodbye and give the sockets back."""
        self._streaming = False
        if self._conversation is not None:
            self._conversation.goodbye()
            self._reconnects += self._conversation.reconnects
            self._conversation = None
        if self._sockets is not None:
            self._sockets.close()
            self._sockets = None

    @property
    def _interface(self) -> str:
        """Which one is used, for people."""
        sockets = self._sockets
        return (sockets.local if sockets is not None else "") or "any interface"

    # ---- opening

    def _open(self) -> None:
        setting = self.settings
        listening = setting["transmission"] == _LISTEN
        local = str(setting["local"]).strip()
        local = resolve(local) if local else ""
        server = "" if listening else resolve(str(setting["server"]))
        on_the_way = route_to(server) if server else ""
        # Bound to the interface of the server: strangers on other networks cannot reach it.
        sockets = self._sockets = Udp(local or on_the_way, follows=not local and bool(server))
        talk = Conversation(sockets, server, int(setting["command_port"]), _version(str(setting["bitstream"])))
        self._conversation = talk
        self._source = Source(server, {talk.port})
        self._source.begin(host_clock())
        self._data_port_tried = False
        self._hearing.forget()
        port, group = int(setting["data_port"]), self._group
        if listening:
            interfaces = [local] if local else local_addresses()
        else:
            info = self._greet(talk)
            interfaces = [sockets.local or "127.0.0.1"]
            talk.multicast = setting["transmission"] == _MULTICAST
            if setting["transmission"] == _AUTOMATIC:
                talk.multicast = info.multicast
                # A server that broadcasts fills these two with nonsense.
                port = info.data_port if info.data_port > 1023 else port
                group = info.group if is_multicast(info.group) else group
            self._source.ports |= {port, info.data_port}
        if talk.multicast:
            sockets.listen(port, "NatNet")
            sockets.join(group, interfaces)
        if not listening:
            end = host_clock() + SETUP_TIMEOUT_S
            while host_clock() < end and not talk.settled:
                self._pump(0.02)

    def _greet(self, talk: Conversation) -> ServerInfo:
        """CONNECT until SERVERINFO. Raises NoAnswerError."""
        begin = host_clock()
        for attempt, at in enumerate((*CONNECT_AT_S, CONNECT_TIMEOUT_S)):
            while talk.info is None and (left := begin + at - host_clock()) > 0:
                self._pump(min(left, 0.05))
            if talk.info is not None:
                return talk.info
            talk.short_form = attempt >= LONG_FORMS
            if at < CONNECT_TIMEOUT_S:
                talk.hello()
        heard = self._hearing.text()
        raise NoAnswerError(
            f"No NatNet server answers at {talk.server}, port {talk.port}, asked from {self._interface}.",
            "Start Motive and switch on streaming (Settings, Streaming); check the address and the firewall."
            + (f" Heard meanwhile: {heard}." if heard else ""),
        )

    # ---- receiving

    def _pump(self, timeout_s: float) -> Sample | None:
        """Send what is due, take what comes, until a sample is ready or the time is over."""
        sockets, talk = self._sockets, self._conversation
        if sockets is None or talk is None:
            return None
        if self._ready:
            return self._ready.popleft()
        now = host_clock()
        end = now + timeout_s
        while True:
            missing = now - max(self._started_s, self._intake.tally.latest_s) if self._streaming else 0.0
            if missing > SILENCE_S:
                self._try_data_port(sockets, talk)
            wake = min(end, talk.keep_up(now, missing))
            try:
                datagram = sockets.receive(wake - now)
            except OSError as error:
                talk.last_error = f"Receiving failed: {error.strerror}."
                time.sleep(0.01)
                datagram = None
            if self._streaming and (standstill := self._watch.turn()) is not None:
                self._intake.tally.standstills.append(standstill)
            if datagram is not None:
                self._ready.extend(Sample(MARKERS, one) for one in self._take(datagram, talk))
            if self._ready:
                return self._ready.popleft()
            now = host_clock()
            if now >= end:
                return None

    def _try_data_port(self, sockets: Udp, talk: Conversation) -> None:
        """Some old servers send unicast to the data port, not to where they were asked from.

        Never beside a server on this machine, whose own port it is.
        """
        if sockets.listening is None and not self._data_port_tried and talk.server not in local_addresses():
            with contextlib.suppress(DeviceError):
                sockets.listen(int(self.settings["data_port"]), "NatNet", sockets.local)
        self._data_port_tried = True

    def _take(self, datagram: Datagram, talk: Conversation) -> Sequence[Record]:
        """One datagram: what is to be handed on."""
        sender = datagram.address, datagram.port
        hearing, intake, source = self._hearing, self._intake, self._source
        ours = datagram.address == talk.server
        counts = sender == source.current or (ours and datagram.port in source.ports)
        at_s = datagram.arrival_s - datagram.slack_s
        try:
            message, payload = protocol.unpack(datagram.data)
            if message != Message.FRAMEOFDATA:
                used = datagram.spoken and talk.take(message, payload, datagram)
                if used or counts:  # it may answer twice what was asked twice
                    hearing.answer(datagram.address)
                else:
                    hearing.other(*sender, talk.server)
                compared = talk.compared()
                return compared if self._streaming else []
            if not source.admits(sender, at_s):
                hearing.other_frame(*sender, talk.server, datagram.arrival_s)
                return []
            if not self._streaming:
                hearing.frame(datagram.address)
                source.use(sender, at_s)
                return []
            counts, spoilt = True, intake.tally.sequence.spoilt
            frames = intake.take(payload, datagram, talk)
            if more := intake.tally.sequence.spoilt - spoilt:
                hearing.reject(datagram.address, _SPOILT, datagram.arrival_s, more)
            hearing.frame(datagram.address)
            source.use(sender, at_s)
            if not source.stranger or not talk.speaks:
                talk.heard(datagram.arrival_s)
            return frames
        except FormatError as error:
            if counts:
                hearing.reject(datagram.address, str(error), datagram.arrival_s)
            else:
                hearing.other(*sender, talk.server)
        return []

    # ---- what is told, from any thread

    @property
    def latest(self) -> FrameOfData | None:
        """The last frame as it was on the wire."""
        return self._intake.latest

    def describe(self) -> Description:
        """The server in its own words."""
        talk, frame = self._conversation, self._intake.latest
        if talk is None:
            return Description(self.title)
        info = talk.info
        details: dict[str, str] = {}
        if info is not None:
            details["Server"] = f"{talk.server}, command port {talk.port}"
            details["NatNet"] = dotted(info.sender.natnet_version)
        details["Transmission"] = "multicast" if talk.multicast else "unicast"
        details["Interface"] = self._interface
        if talk.version is not None:
            details["Bitstream"] = dotted(talk.version)
        if talk.mode in _MODES:
            details["Mode"] = _MODES[talk.mode]
        if talk.up_axis is not UpAxis.Y:
            details["Up axis"] = f"{talk.up_axis.name}, turned to Y"
        if talk.names:
            details["Rigid bodies"] = ", ".join(talk.names.values())
        if talk.clock_hz and frame is not None and frame.mid_exposure_ticks:
            details["System latency"] = f"{1000 * frame.system_latency_s(talk.clock_hz):.2f} ms"
            details["Software latency"] = f"{1000 * frame.software_delay_s(talk.clock_hz):.2f} ms"
        if talk.clock.synchronised:
            details["Round trip"] = f"{1000 * talk.clock.round_trip_s:.2f} ms"
        title = application(info) if info is not None else self.title
        return Description(title, talk.frame_rate_hz or self._intake.tally.rate_hz, details)

    def health(self) -> Health:
        """The light and why."""
        now = host_clock()
        talk, tally, hearing = self._conversation, self._intake.tally, self._hearing
        health = tally.health(*self._light(now), now, hearing)
        if talk is None:
            return replace(health, reconnects=self._reconnects)
        form = f"NatNet {dotted(talk.version)}" if talk.version is not None else ""
        return replace(
            health,
            connected=talk.lost_since_s is None and (talk.speaks or tally.fresh(now)),
            reconnects=self._reconnects + talk.reconnects,
            last_error=hearing.last_error or talk.last_error,
            heard=tally.heard(hearing.text(form), self._interface, "the server"),
        )

    def _light(self, now: float) -> tuple[Level, str]:
        sockets, talk, tally, hearing = self._sockets, self._conversation, self._intake.tally, self._hearing
        if sockets is None or talk is None:
            return Level.IDLE, "Not connected."
        server = f"{application(talk.info)} at {self.address}" if talk.info is not None else f"Group {self._group}"
        if talk.lost_since_s is not None:
            return Level.PROBLEM, (
                f"{server} has been silent for {now - talk.lost_since_s:.0f} s. Trying to reach it again; "
                "check that Motive runs, the cable and the network."
            )
        if not self._streaming:
            return Level.IDLE, f"Connected to {server}, not streaming."
        if now - max(tally.latest_s, self._started_s) > NO_FRAMES_S:
            if hearing.not_understood(now):
                return Level.PROBLEM, f"Nothing of {server} is understood. {hearing.last_error}"
            advice = "Check that streaming is on in Motive and, in a take, that it plays"
            if talk.multicast:
                advice += f"; that it streams on the network of {self._interface}, and that no firewall stops multicast"
            return Level.WARNING, f"{server} {'answers but sends no frames' if talk.speaks else 'is silent'}. {advice}."
        warning = (
            hearing.not_understood(now)
            or tally.losses(now, "Use a cable, and a network of the cameras' own.")
            or hearing.not_used(now)
            or self._of_a_stranger
            or tally.without_time(now)
            or (_WITHOUT_IDS if self._intake.without_ids else "")
        )
        if warning:
            return Level.WARNING, warning
        if sockets.small_buffer:
            return Level.WARNING, f"Receiving from {server}, but {sockets.small_buffer}"
        return Level.GOOD, f"Receiving from {server}."

    @property
    def _of_a_stranger(self) -> str:
        """What to say of frames that come from another address than at first, "" if they do not."""
        if not (stranger := self._source.stranger):
            return ""
        return (
            f"{self._source.expected} sends no frames any more: these come from {stranger}. "
            "Check which server is the right one, and connect again."
        )


_SPOILT = "The number or the time of a frame is not borne out by the frames behind it."
_WITHOUT_IDS = "Points come without ids. Switch on labeled markers in Motive (Settings, Streaming)."


def _version(text: str) -> Version | None:
    if text == "auto":
        return None
    major, minor = text.split(".")
    return int(major), int(minor)
