"""What a device sends: streams, each said once when the device is open, and samples of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

from core.frames import InertialFrame, MarkerFrame, Side
from core.printable import MOST_OF_TEXT, printable

What = Literal["markers", "inertial"]
Ids = Literal["sight", "marker", "none"]
Quality = Literal["residual", "condition", "none"]
Rotations = Literal["parent", "world", "sensor", "none"]


@dataclass(frozen=True)
class StreamInfo:
    """What is true of all samples of a stream.

    key: its name among all streams. A device says its own ("markers"); the session puts the device before it
        ("natnet-1/markers").
    kind, title: of the device, as code and as people name it.
    what: its frames are MarkerFrame, or InertialFrame.
    rate_hz: nominal frames per second, NaN if unknown.
    ids: what an id of a point is good for. "sight": the same point for as long as it is seen without a break.
        "marker": a marker's own, for ever, as of an LED. "none": there are none.
    quality: what residuals_m is. "residual": of triangulation [m]. "condition": a number of the system's own, the
        less the better. "none": nothing.
    rotations: the frame in which the rotations of bones are given. "parent": of the bone that they hang from.
        "world". "sensor": of each sensor's own. "none": there are none.
    bone_names: in the order of the frames, () of an optical stream.
    sides: hands that it is worn on, () where it says nothing of hands.
    clock_hz: ticks per second of the clock of device_s, NaN if unknown or if there is none.
    axes: as they came, before the device turned them to ours, for people ("right-handed, Z up").
    """

    key: str
    kind: str
    title: str
    what: What
    rate_hz: float = float("nan")
    ids: Ids = "none"
    quality: Quality = "none"
    rotations: Rotations = "none"
    bone_names: tuple[str, ...] = ()
    sides: tuple[Side, ...] = ()
    clock_hz: float = float("nan")
    axes: str = ""

    def __post_init__(self) -> None:
        for text in ("key", "kind", "title"):
            object.__setattr__(self, text, printable(getattr(self, text)))
        object.__setattr__(self, "axes", printable(self.axes, MOST_OF_TEXT))
        object.__setattr__(self, "bone_names", tuple(map(printable, self.bone_names)))


@dataclass(frozen=True, slots=True)
class ClockSample:
    """One comparison of a device's clock with this machine's, kept so that the mapping can be made again.

    device_s: the device's clock [s]. host_s: this machine's monotonic clock at the middle of the exchange [s].
    round_trip_s: how long the exchange took; half of it bounds the error [s]. NaN where it was one way only.
    """

    device_s: float
    host_s: float
    round_trip_s: float


Record = MarkerFrame | InertialFrame | ClockSample
"""Whatever a stream may carry. A clock sample belongs to the stream whose clock it is of."""


class Sample(NamedTuple):
    """What `Device.read` returns. stream: key of a StreamInfo."""

    stream: str
    frame: Record
