"""When each record of a recording is due: every stream at its own times, all by one clock."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import NamedTuple

from core.frames import InertialFrame, MarkerFrame
from core.streams import ClockSample, Record, StreamInfo

LONGEST_PAUSE_S = 600.0
"""A longer time in which nothing of any stream comes is a clock that jumped, and nobody waits for it [s]."""


@dataclass(frozen=True)
class Track:
    """One stream of a recording.

    info: what is true of all its frames. Its rate says how long a step is where their times do not.
    records: frames and clock samples as they came: a sequence, or a function that gives them from the start each time
        it is called.
    """

    info: StreamInfo
    records: Iterable[Record] | Callable[[], Iterable[Record]]

    @property
    def period_s(self) -> float:
        """From frame to frame [s]."""
        return 1.0 / self.info.rate_hz


class Due(NamedTuple):
    """A record, and when it is due: seconds from the start of the recording, by its own pace."""

    at_s: float
    track: Track
    record: Record


def timeline(tracks: Sequence[Track], loop: bool) -> Iterator[Due]:
    """All records in the order in which they are due, the first at 0; in a loop again and again.

    Streams begin as far from each other as their host clock says. Where a frame's time says nothing, or a step back,
    the rate does. Numbers and device times go on increasing where the recording begins anew.
    """
    before_s, skipped_s = 0.0, 0.0
    for due in _stretched(tracks, loop):
        at_s = due.at_s - skipped_s
        if at_s - before_s > LONGEST_PAUSE_S:
            skipped_s += at_s - before_s - due.track.period_s
            at_s = before_s + due.track.period_s
        before_s = max(at_s, before_s)
        yield due._replace(at_s=at_s)


def _stretched(tracks: Sequence[Track], loop: bool) -> Iterator[Due]:
    """The same with every pause as long as it is said to be."""
    parts = [_Part(track) for track in tracks]
    begin_s = 0.0
    while True:
        firsts_s = [part.rewind() for part in parts]
        earliest_s = min(filter(math.isfinite, firsts_s), default=0.0)
        from_s = [begin_s + (first_s - earliest_s if math.isfinite(first_s) else 0.0) for first_s in firsts_s]
        yield from heapq.merge(*(part.play(at_s) for part, at_s in zip(parts, from_s, strict=True)), key=_at_s)
        end_s = max((part.end_s for part in parts), default=begin_s)
        if not loop or not end_s > begin_s:
            return
        begin_s = end_s


class _Part:
    """One track as it is played, round for round. end_s: when its next frame would be due."""

    def __init__(self, track: Track) -> None:
        self._track = track
        self._records: Iterator[Record] = iter(())
        self._first_s = math.nan
        self._number, self._seconds = 0, 0.0  # added to those of the recording
        self._last: MarkerFrame | InertialFrame | None = None
        self.end_s = -math.inf

    def rewind(self) -> float:
        """To the beginning. The first record's time by the host's clock [s], NaN where nothing tells it."""
        records = self._track.records
        self._records = iter(records() if callable(records) else records)
        first = next(self._records, None)
        self._first_s = math.nan
        if first is not None:
            self._records = chain([first], self._records)
            self._first_s = _host_s(first)
        return self._first_s

    def play(self, at_s: float) -> Iterator[Due]:
        """Once to the end. at_s: when the first record is due."""
        track, before_s, begun = self._track, self._first_s, False
        for i, record in enumerate(self._records):
            if i == 0 and self._last is not None:
                since_s = at_s - self.end_s + track.period_s
                seconds = self._last.times.device_s + since_s - _device_s(record)
                self._seconds = seconds if math.isfinite(seconds) else self._seconds
            step_s = _host_s(record) - before_s
            if isinstance(record, ClockSample):  # it may have been made before the frame that came before it
                beside_s = step_s if abs(step_s) <= LONGEST_PAUSE_S else 0.0
                yield Due(at_s + beside_s, track, replace(record, device_s=record.device_s + self._seconds))
                continue
            if begun:
                at_s += step_s if 0.0 < step_s < math.inf else track.period_s
            else:
                at_s += step_s if 0.0 < step_s < math.inf else 0.0
                self._number = self._last.sequence + 1 - record.sequence if self._last is not None else 0
            begun, before_s = True, _host_s(record)
            times = replace(record.times, device_s=record.times.device_s + self._seconds)
            self._last = replace(record, sequence=record.sequence + self._number, times=times)
            self.end_s = at_s + track.period_s
            yield Due(at_s, track, self._last)


def _at_s(due: Due) -> float:
    return due.at_s


def _host_s(record: Record) -> float:
    return record.host_s if isinstance(record, ClockSample) else record.times.host_s


def _device_s(record: Record) -> float:
    return record.device_s if isinstance(record, ClockSample) else record.times.device_s
