"""Where every record of a take lies. A sealed file's own index is used if the file's checksum proves it whole;
otherwise every record is looked at (core.takes.scan)."""

from __future__ import annotations

import struct
import zlib
from array import array
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Footer, Header, Metadata

from core.errors import FormatError
from core.frames import IntArray
from core.takes.container import INFO, MAGIC, METADATA, PROFILE, TOPICS, profile_name
from core.takes.records import (
    MAX_RECORD,
    MESSAGE_HEAD,
    RECORD_HEAD,
    ChunkPlace,
    Room,
    TakeFile,
    Window,
    parse_chunk,
    stream,
)
from core.takes.take import FORMAT_VERSION, MOST_PERFORMERS, program_version

IN_FILE = -1
"""Chunk number of a message that is in no chunk."""

Progress = Callable[[float], None]

_FOOTER_SIZE = RECORD_HEAD.size + 20
_DATA_END_SIZE = RECORD_HEAD.size + 4
_ENTRY = np.dtype([("log_ns", "<u8"), ("offset", "<u8")])
_BLOCK = 1 << 22
_BETWEEN_CHUNKS = 1 << 12
"""The message indexes behind a chunk and the beginning of the next one, mostly [byte]."""
_MOST_SAID = 20
_MAX_PROFILE = 1 << 22
_PROFILES = frozenset(profile_name(performer) for performer in range(MOST_PERFORMERS))
_LONGEST_VERSION = 9


@dataclass
class Places:
    """Where the messages of one topic lie, in the order of the file, and when they were: grown while indexing.

    chunk: number of the chunk, or IN_FILE. offset: of the record, in its chunk or in the file [byte].
    log_ns: MCAP log time [ns].
    """

    chunk: array[int] = field(default_factory=lambda: array("q"))
    offset: array[int] = field(default_factory=lambda: array("q"))
    log_ns: array[int] = field(default_factory=lambda: array("q"))

    def __len__(self) -> int:
        return len(self.chunk)

    def without(self, left_out: Collection[int]) -> Places:
        """All but those of these numbers."""
        kept = np.delete(self.columns(), sorted(left_out), axis=1)
        return Places(*(array("q", column.tobytes()) for column in kept))

    def columns(self) -> IntArray:
        """(3, n) int64: chunk, offset, log_ns."""
        return np.array([self.chunk, self.offset, self.log_ns], dtype=np.int64).reshape(3, -1)


@dataclass
class Index:
    """Everything of a take but its frames.

    topics: of those that hold anything, by topic name. damage: what is wrong with the file, in sentences, of which
    `note` keeps the first few; unsaid: how many more there were. lost: records of each topic that are known to be
    missing because of damage. sealed: the file was ended properly. stated: this is what the file's own index says; its
    records were not looked at.
    """

    library: str = ""
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    chunks: list[ChunkPlace] = field(default_factory=list)
    topics: dict[str, Places] = field(default_factory=dict)
    damage: list[str] = field(default_factory=list)
    lost: Counter[str] = field(default_factory=Counter)
    sealed: bool = False
    stated: bool = False
    unsaid: int = 0

    def columns(self, topic: str) -> IntArray:
        """(3, n) int64, as Places has them."""
        return self.topics.get(topic, Places()).columns()

    def note(self, damage: str) -> None:
        """One more thing that is wrong with the file. Nobody reads hundreds: those behind the first few are counted."""
        if len(self.damage) < _MOST_SAID:
            self.damage.append(damage)
        else:
            self.unsaid += 1

    def absorb(self, record: Any, channels: dict[int, str], source: object) -> None:
        """Takes in one record that is neither message nor chunk. Raises FormatError."""
        if isinstance(record, Header):
            if record.profile != PROFILE:
                raise FormatError(
                    f"{source} is an MCAP file of another program (profile {record.profile!r}, written by "
                    f"{record.library!r}), not a take.",
                    "Choose a file that Phalanx recorded.",
                )
            self.library = record.library
        elif isinstance(record, Metadata) and record.name in METADATA:
            self.metadata[record.name] = record.metadata
            check_version(self.metadata, self.library, source)
        elif isinstance(record, Attachment) and record.name in _PROFILES and len(record.data) <= _MAX_PROFILE:
            self.attachments[record.name] = record.data
        elif isinstance(record, Channel):
            channels[record.id] = record.topic


