"""The streams of a session that are armed: connected, to be recorded, and one of them to be solved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.receiver import Receiver
from core.streams import StreamInfo
from devices.device import Health


@dataclass(frozen=True)
class ArmedStream:
    """One stream of a device that is connected. info: as the device said it, with its key among those of the
    session."""

    info: StreamInfo
    receiver: Receiver

    @property
    def key(self) -> str:
        """Its name among the streams of the session, and in takes."""
        return self.info.key

    @property
    def optical(self) -> bool:
        """Whether it can be solved."""
        return self.info.what == "markers"

    def health(self) -> Health:
        """The light of this stream alone, and what was lost of it since its device was connected."""
        return self.receiver.stream_health(self.key)

    @property
    def received(self) -> int:
        """Frames handed on since its device was connected."""
        return self.receiver.received(self.key)

    @property
    def rate_hz(self) -> float:
        """Frames per second over the last second."""
        return self.health().rate_hz


def armed_streams(receivers: Sequence[Receiver]) -> tuple[ArmedStream, ...]:
    """Those of all devices that stream, in the order in which these were connected."""
    streaming = sorted((one for one in receivers if one.streaming), key=lambda one: one.connected_s)
    return tuple(ArmedStream(info, one) for one in streaming for info in one.streams)


def healths(armed: Sequence[ArmedStream]) -> dict[tuple[str, float], Health]:
    """Of each stream, by its key and when it was connected, which is since when it counts [s]."""
    return {(one.key, one.receiver.connected_s): one.health() for one in armed}


def stream_to_solve(armed: Sequence[ArmedStream], solved: str, chosen: str) -> str:
    """Key of the stream to be solved, "" where none can be: the one that the operator chose, or that is solved already,
    or else the optical one that was connected first. solved, chosen: keys, "" for none."""
    optical = [stream.key for stream in armed if stream.optical]
    return next((key for key in (chosen, solved) if key in optical), optical[0] if optical else "")
