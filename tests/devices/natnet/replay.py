"""A server that does over a socket what the real one did in the capture: same answers, same frames, same pace."""

from __future__ import annotations

import contextlib
import socket
import threading
import time

from devices.natnet import protocol
from devices.natnet.frames import decode_frame
from devices.natnet.protocol import Message
from tests.devices.natnet.capture import traffic

CLOCK_HZ = 3312787


class ReplayServer:
    """Answers on a free port of 127.0.0.1; sends the frames to a multicast group on the loopback interface."""

    def __init__(self, group: str, data_port: int) -> None:
        self.target = (group, data_port)
        self._answers: dict[int, bytes] = {}
        self._responses: dict[str, bytes] = {}
        self.frames: list[tuple[int, bytes]] = []  # ticks of its sending, packet
        command = ""
        for captured in traffic():
            message, payload = protocol.unpack(captured.data)
            match message:
                case Message.REQUEST:
                    command = protocol.decode_request(payload)
                case Message.RESPONSE:
                    self._responses[command] = captured.data
                case Message.FRAMEOFDATA:
                    self.frames.append((decode_frame(payload, (3, 0)).transmit_ticks, captured.data))
                case Message.SERVERINFO | Message.MODELDEF | Message.UNRECOGNIZED_REQUEST:
                    self._answers[message] = captured.data
        self._command = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._command.bind(("127.0.0.1", 0))
        self._command.settimeout(0.05)
        self.command_port = self._command.getsockname()[1]
        self._data = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._data.bind(("127.0.0.1", 0))
        self._data.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        self._closing = threading.Event()
        self._begin_s = time.perf_counter()
        self._thread = threading.Thread(target=self._answer)
        self._thread.start()

    def host_s(self, ticks: int) -> float:
        """When the capture's clock shows `ticks` in this replay."""
        return self._begin_s + (ticks - self.frames[0][0]) / CLOCK_HZ

    def play(self) -> None:
        """Send every frame when the capture's clock says so."""
        for ticks, packet in self.frames:
            time.sleep(max(0.0, self.host_s(ticks) - time.perf_counter()))
            self._data.sendto(packet, self.target)

    def play_fast(self) -> None:
        """Send every frame, a millisecond apart."""
        for _, packet in self.frames:
            time.sleep(0.001)
            self._data.sendto(packet, self.target)

    def rewind(self, lead_s: float = 1.0) -> None:
        """The first frame goes out `lead_s` from now."""
        self._begin_s = time.perf_counter() + lead_s

    def close(self) -> None:
        self._closing.set()
        self._thread.join()
        self._command.close()
        self._data.close()

    def _answer(self) -> None:
        while not self._closing.is_set():
            with contextlib.suppress(TimeoutError):
                packet, address = self._command.recvfrom(65535)
                answer = self._reply(*protocol.unpack(packet))
                if answer is not None:
                    self._command.sendto(answer, address)

    def _reply(self, message: int, payload: bytes) -> bytes | None:
        match message:
            case Message.CONNECT | Message.DISCOVERY:
                return self._answers[Message.SERVERINFO]
            case Message.REQUEST_MODELDEF:
                return self._answers[Message.MODELDEF]
            case Message.REQUEST:
                unknown = self._answers[Message.UNRECOGNIZED_REQUEST]
                return self._responses.get(protocol.decode_request(payload), unknown)
            case Message.ECHOREQUEST:
                client = protocol.decode_echo_request(payload)
                ticks = self.frames[0][0] + round((time.perf_counter() - self._begin_s) * CLOCK_HZ)
                return protocol.pack(Message.ECHORESPONSE, protocol.encode_echo_response(client, ticks))
        return None
