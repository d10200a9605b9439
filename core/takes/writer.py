"""Writing a take while it is recorded: every record goes to the operating system before the next one is taken."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any, NamedTuple, cast

from mcap.writer import IndexType, Writer

from core.cast import cast_of
from core.disk_error import why
from core.errors import PhalanxError, TakeError
from core.frames import InertialFrame, MarkerFrame, Times, TrackedFrame
from core.profile import Profile
from core.streams import ClockSample, Record, StreamInfo
from core.takes.codec import encode_clock, encode_inertial, encode_mark, encode_raw, encode_solved
from core.takes.container import (
    MARK,
    RAW,
    SOLVED,
    TOPICS,
    Clock,
    add_info,
    begin,
    clock_topic,
    frames_topic,
)
from core.takes.file_name import check_take_name
from core.takes.place import DisplacedError, Fate
from core.takes.reader import open_take
from core.takes.record_file import RecordFile
from core.takes.records import MAX_MESSAGE, MESSAGE_HEAD
from core.takes.safekeeping import Notice, Safekeeping
from core.takes.seal import seal_recorded
from core.takes.streams import Recorded, numbered, stamp_at
from core.takes.take import EXTENSION, MOST_PERFORMERS, Mark, TakeCounts, TakeInfo, library_versions

_REMEDY = "Choose a folder that exists, can be written to and has room."
_SEAL_TRIES = 3
"""How often a take is put in safety again that is taken away while it is sealed."""


_ENCODE: dict[type, Callable[[Any], bytes]] = {
    MarkerFrame: encode_raw,
    InertialFrame: encode_inertial,
    ClockSample: encode_clock,
}


class ReadableFrames(NamedTuple):
    """Of a stream. frames: that can be read. untimed: of these, those of which nothing tells when they were taken."""

    frames: int = 0
    untimed: int = 0


class Readable(NamedTuple):
    """What can be read of an open take. raw: frames of the stream that is solved; untimed: of these. first_s: when the
    first of them was taken, by the host's clock; None without one. beside: of each of the other streams, by its key."""

    raw: int = 0
    solved: int = 0
    first_s: float | None = None
    untimed: int = 0
    beside: Mapping[str, ReadableFrames] = MappingProxyType({})