def check_version(metadata: Mapping[str, Mapping[str, str]], library: str, source: object) -> None:
    """Raises FormatError if a take is of a newer version than this program knows."""
    version = metadata.get(INFO, {}).get("version", "")
    if version.isdecimal() and (len(version) > _LONGEST_VERSION or int(version) > FORMAT_VERSION):
        shown = version if len(version) <= _LONGEST_VERSION else f"{version[:_LONGEST_VERSION]}…"
        raise FormatError(
            f"Take {source} has format version {shown} (written by {library or 'a newer program'}); this is phalanx "
            f"{program_version()}, which reads versions up to {FORMAT_VERSION}.",
            "Update Phalanx.",
        )


def check_magic(file: TakeFile) -> None:
    """Raises FormatError unless the file begins as an MCAP file does."""
    if file.size == 0:
        raise FormatError(f"{file.path} is empty.", "Nothing was recorded into it; choose another take.")
    begin = file.read(0, len(MAGIC))
    if begin != MAGIC[: len(begin)]:
        raise FormatError(
            f"{file.path} is not a take: it does not begin as an MCAP file.", "Choose a file that Phalanx recorded."
        )


def parse(kind: Any, body: bytes | memoryview) -> Any | None:
    """A record of mcap.records from its body, None if the body is damaged."""
    if kind is Attachment and (len(body) < 4 or struct.unpack("<I", body[-4:])[0] != zlib.crc32(body[:-4])):
        return None
    try:
        return kind.read(stream(body))
    except (struct.error, McapError, UnicodeDecodeError, OverflowError, MemoryError):
        return None


def sound_ending(file: TakeFile, progress: Progress | None = None, check: bool = True) -> Footer | None:
    """The footer of a file whose data section and summary carry the right checksums, else None. check: False takes
    that of the data section as right without reading it."""
    end = _ending(file)
    if end is None or not _summary_whole(file, end) or (check and not _data_whole(file, end, progress)):
        return None
    return end


class WrongIndexError(Exception):
    """A file's own index cannot be so, whatever its checksums, which a faulty program or a forger may have made."""


def sealed_index(file: TakeFile, end: Footer) -> Index | None:
    """The index of a file with this sound ending; None if messages of it are in none, as lie outside chunks. Raises
    WrongIndexError and FormatError."""
    index, channels = Index(sealed=True, stated=True), {}
    room, window = Room(file.size), Window(file, _BETWEEN_CHUNKS)
    for opcode, body, length in _walk(window, end.summary_start, file.size - len(MAGIC) - _FOOTER_SIZE):
        if opcode == Opcode.CHANNEL and (channel := parse(Channel, window.at(body, length) or b"")):
            channels[channel.id] = channel.topic
    for opcode, body, length in _walk(window, len(MAGIC), end.summary_start - _DATA_END_SIZE):
        if opcode == Opcode.CHUNK:
            place = parse_chunk(window.at(body, min(length, 64)) or b"", body, length)
            if place is None or not room.chunk(place):
                raise WrongIndexError
            index.chunks.append(place)
        elif opcode == Opcode.MESSAGE_INDEX:
            _add_messages(index, channels, window.at(body, length) or b"")
        elif opcode == Opcode.MESSAGE:
            return None
        elif kind := PREAMBLE.get(opcode):
            record = parse(kind, window.at(body, length) or b"") if length <= MAX_RECORD else None
            if record is None:
                raise WrongIndexError
            index.absorb(record, channels, file.path)
    if not all(_ascends(places.columns()) for places in index.topics.values()):
        raise WrongIndexError
    return index


def _walk(window: Window, position: int, end: int) -> Iterator[tuple[int, int, int]]:
    """(opcode, where its body begins, length) of every record of a part of the file. Raises WrongIndexError where one
    claims more bytes than there are."""
    while position < end:
        head = window.at(position, RECORD_HEAD.size)
        opcode, length = (0, end) if head is None else RECORD_HEAD.unpack(head)
        position += RECORD_HEAD.size
        if length > end - position:
            raise WrongIndexError
        yield opcode, position, length
        position += length


