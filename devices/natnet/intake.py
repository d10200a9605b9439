"""Frames of a NatNet stream: decoded, counted, timed, converted."""

from __future__ import annotations

import math

from core.errors import FormatError
from core.frames import MarkerFrame, Times
from devices.common.counting import Arrival
from devices.common.health import Tally
from devices.common.stamps import Came
from devices.common.timing import Timing, mapped
from devices.common.udp import Datagram
from devices.natnet.conversation import Conversation
from devices.natnet.convert import Conversion
from devices.natnet.frames import decode_frame, detect_version
from devices.natnet.records import FrameFlag, FrameOfData


class Intake:
    """What is made of the frames. Fed by the receiving thread, read by any."""

    def __init__(self, points: str) -> None:
        self.tally: Tally[FrameOfData] = Tally()
        self.latest: FrameOfData | None = None
        self.without_ids = False
        self._timing = Timing()
        self._points = points

    def take(self, payload: bytes, datagram: Datagram, conversation: Conversation) -> list[MarkerFrame]:
        """A FRAMEOFDATA payload: what is to be handed on now, mostly one frame. Raises FormatError."""
        frame = self.latest = _decode(payload, conversation)
        if frame.params & FrameFlag.MODELS_CHANGED:
            conversation.want_models()
        ready = self.tally.arrived(
            frame,
            frame.number,
            _device_s(frame, conversation),
            Came(datagram.arrival_s, datagram.slack_s),
            conversation.frame_rate_hz,
            live=not frame.params & FrameFlag.EDIT_MODE,
        )
        return [self._hand_on(*one, conversation) for one in ready]

    def _hand_on(self, frame: FrameOfData, came: Came, said: Arrival, conversation: Conversation) -> MarkerFrame:
        if said is Arrival.RESTART:
            conversation.clock.begin_anew()
        times = _times(frame, came, conversation)
        if said is Arrival.RESTART:
            self._timing.restarted(times)
        times = self._timing.in_order(times)
        self.without_ids = bool(len(frame.unlabelled)) and not len(frame.labelled)
        self.tally.handed_on(times)
        conversion = Conversion(conversation.up_axis, conversation.scale_m, self._points)
        return conversion.frame(frame, times, conversation.names)


def _decode(payload: bytes, conversation: Conversation) -> FrameOfData:
    """Raises FormatError. Where nobody told the version, or it was changed meanwhile, the layout tells itself."""
    version = conversation.version
    if version is not None:
        try:
            return decode_frame(payload, version)
        except FormatError as error:
            found = detect_version(payload)
            if found is None:
                raise
            if conversation.chosen is not None:
                raise FormatError(
                    error.what, f"It is a frame of NatNet {found[0]}.{found[1]}: set the bitstream version to auto."
                ) from error
    else:
        found = detect_version(payload)
        if found is None:
            raise FormatError("The frame is of no known NatNet version (2.5 to 4.4).", "Choose the bitstream version.")
    conversation.version = found
    return decode_frame(payload, found)


def _device_s(frame: FrameOfData, conversation: Conversation) -> float:
    """When it was exposed, by the server's clock [s]; NaN if it has none."""
    hz = conversation.clock_hz
    return frame.mid_exposure_ticks / hz if hz and frame.mid_exposure_ticks else frame.timestamp_s


def _times(frame: FrameOfData, came: Came, conversation: Conversation) -> Times:
    """By three clocks. Before 3.0 there is only the frame's timestamp, and nothing tells when it was sent."""
    clock, hz, device_s = conversation.clock, conversation.clock_hz, _device_s(frame, conversation)
    if hz and frame.mid_exposure_ticks:
        return mapped(clock, device_s, frame.transmit_ticks / hz, came, frame.system_latency_s(hz))
    return mapped(clock, device_s, math.nan if hz else device_s, came)