class TakeWriter:
    """A take being recorded. Synchronous, for one thread; starts none.

    When `raw` or `solved` returns, the frame is acknowledged: it is with the operating system, and the end of this
    process by whatever means does not lose it. When one raises TakeError, that frame alone is not in the take; what
    was written stays readable, and the next frame may be tried.
    """

    def __init__(
        self,
        path: Path | str,
        info: TakeInfo,
        profiles: Profile | Sequence[Profile],
        streams: Sequence[StreamInfo] = (),
        solving: str = "",
        *,
        refuge: Path | None = None,
        notify: Callable[[Notice], None] = lambda notice: None,
    ) -> None:
        """Creates the file and its folder. Raises TakeError, and then leaves no file; never overwrites.

        profiles: of each performer. streams: all that will be in it; none: one of markers, which is solved and has no
        name (""), as from a file of another program. solving: key of the one that is solved, "" for none. refuge: where
        the take is put in safety if its own folder is gone. notify: called by `safety` and `seal` when the file was
        deleted, moved or replaced, and when it is safe again.
        """
        path = Path(path)
        self.info = info
        self._streams = numbered(streams, solving)
        self._topics = _topics(self._streams)
        self._counts: Counter[str] = Counter()
        self._clock = Clock(info.created_utc.timestamp())
        performers = cast_of(profiles)
        self._n_performers = len(performers)
        if len(performers) > MOST_PERFORMERS:
            raise TakeError(f"{len(performers)} performers in take {path}.", f"It holds {MOST_PERFORMERS} at most.")
        if path.suffix != EXTENSION:
            raise TakeError(f"A take cannot be named {path.name!r}.", f"Its file name must end in {EXTENSION}.")
        check_take_name(path)
        profiles_data = [profile.to_json().encode() for profile in performers]
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise TakeError(
                f"Take {path} cannot be created: its folder cannot be made ({why(path.parent, error)}).", _REMEDY
            ) from error
        try:
            self._file = RecordFile(path)
        except FileExistsError as error:
            raise TakeError(
                f"Take {path} exists already.", "Takes are never overwritten: choose another name."
            ) from error
        except OSError as error:
            raise TakeError(f"Take {path} cannot be created ({error.strerror or error}).", _REMEDY) from error
        # The index is made when the take is sealed; keeping one here would only cost memory.
        self._mcap = Writer(cast(IO[bytes], self._file), use_chunking=False, index_types=IndexType.NONE)
        try:
            begin(self._mcap, info, profiles_data, library_versions(), self._streams)
            self._mcap.flush()  # type: ignore[no-untyped-call]
            beginning = self._file.read(0, self._file.size)
            self.safety = Safekeeping(self._file, beginning, path.stem, refuge, notify)
            """What becomes of the file while it is recorded."""
        except OSError as error:  # its folder or its disk has gone since
            self._file.remove()
            raise TakeError(f"Take {path} cannot be created ({error.strerror or error}).", _REMEDY) from error
        except BaseException:
            self._file.remove()
            raise

    @property
    def path(self) -> Path:
        """The file; another than at the beginning if that was moved or had to be rescued."""
        return self._file.path

    @property
    def bytes_written(self) -> int:
        """Size of the file now."""
        return self._file.size

    @property
    def acknowledged(self) -> int:
        """Frames of the stream that is solved that the operating system holds."""
        return self._counts[RAW]

    @property
    def acknowledged_solved(self) -> int:
        """Solved frames that the operating system holds."""
        return self._counts[SOLVED]

    def raw(self, stream: str, record: Record) -> None:
        """Adds a frame, or a sample of its clock, as a stream's device sent it. Raises TakeError; also for what the
        take has no place for: another stream, or records of another kind than the stream said."""
        topic = self._topics.get((stream, type(record)))
        if topic is None:
            raise TakeError(
                f"Take {self.path} has no place for a {type(record).__name__} of stream {stream!r}.",
                "A take holds the streams that it began with: end it, and record another one.",
            )
        data = _ENCODE[type(record)](record)
        if isinstance(record, ClockSample):
            log_ns = publish_ns = self._clock.sample(record.host_s)
        else:
            log_ns, publish_ns = self._clock.stamp(record.times)
        if topic == RAW and not self._counts[RAW]:
            self._clock.count_marks_from(log_ns)
        self._add(topic, log_ns, publish_ns, data)

    def solved(self, frame: TrackedFrame) -> None:
        """Adds a frame as the engine solved it. Raises TakeError."""
        log_ns, publish_ns = self._clock.stamp(frame.times)
        self._add(SOLVED, log_ns, publish_ns, encode_solved(frame))

    def mark(self, mark: Mark) -> None:
        """Adds a mark. Raises TakeError."""
        log_ns = self._clock.mark(mark.time_s)
        self._add(MARK, log_ns, log_ns, encode_mark(mark))

    def set_info(self, info: TakeInfo) -> None:
        """Says something else of the take, such as its notes. Raises TakeError; sealing says it all the same."""
        self.info = info
        add_info(self._mcap, info, self._n_performers, self._streams)

    def seal(self, counts: TakeCounts, progress: Callable[[float], None] | None = None) -> None:
        """Ends the recording: replaces the file by its indexed, compressed copy once that is known to hold every
        record. May be repeated after a TakeError; until it succeeds the file as recorded stays and can be read.

        A file that was deleted or replaced, also while this runs, is rescued first; another one that has its name is
        left alone. One that another program cut is sealed if `counts` say what is `readable` of it."""
        for _ in range(_SEAL_TRIES):
            self.safety.secure()
            try:
                seal_recorded(self._file, counts, progress, self.info)
                return
            except PhalanxError:
                if self._file.closed or self._file.place.fate is Fate.HERE:
                    raise
        raise DisplacedError(self.path)

    def readable(self) -> Readable:
        """What whoever opens the take finds in it now; nothing where its name leads elsewhere."""
        if self._file.closed or self._file.place.fate not in (Fate.HERE, Fate.CUT):
            return Readable()
        try:
            with open_take(self.path) as take:
                if not self._file.is_open_as(take.fileno()):
                    return Readable()
                times = _times(take.raw)
                first_s = next((one.begins_s for one in times if math.isfinite(one.begins_s)), None)
                beside = {
                    key: ReadableFrames(len(stream.frames), _untimed(_times(stream.frames)))
                    for key, stream in take.streams.items()
                    if not stream.solved
                }
                return Readable(len(times), len(take.solved), first_s, _untimed(times), beside)
        except PhalanxError:
            return Readable()

    def close(self) -> None:
        """Ends the recording without sealing; the take can be read, and sealed later with seal_take. Raises TakeError
        if the system says only now that there was no room for all of it."""
        if self._file.closed:
            return
        try:
            self._file.sync()
            self._file.close()
        except OSError as error:
            raise TakeError(
                f"The end of take {self.path} may not be on its disk ({error.strerror or error}).", "Check the disk."
            ) from error

    def discard(self) -> None:
        """Ends the recording and leaves no file."""
        self.safety.give_up()
        self._file.remove()

    def _add(self, topic: str, log_ns: int, publish_ns: int, data: bytes) -> None:
        if len(data) > MAX_MESSAGE - MESSAGE_HEAD.size:
            raise TakeError(
                f"A frame of {len(data)} bytes is too large for take {self.path}, which takes {MAX_MESSAGE} at most.",
                "Check what the device sends.",
            )
        sequence = self._counts[topic]
        self._mcap.add_message(TOPICS[topic], log_ns, data, publish_ns, sequence)
        self._counts[topic] = sequence + 1


def _times(frames: Recorded) -> list[Times]:
    return [stamp_at(frames, i)[1] for i in range(len(frames))]


def _untimed(times: Sequence[Times]) -> int:
    return sum(not one.known for one in times)


def _topics(streams: Mapping[int, StreamInfo]) -> dict[tuple[str, type], str]:
    """Where records go, by the key of their stream and what they are."""
    if not streams:
        return {("", MarkerFrame): RAW}
    frames = {"markers": MarkerFrame, "inertial": InertialFrame}
    return {
        place: topic
        for number, info in streams.items()
        for place, topic in (
            ((info.key, frames[info.what]), frames_topic(number, info.what)),
            ((info.key, ClockSample), clock_topic(number)),
        )
    }
