"""Frames of a NatNet stream: decoded, timed, counted, converted."""

from __future__ import annotations

import math
from dataclasses import replace

from core.errors import FormatError
from core.frames import MarkerFrame, Standstill, Times
from devices.natnet.conversation import Conversation
from devices.natnet.convert import Conversion
from devices.natnet.frames import decode_frame, detect_version
from devices.natnet.records import FrameFlag, FrameOfData
from devices.natnet.stamps import Arrival as Came
from devices.natnet.transport import Datagram
from devices.stream import Arrival, RateMeter, SequenceCounter

RECENT_S = 5.0
"""For how long a loss or a bad packet shows in the light [s]."""

LIKELY_RATE_HZ = 120.0
"""Assumed until the server tells, or a second of frames does [Hz]."""

LATEST_S = 10.0
"""Exposures longer before the arrival than this are not of now: a take is played back with those of its day [s]."""

SURE_S = 0.005
"""An arrival not known as well as this tells no time [s]."""

TOGETHER_S = 0.001
"""Frames are read in the order of their arrival; two clocks of the kernel may differ by less than this [s]."""


class Intake:
    """What has become of the frames. Fed by the receiving thread, read by any."""

    def __init__(self, points: str) -> None:
        self.sequence: SequenceCounter[tuple[FrameOfData, Came]] = SequenceCounter()
        self.rate = RateMeter()
        self.received = 0
        self.untimed = 0
        self.rate_hz = 0.0
        self.latency_s = math.nan
        self.latest: FrameOfData | None = None
        self.latest_s = -math.inf  # when it arrived
        self.without_ids = False
        self.lost_recently = 0
        self.lost_s = -math.inf  # when the last loss was noticed
        self.standstills: list[Standstill] = []
        self.unread_s = -math.inf  # when the last loss of a standstill was noticed
        self.untimed_s = -math.inf  # when the last frame of unknown time came
        self._points = points
        self._surely_s = -math.inf  # when the last frame came, at the earliest
        self._host_s = -math.inf  # of the last frame
        self._shift_s = 0.0  # added to the mapped clock

    def take(self, payload: bytes, datagram: Datagram, conversation: Conversation) -> list[MarkerFrame]:
        """A FRAMEOFDATA payload: what is to be handed on now, mostly one frame. Raises FormatError."""
        frame = _decode(payload, conversation)
        arrival, last_s = datagram.arrival_s, self._surely_s
        if 0 < self.latest_s - arrival < TOGETHER_S:
            arrival = self.latest_s
        self.latest, self.latest_s = frame, max(arrival, self.latest_s)
        self._surely_s = self.latest_s - datagram.slack_s
        if frame.params & FrameFlag.MODELS_CHANGED:
            conversation.want_models()
        live = not frame.params & FrameFlag.EDIT_MODE
        before = self.sequence.lost
        rate = conversation.frame_rate_hz or self.rate_hz or LIKELY_RATE_HZ
        device_s = _device_s(frame, conversation)
        came = Came(arrival, datagram.slack_s)
        ready = self.sequence.arrived(
            (frame, came), frame.number, device_s, arrival, rate, live=live, slack_s=came.slack_s
        )
        if (lost := self.sequence.lost - before) > 0:
            self._count_lost(lost, last_s, arrival)
        return [self._hand_on(*one, said, conversation) for one, said in ready]

    def _count_lost(self, lost: int, last_s: float, arrival_s: float) -> None:
        """Frames that should have come since `last_s`: because this program stood still, if it did for most of that
        time, else on the way."""
        missing_s, stood_s, latest = arrival_s - last_s, 0.0, -1
        for i, one in enumerate(self.standstills):
            begin_s, end_s = one.reach_s
            if end_s > last_s:
                asleep_s = one.seconds - (one.to_s - one.from_s)  # no clock of ours tells it
                within_s = min(end_s, arrival_s) - max(begin_s, last_s)
                missing_s, stood_s, latest = missing_s + asleep_s, stood_s + asleep_s + max(within_s, 0.0), i
        if latest >= 0 and stood_s > missing_s / 2:
            one = self.standstills[latest]
            self.standstills[latest] = replace(one, lost=one.lost + lost)
            self.unread_s = arrival_s
            return
        recent = self.lost_recently if arrival_s - self.lost_s < RECENT_S else 0
        self.lost_recently, self.lost_s = recent + lost, arrival_s

    def _hand_on(self, frame: FrameOfData, came: Came, said: Arrival, conversation: Conversation) -> MarkerFrame:
        arrival_s = came.latest_s
        if said is Arrival.RESTART:
            conversation.clock.begin_anew()
        times = _times(frame, came, conversation)
        if said is Arrival.RESTART:
            # A loop may be stamped as its first pass was: then its stamps tell the steps only, and arrival tells when.
            again = times.host_s < self._host_s
            self._shift_s = max(arrival_s - times.host_s, 0.0) if again else 0.0
        times = self._in_order(replace(times, host_s=min(times.host_s + self._shift_s, arrival_s)))
        self.without_ids = bool(len(frame.unlabelled)) and not len(frame.labelled)
        self.received += 1
        if not math.isfinite(times.host_s):
            self.untimed += 1
            self.untimed_s = self.latest_s
        self.rate.add(arrival_s)
        self.rate_hz = self.rate.rate_hz(arrival_s)
        if math.isfinite(times.host_s):
            self.latency_s = times.latency_s
        conversion = Conversion(conversation.up_axis, conversation.scale_m, self._points)
        return conversion.frame(frame, times, conversation.names)

    def _in_order(self, times: Times) -> Times:
        """A better echo may move the mapped clock a little; it never runs backwards."""
        if not math.isfinite(times.host_s):
            return times
        self._host_s = max(times.host_s, self._host_s)
        return Times(times.device_s, self._host_s, times.arrival_s)


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
    """By the device's clock, by ours (NaN where nothing tells), and the arrival.

    Before 3.0 there is only the frame's timestamp: its exposure is taken to be when the quickest frame came.
    """
    clock, hz, arrival_s = conversation.clock, conversation.clock_hz, came.latest_s
    sure = came.slack_s <= SURE_S
    device_s, latency_s = _device_s(frame, conversation), 0.0
    if hz and frame.mid_exposure_ticks:
        sent_s, latency_s = frame.transmit_ticks / hz, frame.system_latency_s(hz)
    elif hz or not math.isfinite(device_s):
        return Times(device_s, arrival_s if sure else math.nan, arrival_s)
    else:
        sent_s = device_s
    if sure:
        clock.packet(sent_s, arrival_s)
    if (sure or clock.known) and clock.explains(sent_s, arrival_s):
        host_s = clock.host_s(device_s, arrival_s)
        if arrival_s - came.slack_s - host_s <= LATEST_S:
            return Times(device_s, min(host_s, arrival_s), arrival_s)
    if not sure:
        return Times(device_s, math.nan, arrival_s)
    return Times(device_s, arrival_s - (latency_s if 0 <= latency_s < LATEST_S else 0.0), arrival_s)
