"""Sealing: the recorded file is replaced by its indexed, compressed copy, once that is known to hold every record."""

from __future__ import annotations

import contextlib
import os
import zlib
from collections.abc import Callable, Iterator, Sequence
from math import isfinite
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

from core.disk_error import remedy
from core.errors import TakeError
from core.frames import IntArray
from core.takes.codec import encode_mark
from core.takes.container import MARK, TOPICS, begin, later, nanoseconds
from core.takes.index import Progress, WrongIndexError, sealed_index, sound_ending
from core.takes.lock import lock
from core.takes.place import DisplacedError, is_at
from core.takes.reader import Take, open_take
from core.takes.record_file import RecordFile
from core.takes.records import MESSAGE_HEAD, TakeFile
from core.takes.store import Frames, in_file_order
from core.takes.streams import Recorded, TakeStream, stamp_at
from core.takes.take import DAMAGED, Mark, StreamCounts, TakeCounts, TakeInfo

CHUNK_SIZE = 1 << 17
"""Small enough that any frame is unpacked in well under a millisecond."""

COPY_SUFFIX = ".sealing"
"""Behind the name of a take: its sealed copy while that is written."""
_TELL_EVERY = 256
_COPY_SHARE = (0.3, 0.7)  # of the progress, between reading the recorded file and checking the copy

Record = tuple[int, int, int, int, bytes]
"""channel id, sequence, log time [ns], publish time [ns], data"""


def seal_take(
    path: Path | str,
    counts: TakeCounts | None = None,
    progress: Progress | None = None,
    info: TakeInfo | None = None,
) -> None:
    """Seals a take in place. counts: None keeps those in the file, or if it has none states what is in it.
    info: None keeps that in the file.

    Raises TakeError and leaves the file as it was if it is being recorded, is damaged (recover it), or there is no
    room for the copy. May be repeated. An exception out of `progress` cancels."""
    with _sole(Path(path), progress) as take:
        replace_sealed(take, info or take.info, counts or take.counts or counts_found(take), None, progress)


def seal_recorded(
    file: RecordFile, counts: TakeCounts, progress: Progress | None = None, info: TakeInfo | None = None
) -> None:
    """Seals the take that was recorded into this file, and closes it. What another program cut off that file is given
    up if the counts say so. Raises TakeError as seal_take does, and DisplacedError if its name leads to another file by
    now; the file is as it was then, and open."""
    with _sole(file.path, progress, file, counts) as take:
        replace_sealed(take, info or take.info, counts, None, progress, file.close)
    with contextlib.suppress(OSError):  # what it held is in its sealed copy, read back from the disk
        file.close()


def update_info(
    path: Path | str, info: TakeInfo, marks: Sequence[Mark] | None = None, progress: Progress | None = None
) -> None:
    """Changes notes, rating or anything else of a take's TakeInfo, and its marks if given; the frames stay bit for
    bit. The take is sealed by it. Raises TakeError as seal_take does, and leaves the file as it was."""
    with _sole(Path(path), progress) as take:
        replace_sealed(take, info, take.counts or counts_found(take), marks, progress)


def counts_found(take: Take) -> TakeCounts:
    """What can be said of a take whose recorder never said it: every frame found was received, every one lost to
    damage was dropped; gaps in the device's own numbers are losses before this machine."""
    others = {key: stream_counts_found(one) for key, one in take.streams.items() if not one.solved}
    found = _found(take.raw, take.lost_raw)
    return TakeCounts(
        found.received, found.written, found.dropped, found.lost, 0, len(take.solved),
        untimed=found.untimed, others=others,
    )  # fmt: skip


def stream_counts_found(stream: TakeStream) -> StreamCounts:
    """The same of one of its streams."""
    return _found(stream.frames, stream.lost)


def _found(frames: Recorded, lost: int) -> StreamCounts:
    stamps = [stamp_at(frames, i) for i in range(len(frames))]
    gaps, untimed = device_gaps([sequence for sequence, _ in stamps]), sum(not times.known for _, times in stamps)
    dropped = {DAMAGED: lost} if lost else {}
    return StreamCounts(len(frames) + lost, len(frames), dropped, max(gaps - lost, 0), untimed=untimed)


def device_gaps(sequences: Sequence[int] | IntArray) -> int:
    """Frames that a device's own numbers skip. A device that starts to count anew skips none."""
    steps = np.diff(np.array(sequences, dtype=np.float64))
    return int((steps[steps > 0] - 1).sum())


def replace_sealed(
    take: Take,
    info: TakeInfo,
    counts: TakeCounts,
    marks: Sequence[Mark] | None,
    progress: Progress | None,
    let_go: Callable[[], None] = lambda: None,
) -> None:
    """Replaces the file of an open take by a sealed copy. let_go: closes whatever else holds the file open.

    Raises DisplacedError, and touches nothing, if another program put another file under the take's name meanwhile."""
    copy = take.path.with_name(take.path.name + COPY_SUFFIX)
    file = os.fstat(take.fileno())
    try:
        write_sealed(take, copy, info, counts, marks, progress)
        if os.name == "nt":  # which cannot replace an open file; elsewhere an open one is known by its number
            take.close()
            let_go()
        if not is_at(file, take.path):
            raise DisplacedError(take.path)
        try:
            copy.replace(take.path)
        except OSError as error:
            raise TakeError(
                f"Take {take.path} cannot be replaced by its sealed copy ({error.strerror or error}).",
                "Close whatever has it open and seal it again; the take as recorded is unharmed.",
            ) from error
    finally:
        with contextlib.suppress(OSError):
            copy.unlink(missing_ok=True)
    _keep_name(take.path)


