"""When the samples of one stream were taken, by this machine's clock."""

from __future__ import annotations

import math

from core.frames import Times
from devices.common.clock_sync import ClockSync
from devices.common.stamps import Came

LATEST_S = 10.0
"""Exposures longer before the arrival than this are not of now: a take is played back with those of its day [s]."""

SURE_S = 0.005
"""An arrival not known as well as this tells no time [s]."""


class Timing:
    """Gives the samples of one stream their times, in the order in which they are handed on."""

    def __init__(self) -> None:
        self._host_s = -math.inf  # of the last sample
        self._shift_s = 0.0  # added to the mapped clock

    def restarted(self, times: Times) -> None:
        """The source began anew, with a sample of these times. A loop may be stamped as its first pass was: then its
        stamps tell the steps only, and arrival tells when."""
        again = times.host_s < self._host_s
        self._shift_s = max(times.arrival_s - times.host_s, 0.0) if again else 0.0

    def in_order(self, times: Times) -> Times:
        """The times of the next sample. A better echo may move the mapped clock a little; it never runs backwards."""
        if not times.known:
            return times
        self._host_s = max(min(times.host_s + self._shift_s, times.arrival_s), self._host_s)
        return Times(times.device_s, self._host_s, times.arrival_s)


def mapped(clock: ClockSync, device_s: float, sent_s: float, came: Came, latency_s: float = 0.0) -> Times:
    """The times of one sample: by the device's clock, by ours (NaN where nothing tells), and the arrival.

    device_s: when it was taken, by the device's clock [s], NaN if it has none. sent_s: when it was sent, by that clock
    [s], NaN where it cannot be told; it may be device_s where that alone is known, and is then taken to be when the
    quickest sample came. latency_s: from the one to the other, as the device says, where its clock cannot be mapped.
    """
    arrival_s, sure = came.latest_s, came.slack_s <= SURE_S
    if not math.isfinite(sent_s):
        return Times(device_s, arrival_s if sure else math.nan, arrival_s)
    if sure:
        clock.packet(sent_s, arrival_s)
    if (sure or clock.known) and clock.explains(sent_s, arrival_s):
        host_s = clock.host_s(device_s, arrival_s)
        if arrival_s - came.slack_s - host_s <= LATEST_S:
            return Times(device_s, min(host_s, arrival_s), arrival_s)
    if not sure:
        return Times(device_s, math.nan, arrival_s)
    return Times(device_s, arrival_s - (latency_s if 0 <= latency_s < LATEST_S else 0.0), arrival_s)