def _ascends(columns: IntArray) -> bool:
    """Whether messages, (3, n) as Places gives them, stand in the order of the file, none of them twice."""
    chunk, offset = np.diff(columns[0]), np.diff(columns[1])
    return bool(np.all((chunk > 0) | ((chunk == 0) & (offset > 0))))


PREAMBLE: dict[int, Any] = {
    Opcode.HEADER: Header,
    Opcode.METADATA: Metadata,
    Opcode.ATTACHMENT: Attachment,
    Opcode.CHANNEL: Channel,
}
"""Records of interest that stand before the first frame."""


def _ending(file: TakeFile) -> Footer | None:
    """The footer, if the file ends with one."""
    size = RECORD_HEAD.size + 20 + len(MAGIC)
    if file.size < len(MAGIC) + _DATA_END_SIZE + size:
        return None
    tail = file.read(file.size - size, size)
    if tail[-len(MAGIC) :] != MAGIC or RECORD_HEAD.unpack_from(tail) != (Opcode.FOOTER, 20):
        return None
    footer: Footer = Footer.read(stream(tail[RECORD_HEAD.size :]))
    return footer if len(MAGIC) + _DATA_END_SIZE <= footer.summary_start <= file.size - size else None


def has_ending(file: TakeFile) -> bool:
    """Whether the file was ended as a sealed one is."""
    return _ending(file) is not None


def has_checksum(file: TakeFile) -> bool:
    """Whether the file states a checksum of its records, as every sealed take does; other programs may leave it out."""
    end = _ending(file)
    return end is not None and _stated_crc(file, end) != 0


def _summary_whole(file: TakeFile, end: Footer) -> bool:
    """Whether the summary carries the right checksum."""
    return _crc(file, end.summary_start, file.size - len(MAGIC) - 4, None) == end.summary_crc


def _data_whole(file: TakeFile, end: Footer, progress: Progress | None) -> bool:
    """Whether the data section carries the right checksum."""
    expected = _stated_crc(file, end)
    return expected != 0 and _crc(file, 0, end.summary_start - _DATA_END_SIZE, progress) == expected


def _crc(file: TakeFile, begin: int, end: int, progress: Progress | None) -> int:
    """The checksum of a part of the file."""
    crc = 0
    for offset in range(begin, end, _BLOCK):
        crc = zlib.crc32(file.read(offset, min(_BLOCK, end - offset)), crc)
        if progress:
            progress(offset / end)
    return crc


def _stated_crc(file: TakeFile, end: Footer) -> int:
    """The data section's checksum as the file has it; 0: none."""
    head = file.read(end.summary_start - _DATA_END_SIZE, _DATA_END_SIZE)
    if RECORD_HEAD.unpack_from(head) != (Opcode.DATA_END, 4):
        return 0
    return int(struct.unpack_from("<I", head, RECORD_HEAD.size)[0])


def _add_messages(index: Index, channels: Mapping[int, str], body: bytes | memoryview) -> None:
    """The messages of the last chunk on one channel. Raises WrongIndexError if they cannot be where the index says."""
    if len(body) < 6 or not index.chunks:
        raise WrongIndexError
    channel_id, size = struct.unpack_from("<HI", body)
    if channel_id not in channels or size != len(body) - 6 or size % _ENTRY.itemsize:
        raise WrongIndexError
    entries = np.frombuffer(body, _ENTRY, offset=6)
    last = index.chunks[-1].uncompressed_size - RECORD_HEAD.size - MESSAGE_HEAD.size
    if len(entries) and (last < 0 or int(entries["offset"].max()) > last):
        raise WrongIndexError
    if (topic := channels[channel_id]) in TOPICS:
        places = index.topics.setdefault(topic, Places())
        order = np.argsort(entries["offset"], kind="stable")
        places.chunk.extend([len(index.chunks) - 1] * len(entries))
        places.offset.frombytes(entries["offset"][order].astype(np.int64).tobytes())
        places.log_ns.frombytes(np.minimum(entries["log_ns"][order], 2**63 - 1).astype(np.int64).tobytes())