def write_sealed(
    take: Take,
    target: Path,
    info: TakeInfo,
    counts: TakeCounts,
    marks: Sequence[Mark] | None = None,
    progress: Progress | None = None,
) -> None:
    """Writes a sealed copy of all that is readable of a take, reads it back and compares. Raises TakeError."""
    digest = 0
    begun, ended = _COPY_SHARE
    try:
        with target.open("wb") as file:
            writer = Writer(file, chunk_size=CHUNK_SIZE, compression=CompressionType.LZ4, enable_data_crcs=True)
            begin(writer, info, take.profiles_data, take.libraries, take.numbers, counts)
            for i, (n, record) in enumerate(_records(take, info, marks)):
                channel_id, sequence, log_ns, publish_ns, data = record
                writer.add_message(channel_id, log_ns, data, publish_ns, sequence)
                digest = _digest(digest, record)
                if progress and i % _TELL_EVERY == 0:
                    progress(begun + (ended - begun) * i / n)
            writer.finish()  # type: ignore[no-untyped-call]
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise TakeError(
            f"The sealed copy of take {take.path} cannot be written ({error.strerror or error}).",
            f"The take as recorded is unharmed. {remedy(error)}",
        ) from error
    if _digest_of(target, progress) != digest:
        raise TakeError(
            f"The sealed copy of take {take.path} did not read back as it was written.",
            "Check the disk and seal it again; the take as recorded is unharmed.",
        )


def _records(take: Take, info: TakeInfo, marks: Sequence[Mark] | None) -> Iterator[tuple[int, Record]]:
    """The messages of a take in the order of its file, each with their total number; then the new marks, if any."""
    topics: list[tuple[int, Frames[object]]] = [(TOPICS[topic], frames) for topic, frames in take.topics.items()]
    if marks is None:
        topics.append((TOPICS[MARK], take.mark_records))
    n = sum(len(frames) for _, frames in topics) + len(marks or ())
    for which, number in in_file_order([frames for _, frames in topics]):
        channel_id, frames = topics[which]
        head, data = frames.message(number)
        _, sequence, log_ns, publish_ns = MESSAGE_HEAD.unpack(head)
        yield n, (channel_id, sequence, log_ns, publish_ns, data)
    begin_ns = take.start_ns or nanoseconds(info.created_utc.timestamp())
    for sequence, mark in enumerate(marks or ()):
        log_ns = later(begin_ns, mark.time_s) if isfinite(mark.time_s) else begin_ns
        yield n, (TOPICS[MARK], sequence, log_ns, log_ns, encode_mark(mark))


def _digest(digest: int, record: Record) -> int:
    return zlib.crc32(record[-1], zlib.crc32(MESSAGE_HEAD.pack(*record[:-1]), digest))


def _digest_of(target: Path, progress: Progress | None) -> int:
    """The digest of what a sealed file holds, read through its index; -1 if that is not whole."""
    file = TakeFile(target)
    try:
        end = sound_ending(file)
        try:
            index = None if end is None else sealed_index(file, end)
        except WrongIndexError:
            index = None
        if index is None:
            return -1
        digest = 0
        take = Take(file, index)
        ended = _COPY_SHARE[1]
        for i, (n, record) in enumerate(_records(take, take.info, None)):
            digest = _digest(digest, record)
            if progress and i % _TELL_EVERY == 0:
                progress(ended + (1 - ended) * i / n)
        return digest
    finally:
        file.close()


@contextlib.contextmanager
def _sole(
    path: Path, progress: Progress | None, own: RecordFile | None = None, counts: TakeCounts | None = None
) -> Iterator[Take]:
    """A whole take that nobody else writes to. own: the file, for whoever holds its lock already. counts: what will be
    said of it; of a file that somebody cut the truth about what is left will do."""
    begun = _COPY_SHARE[0]
    with open_take(path, (lambda share: progress(begun * share)) if progress else None) as take:
        if own is None:
            lock(take.fileno(), path)
        elif not own.is_open_as(take.fileno()):
            raise DisplacedError(path)
        owned_up = (
            own is not None
            and own.cuts > 0
            and counts is not None
            and (counts.written, counts.solved) == (len(take.raw), len(take.solved))
            and {key: one.written for key, one in counts.others.items()}
            == {key: len(one.frames) for key, one in take.streams.items() if not one.solved}
        )
        if not take.complete and not owned_up:
            raise TakeError(f"Take {path} is damaged ({take.damage[0]})", "Recover it; that leaves the file as it is.")
        yield take
        if progress:
            progress(1.0)


def _keep_name(path: Path) -> None:
    """Asks the system to put the folder's entry on the disk, where it can be asked."""
    if os.name == "posix":
        with contextlib.suppress(OSError):
            fd = os.open(path.parent, os.O_RDONLY)
            try:
                os.fsync(fd)
            finally:
                os.close(fd)
