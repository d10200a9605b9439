"""What stands where in the MCAP file of a take: names, channels, the records before the first frame, message times."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from math import isfinite
from typing import Any, get_args

from core.frames import Times
from core.streams import StreamInfo, What
from core.takes.schemas import PACKAGE, descriptor_set
from core.takes.stream_text import stream_to_text
from core.takes.take import (
    MOST_STREAMS,
    SOLVED_STREAM,
    TakeCounts,
    TakeInfo,
    counts_to_text,
    info_to_text,
    program_version,
    stream_counts_to_text,
    utf8,
)

PROFILE = "phalanx"
"""The MCAP header's profile; another one is not a take."""

MAGIC = b"\x89MCAP0\r\n"
INFO, DEVICE, LIBRARIES, COUNTS = "phalanx.take", "phalanx.device", "phalanx.libraries", "phalanx.counts"


def stream_name(number: int) -> str:
    """The metadata that say what a stream is."""
    return f"phalanx.stream.{number}"


def stream_counts_name(number: int) -> str:
    """The metadata that say where its frames went, of every stream but the one that was solved."""
    return f"{COUNTS}.{number}"


_NUMBERS = range(1, MOST_STREAMS + 1)
METADATA = frozenset(
    {INFO, DEVICE, LIBRARIES, COUNTS}
    | {stream_name(number) for number in _NUMBERS}
    | {stream_counts_name(number) for number in _NUMBERS if number != SOLVED_STREAM}
)
"""Names of all that a take may hold."""


def profile_name(performer: int) -> str:
    """The attachment that holds the profile of a performer: `profile.json`, `profile_2.json`, ..."""
    return "profile.json" if performer == 0 else f"profile_{performer + 1}.json"


RAW, SOLVED, MARK = "/raw", "/solved", "/mark"


def frames_topic(number: int, what: What) -> str:
    """Where the frames of a stream are."""
    return RAW if number == SOLVED_STREAM else f"/streams/{number}/{what}"


FRAMES = frozenset(frames_topic(number, what) for number in _NUMBERS for what in get_args(What))
"""All topics with frames of streams."""


def clock_topic(number: int) -> str:
    """Where the samples of its clock are."""
    return f"/streams/{number}/clock"


def _messages(n_streams: int) -> dict[str, str]:
    """The messages of every topic of a take of so many streams, in the order of channel ids."""
    messages = {RAW: "RawFrame", SOLVED: "SolvedFrame", MARK: "Mark"}
    for number in range(1, n_streams + 1):
        if number != SOLVED_STREAM:
            messages |= {frames_topic(number, "markers"): "RawFrame", frames_topic(number, "inertial"): "InertialFrame"}
        messages[clock_topic(number)] = "ClockSample"
    return messages


TOPICS = {topic: channel_id for channel_id, topic in enumerate(_messages(MOST_STREAMS), 1)}
"""Topics with their channel ids: fixed, so that frames are found even where the channel records are damaged."""

_LAST_S = 4e9  # the year 2096; twice as much still fits 63 bits of nanoseconds


def begin(
    writer: Any,
    info: TakeInfo,
    hand_profiles: Sequence[bytes | None],
    libraries: Mapping[str, str],
    streams: Mapping[int, StreamInfo],
    counts: TakeCounts | None = None,
) -> None:
    """Writes everything that comes before the first message to an `mcap.writer.Writer`.

    hand_profiles: of each performer, None where it is damaged in the take that is copied. streams: by their numbers.
    """
    writer.start(PROFILE, f"phalanx {program_version()}")
    add_info(writer, info, len(hand_profiles), streams)
    writer.add_metadata(DEVICE, _texts(info.device))
    for number, stream in streams.items():
        writer.add_metadata(stream_name(number), _texts(stream_to_text(stream)))
    writer.add_metadata(LIBRARIES, _texts(libraries))
    if counts is not None:
        writer.add_metadata(COUNTS, _texts(counts_to_text(counts)))
        for number, stream in streams.items():
            if number != SOLVED_STREAM and (of_stream := counts.others.get(stream.key)) is not None:
                writer.add_metadata(stream_counts_name(number), _texts(stream_counts_to_text(of_stream)))
    created_ns = nanoseconds(info.created_utc.timestamp())
    for performer, profile in enumerate(hand_profiles):
        if profile is not None:
            writer.add_attachment(created_ns, created_ns, profile_name(performer), "application/json", profile)
    schema, schema_ids = descriptor_set(), {}
    for topic, message in _messages(max(streams, default=0)).items():
        if message not in schema_ids:
            schema_ids[message] = writer.register_schema(f"{PACKAGE}.{message}", "protobuf", schema)
        registered = writer.register_channel(topic, "protobuf", schema_ids[message])
        assert registered == TOPICS[topic], "channels are registered in the order of their ids"


def add_info(writer: Any, info: TakeInfo, n_performers: int, streams: Collection[int]) -> None:
    """Writes what is known of the take. While it is recorded it may be written again: the last one counts."""
    writer.add_metadata(INFO, _texts(info_to_text(info, n_performers, streams)))


def nanoseconds(seconds: float) -> int:
    """MCAP's unsigned nanoseconds; what they cannot hold becomes the nearest they can."""
    return round(min(max(seconds, 0.0), _LAST_S) * 1e9)


def later(begin_ns: int, by_s: float) -> int:
    """MCAP time of so many seconds after another."""
    return max(begin_ns + round(min(max(by_s, -_LAST_S), _LAST_S) * 1e9), 0)


class Clock:
    """Host clock times to MCAP times: the first frame of a take is at its `created_utc`."""

    def __init__(self, created_s: float) -> None:
        self._created_ns = nanoseconds(created_s)
        self._marks_ns = self._created_ns
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
        begin_ns, begin_s = self._created_ns, self._start_s
        self._last = later(begin_ns, exposed - begin_s), later(begin_ns, arrived - begin_s)
        return self._last

    def sample(self, host_s: float) -> int:
        """MCAP time of a clock sample [ns]; before the first frame, that of the take."""
        if self._start_s is None or not isfinite(host_s):
            return self._last[0]
        return later(self._created_ns, host_s - self._start_s)

    def count_marks_from(self, log_ns: int) -> None:
        """Where the first frame of the stream that is solved is: later than created_utc if another came first."""
        self._marks_ns = log_ns

    def mark(self, time_s: float) -> int:
        """MCAP time of a moment of the take, as marks count it [s] -> [ns]."""
        return later(self._marks_ns, time_s) if isfinite(time_s) else self._last[0]


def _texts(texts: Mapping[str, str]) -> dict[str, str]:
    return {utf8(key): utf8(value) for key, value in texts.items()}
