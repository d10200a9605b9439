"""The command channel of a NatNet client: who the server is, what it says of itself, whether it is still there."""

from __future__ import annotations

import contextlib
from collections import deque

from core.errors import DeviceError
from core.printable import named
from core.streams import ClockSample
from devices.common.addresses import route_to
from devices.common.clock import host_clock
from devices.common.clock_sync import ClockSync
from devices.common.udp import Datagram, Udp
from devices.natnet import protocol
from devices.natnet.convert import UpAxis
from devices.natnet.models import AssetModel, RigidBodyModel, decode_models
from devices.natnet.protocol import Connect, Message, Sender, ServerInfo
from devices.natnet.wire import Version

REQUEST_TIMEOUT_S = 1.0
REQUEST_TRIES = 3
ECHO_INTERVAL_S = 0.5
FIRST_ECHOES = 6
FIRST_ECHO_INTERVAL_S = 0.015
KEEPALIVE_INTERVAL_S = 1.0
IDLE_S = 0.1
"""How long nothing may be due [s]."""
SILENCE_S = 2.0
"""A server silent for this long is gone: it is asked for an echo twice a second [s]."""
LONGEST_BACKOFF_S = 5.0
ECHOES_WAITED_FOR = 32
MOST_DOUBTS = 9

_WHO = Sender("Phalanx", (0, 1, 0, 0), (4, 2, 0, 0))
_WHO_OLD = Sender("Phalanx", (0, 1, 0, 0), (3, 0, 0, 0))

DISCOVERY = protocol.pack(Message.DISCOVERY, _WHO_OLD.encode())


