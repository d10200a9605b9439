"""What stands where in the MCAP file of a take: names, the records before the first frame, message times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from core.frames import Times
from core.takes.schemas import PACKAGE, descriptor_set
from core.takes.take import TakeCounts, TakeInfo, counts_to_text, info_to_text, program_version, utf8

PROFILE = "phalanx"
"""The MCAP header's profile; another one is not a take."""

MAGIC = b"\x89MCAP0\r\n"
INFO, DEVICE, LIBRARIES, COUNTS = "phalanx.take", "phalanx.device", "phalanx.libraries", "phalanx.counts"


def profile_name(performer: int) -> str:
    """The attachment that holds the profile of a performer: `profile.json`, `profile_2.json`, ..."""
    return "profile.json" if performer == 0 else f"profile_{performer + 1}.json"


RAW, SOLVED, MARK = "/raw", "/solved", "/mark"
TOPICS = {RAW: 1, SOLVED: 2, MARK: 3}
"""Topics with their channel ids: fixed, so that frames are found even where the channel records are damaged."""

_SCHEMAS = {RAW: "RawFrame", SOLVED: "SolvedFrame", MARK: "Mark"}
_LAST_S = 4e9  # the year 2096; twice as much still fits 63 bits of nanoseconds


def begin(
    writer: Any,
    info: TakeInfo,
    hand_profiles: Sequence[bytes | None],
    libraries: Mapping[str, str],
    counts: TakeCounts | None = None,
) -> None:
    """Writes everything that comes before the first message to an `mcap.writer.Writer`.

    hand_profiles: of each performer, None where it is damaged in the take that is copied.
    """
    writer.start(PROFILE, f"phalanx {program_version()}")
    add_info(writer, info, len(hand_profiles))
    writer.add_metadata(DEVICE, _texts(info.device))
    writer.add_metadata(LIBRARIES, _texts(libraries))
    if counts is not None:
        writer.add_metadata(COUNTS, _texts(counts_to_text(counts)))
    created_ns = nanoseconds(info.created_utc.timestamp())
    for performer, profile in enumerate(hand_profiles):
        if profile is not None:
            writer.add_attachment(created_ns, created_ns, profile_name(performer), "application/json", profile)
    schema = descriptor_set()
    for topic, channel_id in TOPICS.items():
        schema_id = writer.register_schema(f"{PACKAGE}.{_SCHEMAS[topic]}", "protobuf", schema)
        registered = writer.register_channel(topic, "protobuf", schema_id)
        assert registered == channel_id, "channels are registered in the order of their ids"


def add_info(writer: Any, info: TakeInfo, n_performers: int) -> None:
    """Writes what is known of the take. While it is recorded it may be written again: the last one counts."""
    writer.add_metadata(INFO, _texts(info_to_text(info, n_performers)))


def nanoseconds(seconds: float) -> int:
    """MCAP's unsigned nanoseconds; what they cannot hold becomes the nearest they can."""
    return round(min(max(seconds, 0.0), _LAST_S) * 1e9)


class Clock:
    """Host clock times to MCAP times: the first frame of a take is at its `created_utc`."""

    def __init__(self, created_s: float) -> None:
        self._created_ns = nanoseconds(created_s)
        self._start_s: float | None = None
        self._last = (self._created_ns, self._created_ns)

    def stamp(self, times: Times) -> tuple[int, int]:
        """(log time, publish time) [ns]: exposure and arrival. A time that is not finite is taken from the
        other clock, or else from the frame before: a bad time never ends a recording."""
        exposed = times.begins_s
        arrived = times.arrival_s if isfinite(times.arrival_s) else exposed
        if not isfinite(exposed):
            return self._last
        if self._start_s is None:
            self._start_s = exposed
        self._last = (self.at(exposed - self._start_s), self.at(arrived - self._start_s))
        return self._last

    def at(self, time_s: float) -> int:
        """MCAP time of a moment of the take, as marks count it [s] -> [ns]."""
        if not isfinite(time_s):
            return self._last[0]
        return max(self._created_ns + round(min(max(time_s, -_LAST_S), _LAST_S) * 1e9), 0)


def _texts(texts: Mapping[str, str]) -> dict[str, str]:
    return {utf8(key): utf8(value) for key, value in texts.items()}
