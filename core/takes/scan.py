"""Reading a take that has no index or is damaged: every record is looked at, what is damaged is left out and said.

A record counts as good only if its own checksum says so. After damage the next good record is searched for, so a
take is read on behind a hole as well as up to one.
"""

from __future__ import annotations

import re
import struct
from array import array

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata

from core.frames import IntArray
from core.takes.container import MAGIC, METADATA, TOPICS
from core.takes.index import IN_FILE, PREAMBLE, Index, Places, Progress, has_ending, parse
from core.takes.message import intact
from core.takes.records import (
    MAX_CHUNK,
    MAX_MESSAGE,
    MAX_RECORD,
    MESSAGE_HEAD,
    RECORD_HEAD,
    ChunkPlace,
    Room,
    TakeFile,
    Window,
    decompress,
    parse_chunk,
)

_MESSAGE_HEAD_END = RECORD_HEAD.size + MESSAGE_HEAD.size
_SMALLEST_MESSAGE = _MESSAGE_HEAD_END + 5
_LIMITS: dict[int, int] = {
    Opcode.MESSAGE: MAX_MESSAGE,
    Opcode.CHUNK: MAX_CHUNK + 64,
}
# A message, chunk, attachment or metadata record of less than 4 GB.
_CANDIDATE = re.compile(rb"(?=[\x05\x06\x09\x0c].{4}\x00{4})", re.DOTALL)


def scan(file: TakeFile, progress: Progress | None = None) -> Index:
    """The index of whatever is readable of a file. Raises FormatError if it is no take of a known version."""
    scanner = _Scanner(file)
    scanner.run(progress)
    return scanner.index


def missing_numbers(numbers: IntArray) -> int:
    """How many messages there should be beside those of these numbers, which count from 0. In any order: chunks that
    have changed places lack nothing."""
    numbers = mended_numbers(numbers)
    return 1 + int(numbers.max()) - len(np.unique(numbers)) if len(numbers) else 0


def mended_numbers(numbers: IntArray) -> IntArray:
    """The same, (n,) int64, where a number that is damaged itself stands between two that leave one alone."""
    between = np.flatnonzero(numbers[2:] - numbers[:-2] == 2) + 1
    mended = numbers.copy()
    mended[between] = numbers[between - 1] + 1
    return mended


class _TooManyError(Exception):
    """The file holds more messages than its bytes could, if they were a take's."""