class Conversation:
    """With one server, from opening to closing. Driven by the receiving thread; attributes are read by any.

    Only the server's own address is believed, and only what it was asked. Its replies mostly come from the port that
    was asked: one from another port counts where nothing came from there in time. What changes a setting that every
    frame hangs on must be said twice.

    server: its address, "" to listen only. bitstream: the version to ask for and to expect, None for the server's.
    """

    def __init__(self, sockets: Udp, server: str, port: int, bitstream: Version | None) -> None:
        self.server = server
        self.port = port
        self.chosen = bitstream
        self.version = bitstream
        self.info: ServerInfo | None = None
        self.multicast = not server
        self.short_form = False
        self.clock = ClockSync()
        self.names: dict[int, str] = {}
        self.frame_rate_hz = 0.0
        self.scale_m = 1.0
        self.up_axis = UpAxis.Y
        self.mode = -1
        self.lost_since_s: float | None = None
        self.reconnects = 0
        self.last_error = ""

        self._sockets = sockets
        now = host_clock()
        self._met = False  # something was heard
        self._heard_s = now
        self._kept_s = now  # when last something was done
        self._greeting = False  # SERVERINFO is awaited
        self._greetings = 0  # sent for it
        self._greet_s = now
        self._backoff_s = 0.0
        self._requests: deque[str] = deque()
        self._asked = False  # the first of them is under way
        self._asked_s = now
        self._request_tries = 0
        self._request_s = now
        self._said: dict[str, float] = {}  # what must be said again to be believed
        self._doubts = 0  # answers that had to be asked for again
        self._model_tries = 0  # left
        self._models_asked = 0  # times, until they come
        self._models_s = now
        self._first_echoes = 0  # left
        self._echo_s = now
        self._echoes_sent: deque[int] = deque(maxlen=ECHOES_WAITED_FOR)
        self._keepalive_s = now
        self._compared: list[ClockSample] = []

    @property
    def speaks(self) -> bool:
        """Whether there is a server to speak with."""
        return bool(self.server)

    @property
    def settled(self) -> bool:
        """Whether the server has answered all it was asked, or has had its chance."""
        info = self.info
        timed = info is None or not info.clock_hz or (self.clock.synchronised and not self._first_echoes)
        return timed and not self._requests and not self._model_tries

    @property
    def clock_hz(self) -> int:
        """Ticks of the server's clock per second, 0 if it has none."""
        return self.info.clock_hz if self.info is not None else 0

    def greet(self) -> None:
        """Say CONNECT (again), until SERVERINFO comes: a server forgets a client that was silent."""
        if self.speaks:
            self._greeting, self._greetings, self._greet_s = True, 0, host_clock()

    def resume(self) -> None:
        """Frames are wanted from now on; a pause of ours is no silence of the server's."""
        self._heard_s = host_clock()
        self.greet()

    def hello(self) -> None:
        """One CONNECT. Raises DeviceError if there is no way to the server."""
        self._greeting = True
        self._greetings += 1
        self._greet_s = host_clock() + 1.0
        try:
            self._send(Message.CONNECT, self._hello())
        except OSError as error:
            raise DeviceError(
                f"{self.server} cannot be reached from {self._sockets.local or 'here'} ({error.strerror}).",
                "Check the server address, the cable and the local interface.",
            ) from error

    def want_models(self) -> None:
        """The server says that its models have changed."""
        if self.speaks and not self._model_tries:
            self._model_tries, self._models_s = REQUEST_TRIES, host_clock()

    def goodbye(self) -> None:
        """The server need not send any more."""
        if self.speaks and self.info is not None:
            self._attempt(Message.DISCONNECT)

    # ---- what is due

    def keep_up(self, now: float, frames_missing_s: float) -> float:
        """Send what is due at `now`; when to come again.

        frames_missing_s: for how long no frame has come though some are wanted.
        """
        pause = now - self._kept_s
        self._kept_s = now
        if pause > SILENCE_S / 2:
            self._heard_s += pause  # ours, no silence of the server's: its packets are waiting
            self._first_echoes, self._echo_s = FIRST_ECHOES, now  # and its clock went on
        silent = self._met and now - self._heard_s > SILENCE_S
        if silent and self.lost_since_s is None:
            self.lost_since_s = self._heard_s
            self.greet()
            self._backoff_s, self._greet_s = 0.5, now
        if not self.speaks:
            if self.lost_since_s is not None and now >= self._greet_s:
                self._sockets.rejoin()
                self._greet_s = now + LONGEST_BACKOFF_S
            return now + IDLE_S
        if not self.multicast and frames_missing_s > SILENCE_S and now - self._greet_s > SILENCE_S:
            self.greet()  # it answers and sends nothing: it may have been started anew
        if self._greeting and now >= self._greet_s:
            if self.lost_since_s is not None:
                self._follow_route()
                self._sockets.rejoin()
            self._attempt(Message.CONNECT, self._hello())
            self._greetings += 1
            if self.lost_since_s is not None:
                self._backoff_s = min(2 * self._backoff_s, LONGEST_BACKOFF_S)
            self._greet_s = now + max(1.0, self._backoff_s)
        if self.lost_since_s is None:
            self._ask(now)
        return now + IDLE_S

    def _ask(self, now: float) -> None:
        if self._requests and now >= self._request_s:
            if self._request_tries == REQUEST_TRIES:
                self._next_request()
            else:
                self._attempt(Message.REQUEST, protocol.encode_request(self._requests[0]))
                self._asked = True
                if not self._request_tries:
                    self._asked_s = now
                self._request_tries += 1
                self._request_s = now + REQUEST_TIMEOUT_S
        if self._model_tries and now >= self._models_s:
            self._attempt(Message.REQUEST_MODELDEF)
            self._models_asked += 1
            self._model_tries -= 1
            self._models_s = now + REQUEST_TIMEOUT_S
        if self.clock_hz and now >= self._echo_s:
            ticks = int(host_clock() * 1e9)
            self._echoes_sent.append(ticks)
            self._attempt(Message.ECHOREQUEST, protocol.encode_echo_request(ticks))
            self._first_echoes = max(0, self._first_echoes - 1)
            soon = self._first_echoes or self.clock.doubted
            self._echo_s = now + (FIRST_ECHO_INTERVAL_S if soon else ECHO_INTERVAL_S)
        if not self.multicast and now >= self._keepalive_s:
            self._attempt(Message.KEEPALIVE)
            self._keepalive_s = now + KEEPALIVE_INTERVAL_S

    def _hello(self) -> bytes:
        if self.short_form:
            return Connect(_WHO_OLD, None).encode()
        wanted = self.chosen if self.chosen is not None and self.chosen >= (4, 0) else (0, 0)
        return Connect(_WHO, wanted).encode()

    def _send(self, message: int, payload: bytes = b"") -> None:
        self._sockets.send(protocol.pack(message, payload), self.server, self.port)

    def _attempt(self, message: int, payload: bytes = b"") -> None:
        try:
            self._send(message, payload)
        except OSError as error:
            self.last_error = f"Sending to {self.server} failed: {error.strerror}."

    # ---- what comes

    def heard(self, now: float) -> None:
        """Something understandable came from the server, at `now` or, having waited to be read, before."""
        self._met = True
        self._heard_s = max(self._heard_s, now)
        if self.lost_since_s is not None:
            self.lost_since_s = None
            self.reconnects += 1
            self.greet()  # it may be another version, with other models

    def compared(self) -> list[ClockSample]:
        """What the echoes told that were answered since the last call."""
        samples, self._compared = self._compared, []
        return samples

    def take(self, message: int, payload: bytes, datagram: Datagram) -> bool:
        """A message that is no frame: whether it was for us. Raises FormatError; the session goes on."""
        if datagram.address != self.server or not self._do(message, payload, datagram):
            return False
        self.heard(datagram.arrival_s)
        return True

    def _do(self, message: int, payload: bytes, datagram: Datagram) -> bool:
        """What the server's address says; whether it was asked for, and by all signs comes from the server."""
        match message:
            case Message.SERVERINFO:
                return self._greeted(protocol.decode_server_info(payload), datagram)
            case Message.RESPONSE:
                if not self._asked or not self._expected(datagram, self._request_tries):
                    return False
                again = self._answered(self._requests[0], payload)
                self._next_request(again)
            case Message.UNRECOGNIZED_REQUEST:
                if not self._asked or not self._expected(datagram, self._request_tries):
                    return False
                self._next_request()
            case Message.MODELDEF:
                if not self._models_asked or not self._expected(datagram, self._models_asked):
                    return False
                models = decode_models(payload, self.version or protocol.NEWEST)
                bodies = [model for model in models if isinstance(model, RigidBodyModel | AssetModel)]
                self.names = {body.id: named(body.name, f"Rigid body {body.id}") for body in bodies}
                self._model_tries = self._models_asked = 0
            case Message.ECHORESPONSE:
                client, server = protocol.decode_echo_response(payload)
                if client not in self._echoes_sent:
                    return False
                self._echoes_sent.remove(client)
                if self.clock_hz:
                    self._compare(client * 1e-9, server / self.clock_hz, datagram.arrival_s)
                    if self.clock.doubted:
                        self._echo_s = min(self._echo_s, host_clock() + FIRST_ECHO_INTERVAL_S)
            case _:
                return datagram.port == self.port
        return True

    def _compare(self, sent_s: float, server_s: float, received_s: float) -> None:
        """An echo: our clock, the server's, ours."""
        self.clock.echo(sent_s, server_s, received_s)
        if (round_trip_s := received_s - sent_s) >= 0:
            self._compared.append(ClockSample(server_s, (sent_s + received_s) / 2, round_trip_s))

    def _expected(self, datagram: Datagram, tries: int) -> bool:
        """Whether a reply is the server's: it comes from the port that was asked, or nothing came from there."""
        return datagram.port == self.port or tries > 1

    def _greeted(self, info: ServerInfo, datagram: Datagram) -> bool:
        if self._greeting and self._expected(datagram, self._greetings):
            self.heard(datagram.arrival_s)
            self._introduced(info)
            return True
        if info != self.info and datagram.port == self.port and not self._greeting and self.lost_since_s is None:
            self.greet()  # not asked for: a server that began anew may say so, and is asked
        return False

    def _follow_route(self) -> None:
        """The address that this machine had for the server may be gone: another network, or another lease."""
        if self._sockets.follows:
            local = route_to(self.server)
            if local and local != self._sockets.local:
                with contextlib.suppress(OSError):  # not yet; it comes again
                    self._sockets.move(local)

    def _introduced(self, info: ServerInfo) -> None:
        """SERVERINFO: ask for all the rest."""
        if info != self.info:
            self.clock.reset()
            self._said.clear()
            if self.chosen is None:
                self.version = info.sender.version
        self.info = info
        self._greeting = False
        under_way = [self._requests[0]] if self._asked else []
        self._requests = deque((*under_way, "FrameRate", "UnitsToMillimeters", "UpAxis", "CurrentMode"))
        if info.sender.version >= (4, 0) and not info.multicast:
            self._requests.append("Bitstream")
        now = host_clock()
        if not self._asked:
            self._request_tries, self._request_s = 0, now
        self._model_tries, self._models_s = REQUEST_TRIES, now
        self._first_echoes, self._echo_s = FIRST_ECHOES, now
        self._doubts = 0

    def _next_request(self, again: bool = False) -> None:
        """A RESPONSE does not say to what: one request is under way at a time, and the further answers to one that
        was repeated are left to come, at the pace of the first, and ignored.
        """
        done = self._requests.popleft()
        if again:
            self._requests.appendleft(done)
        self._asked = False
        now = host_clock()
        self._request_s = now
        if self._request_tries > 1:
            self._request_s += (now - self._asked_s) + REQUEST_TIMEOUT_S / 4
        self._request_tries = 0

    def _answered(self, command: str, payload: bytes) -> bool:
        """Whether to ask again: what one answer alone says may be spoilt."""
        match command:
            case "FrameRate":
                rate = protocol.decode_float(payload)
                if 0 < rate < 1e5 and rate != self.frame_rate_hz:
                    if not self._said_twice(command, rate):
                        return self._ask_again(command)
                    self.frame_rate_hz = rate
            case "UnitsToMillimeters":
                scale_m = protocol.decode_float(payload) / 1000.0
                if 0 < scale_m < 1e6 and scale_m != self.scale_m:
                    if not self._said_twice(command, scale_m):
                        return self._ask_again(command)
                    self.scale_m = scale_m
            case "UpAxis":
                axis = protocol.decode_int(payload)
                if axis in tuple(UpAxis) and axis != self.up_axis:
                    if not self._said_twice(command, axis):
                        return self._ask_again(command)
                    self.up_axis = UpAxis(axis)
            case "CurrentMode":
                self.mode = protocol.decode_int(payload)
            case "Bitstream":
                version = protocol.decode_bitstream(payload)
                if self.chosen is None:
                    self.version = version
        return False

    def _said_twice(self, command: str, value: float) -> bool:
        before = self._said.get(command)
        self._said[command] = value
        return before == value

    def _ask_again(self, command: str) -> bool:
        """Whether it makes sense to."""
        self._doubts += 1
        if self._doubts > MOST_DOUBTS:
            self.last_error = f"{self.server} answers {command} differently each time."
        return self._doubts <= MOST_DOUBTS
