"""What a file holds that can be played: its streams, whatever they are of."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from core.streams import Record, StreamInfo
from core.takes.formats import read_recording
from core.takes.formats.bvh import is_bvh, read_bvh
from core.takes.formats.bvh_frames import frames_of, stream_of
from core.takes.formats.clock import rate_of
from core.takes.formats.take import is_take
from core.takes.reader import Take, open_take
from core.takes.store import in_file_order
from core.takes.streams import TakeStream
from devices.playback.timeline import Track


@dataclass(frozen=True)
class PlayedFile:
    """Of an open file. warnings: of its reader, in sentences. close: it is read no more."""

    tracks: tuple[Track, ...]
    warnings: tuple[str, ...] = ()
    close: Callable[[], None] = lambda: None


def open_played(path: Path) -> PlayedFile:
    """Any recording of markers or of bones, or a take with all of its streams. Raises FormatError and TakeError."""
    if is_take(path):
        return _take(path)
    if is_bvh(path):
        motion = read_bvh(path)
        return PlayedFile((Track(stream_of(motion), partial(frames_of, motion)),), motion.warnings)
    recording = read_recording(path)
    info = StreamInfo("markers", "", recording.format, "markers", recording.rate_hz, ids="sight")
    return PlayedFile((Track(info, recording.frames),), recording.warnings)


def _take(path: Path) -> PlayedFile:
    """All that its devices sent: residuals, rigid bodies, times by both clocks, and the comparisons of those.

    Streams keep their keys where there are several; one alone is called by what it is.
    """
    take = open_take(path)
    try:
        held = {key: stream for key, stream in take.streams.items() if len(stream.frames)}
        rate_hz, warnings = math.nan, ()
        if take.raw or not held:
            recording = read_recording(path)  # says what is amiss, or that there is nothing
            rate_hz, warnings = recording.rate_hz, recording.warnings
        tracks = []
        for key, stream in held.items():
            own = key if len(held) > 1 else stream.info.what
            info = replace(stream.info, key=own, rate_hz=_rate_hz(take, stream, rate_hz))
            tracks.append(Track(info, partial(_records, stream)))
    except BaseException:
        take.close()
        raise
    return PlayedFile(tuple(tracks), warnings, take.close)


def _rate_hz(take: Take, stream: TakeStream, solved_hz: float) -> float:
    """What a stream says, or its times, or else that of the stream that was solved."""
    if stream.solved:
        return solved_hz
    said = (stream.info.rate_hz, rate_of(stream.frames.times_s), solved_hz, take.info.rate_hz)
    return next((rate_hz for rate_hz in said if 0 < rate_hz < math.inf), math.nan)


def _records(stream: TakeStream) -> Iterator[Record]:
    """Frames and clock samples as they came."""
    topics = stream.frames, stream.clock
    for which, number in in_file_order(topics):
        yield topics[which][number]