class _Scanner:
    def __init__(self, file: TakeFile) -> None:
        self.index = Index(sealed=has_ending(file))
        self._file = file
        self._window = Window(file)
        self._room = Room(file.size)
        self._channels = {channel_id: topic for topic, channel_id in TOPICS.items()}
        self._sequences: dict[str, array[int]] = {}
        self._n_messages = 0
        self._damaged_bytes = 0
        self._ended = False

    def run(self, progress: Progress | None) -> None:
        try:
            self._all(progress)
        except _TooManyError:
            self.index.note("It holds more records than a take of its size can: the rest is left out.")
        else:
            if not self._ended and self.index.sealed:
                self.index.note("The end of its records is damaged.")
        self._count_lost()
        if self.index.unsaid:
            self.index.damage.append(f"{self.index.unsaid:,} more places are damaged.")

    def _all(self, progress: Progress | None) -> None:
        position = len(MAGIC)
        told = 0
        while position < self._file.size and not self._ended:
            if progress and position - told > Window.BLOCK:
                told = position
                progress(position / self._file.size)
            position = self._take_in(position) or self._resume(position)

    def _take_in(self, position: int) -> int | None:
        """Indexes the record at a position; the position behind it, None if it is damaged."""
        head = self._head(position)
        if head is None:
            return None
        opcode, length = head
        body, after = position + RECORD_HEAD.size, position + RECORD_HEAD.size + length
        if opcode == Opcode.MESSAGE:
            return after if self._message(position, length) else None
        if opcode == Opcode.CHUNK:
            return after if self._chunk(body, length) else None
        if kind := PREAMBLE.get(opcode):
            data = self._window.at(body, length)
            record = None if data is None else parse(kind, data)
            if record is None:
                return None
            self.index.absorb(record, self._channels, self._file.path)
        elif opcode == Opcode.MESSAGE_INDEX:
            lengths = self._window.at(body, 6) if length >= 6 else None
            if lengths is None or struct.unpack("<HI", lengths)[1] != length - 6:
                return None
        elif opcode in (Opcode.DATA_END, Opcode.FOOTER):
            self._ended = True
        return after

    def _head(self, position: int) -> tuple[int, int] | None:
        """Opcode and length of a record that could be one and lies in the file."""
        head = self._window.at(position, RECORD_HEAD.size)
        if head is None:
            return None
        opcode, length = RECORD_HEAD.unpack(head)
        if not Opcode.HEADER <= opcode <= Opcode.DATA_END or length > _LIMITS.get(opcode, MAX_RECORD):
            return None
        return (opcode, length) if position + RECORD_HEAD.size + length <= self._file.size else None

    def _message(self, position: int, length: int) -> bool:
        record = self._window.at(position, RECORD_HEAD.size + length)
        if record is None or length < MESSAGE_HEAD.size:
            return False
        return self._add_message(record, IN_FILE, position)

    def _add_message(self, record: memoryview, chunk: int, offset: int) -> bool:
        """Indexes a message of a known topic; False if it is damaged. Topics of other programs are passed over."""
        channel_id, sequence, log_ns, _ = MESSAGE_HEAD.unpack_from(record, RECORD_HEAD.size)
        topic = self._channels.get(channel_id)
        if topic is None or topic not in TOPICS:
            return topic is not None
        if not intact(record[_MESSAGE_HEAD_END:]):
            return False
        self._n_messages += 1
        if self._n_messages > self._room.messages:
            raise _TooManyError
        if topic not in self._sequences:
            self.index.topics[topic], self._sequences[topic] = Places(), array("q")
        places = self.index.topics[topic]
        places.chunk.append(chunk)
        places.offset.append(offset)
        places.log_ns.append(min(log_ns, 2**63 - 1))
        self._sequences[topic].append(sequence)
        return True

    def _chunk(self, body: int, length: int) -> bool:
        head = self._window.at(body, min(length, 64))
        place = None if head is None else parse_chunk(head, body, length)
        if place is None:
            return False
        if not self._room.chunk(place):
            self._left_out(place, f"The chunk at byte {body} unpacks to more than a take can hold: it is left out.")
            return True
        records = decompress(place, self._file.read(place.offset, place.size))
        if records is None:
            self._left_out(place, f"The chunk at byte {body} cannot be unpacked.")
            return True
        self.index.chunks.append(place)
        self._walk_chunk(memoryview(records), len(self.index.chunks) - 1, body)
        return True

    def _left_out(self, place: ChunkPlace, why: str) -> None:
        self._damaged_bytes += min(place.uncompressed_size, MAX_CHUNK)
        self.index.note(why)

    def _walk_chunk(self, records: memoryview, chunk: int, body: int) -> None:
        position = bad = 0
        while position + RECORD_HEAD.size <= len(records):
            opcode, length = RECORD_HEAD.unpack_from(records, position)
            after = position + RECORD_HEAD.size + length
            if after > len(records):
                break
            record = records[position:after]
            if opcode == Opcode.MESSAGE:
                if not MESSAGE_HEAD.size <= length <= MAX_MESSAGE or not self._add_message(record, chunk, position):
                    bad += after - position
            elif opcode == Opcode.CHANNEL:
                channel = parse(Channel, record[RECORD_HEAD.size :])
                if channel is not None:
                    self._channels[channel.id] = channel.topic
            position = after
        bad += len(records) - position
        if bad:
            self._damaged_bytes += bad
            self.index.note(f"{bad:,} bytes in the chunk at byte {body} are damaged.")

    def _resume(self, position: int) -> int:
        """The next good record behind a damaged one; says what is left out."""
        following = self._following(position)
        self._damaged_bytes += following - position
        if following < self._file.size:
            self.index.note(f"{following - position:,} bytes at byte {position} are damaged.")
        elif not self.index.sealed:
            self.index.note(
                "The file ends in an unfinished or damaged record: its last "
                f"{following - position:,} bytes are left out."
            )
            self._count_cut_record(position)
        return following

    def _following(self, position: int) -> int:
        head = self._window.at(position, RECORD_HEAD.size)
        if head is not None:
            after = position + RECORD_HEAD.size + int(RECORD_HEAD.unpack(head)[1])
            if after < self._file.size and self._head(after) is not None:
                return after
        start = position + 1
        while start + RECORD_HEAD.size <= self._file.size:
            block = self._window.at(start, min(Window.BLOCK, self._file.size - start))
            if block is None:
                break
            for match in _CANDIDATE.finditer(block):
                if self._sound(start + match.start()):
                    return start + match.start()
            start += max(len(block) - RECORD_HEAD.size + 1, 1)
        return self._file.size

    def _sound(self, position: int) -> bool:
        """Whether a record that can prove itself begins here."""
        head = self._head(position)
        if head is None:
            return False
        opcode, length = head
        body = position + RECORD_HEAD.size
        if opcode == Opcode.CHUNK:
            data = self._window.at(body, min(length, 64))
            return data is not None and parse_chunk(data, body, length) is not None
        data = self._window.at(body, length)
        if data is None:
            return False
        if opcode == Opcode.MESSAGE:
            known = length > MESSAGE_HEAD.size and MESSAGE_HEAD.unpack_from(data)[0] in self._channels
            return known and intact(data[MESSAGE_HEAD.size :])
        if opcode == Opcode.ATTACHMENT:
            return parse(Attachment, data) is not None
        record = parse(Metadata, data)
        return record is not None and record.name in METADATA

    def _count_cut_record(self, position: int) -> None:
        """A message that the end of the file cuts off is one record lost."""
        head = self._window.at(position, RECORD_HEAD.size + 2)
        if head is not None and head[0] == Opcode.MESSAGE:
            topic = self._channels.get(struct.unpack_from("<H", head, RECORD_HEAD.size)[0])
            if topic in TOPICS:
                self.index.lost[topic] += 1

    def _count_lost(self) -> None:
        """Gaps in the numbering of records, bounded by what the damaged bytes could have held."""
        room = self._damaged_bytes // _SMALLEST_MESSAGE
        for topic, sequences in self._sequences.items():
            self.index.lost[topic] += min(missing_numbers(np.frombuffer(sequences, dtype=np.int64)), room)
