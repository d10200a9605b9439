"""Where every record of a take lies. A sealed file's own index is used if the file's checksum proves it whole;
otherwise every record is looked at (core.takes.scan)."""

from __future__ import annotations

import struct
import zlib
from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Footer, Header, Metadata

from core.errors import FormatError
from core.frames import IntArray
from core.takes.container import MAGIC, PROFILE, TOPICS
from core.takes.records import MESSAGE_HEAD, RECORD_HEAD, ChunkPlace, TakeFile, parse_chunk, stream
from core.takes.take import FORMAT_VERSION, program_version

IN_FILE = -1
"""Chunk number of a message that is in no chunk."""

Progress = Callable[[float], None]

_FOOTER_SIZE = RECORD_HEAD.size + 20
_DATA_END_SIZE = RECORD_HEAD.size + 4
_ENTRY = np.dtype([("log_ns", "<u8"), ("offset", "<u8")])
_BLOCK = 1 << 22


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

    def columns(self) -> IntArray:
        """(3, n) int64: chunk, offset, log_ns."""
        return np.array([self.chunk, self.offset, self.log_ns], dtype=np.int64).reshape(3, -1)


@dataclass
class Index:
    """Everything of a take but its frames.

    topics: by topic name. damage: what is wrong with the file, in sentences. lost: records of each topic that are
    known to be missing because of damage. sealed: the file was ended properly.
    """

    library: str = ""
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    chunks: list[ChunkPlace] = field(default_factory=list)
    topics: dict[str, Places] = field(default_factory=lambda: {topic: Places() for topic in TOPICS})
    damage: list[str] = field(default_factory=list)
    lost: dict[str, int] = field(default_factory=lambda: dict.fromkeys(TOPICS, 0))
    sealed: bool = False

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
        elif isinstance(record, Metadata):
            self.metadata[record.name] = record.metadata
            check_version(self.metadata, self.library, source)
        elif isinstance(record, Attachment):
            self.attachments[record.name] = record.data
        elif isinstance(record, Channel):
            channels[record.id] = record.topic


def check_version(metadata: Mapping[str, Mapping[str, str]], library: str, source: object) -> None:
    """Raises FormatError if a take is of a newer version than this program knows."""
    version = metadata.get("phalanx.take", {}).get("version", "")
    if version.isdecimal() and int(version) > FORMAT_VERSION:
        raise FormatError(
            f"Take {source} has format version {version} (written by {library or 'a newer program'}); this is phalanx "
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


def sealed_index(file: TakeFile, progress: Progress | None = None, check: bool = True) -> Index | None:
    """The index of a file whose data section and summary carry the right checksums, else None. check: False takes
    that of the data section as right without reading it. Raises FormatError."""
    end = _ending(file)
    if end is None or not _summary_whole(file, end) or (check and not _data_whole(file, end, progress)):
        return None
    index, channels = Index(sealed=True), {}
    position = end.summary_start
    while position < file.size - len(MAGIC) - _FOOTER_SIZE:
        opcode, length = RECORD_HEAD.unpack(file.read(position, RECORD_HEAD.size))
        if opcode == Opcode.CHANNEL and (channel := parse(Channel, file.read(position + RECORD_HEAD.size, length))):
            channels[channel.id] = channel.topic
        position += RECORD_HEAD.size + length
    position = len(MAGIC)
    while position < end.summary_start - _DATA_END_SIZE:
        opcode, length = RECORD_HEAD.unpack(file.read(position, RECORD_HEAD.size))
        body = position + RECORD_HEAD.size
        if opcode == Opcode.CHUNK:
            place = parse_chunk(file.read(body, 64), body, length)
            if place is None:
                return None
            index.chunks.append(place)
        elif opcode == Opcode.MESSAGE_INDEX:
            if not _add_messages(index, channels, file.read(body, length)):
                return None
        elif opcode == Opcode.MESSAGE:
            return None  # outside a chunk, and so in no index
        elif kind := PREAMBLE.get(opcode):
            record = parse(kind, file.read(body, length))
            if record is None:
                return None
            index.absorb(record, channels, file.path)
        position = body + length
    return index


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
    summary = file.read(end.summary_start, file.size - len(MAGIC) - 4 - end.summary_start)
    return bool(end.summary_crc == zlib.crc32(summary))


def _data_whole(file: TakeFile, end: Footer, progress: Progress | None) -> bool:
    """Whether the data section carries the right checksum."""
    expected = _stated_crc(file, end)
    if expected == 0:
        return False
    data_end = end.summary_start - _DATA_END_SIZE
    crc = 0
    for offset in range(0, data_end, _BLOCK):
        crc = zlib.crc32(file.read(offset, min(_BLOCK, data_end - offset)), crc)
        if progress:
            progress(offset / data_end)
    return crc == expected


def _stated_crc(file: TakeFile, end: Footer) -> int:
    """The data section's checksum as the file has it; 0: none."""
    head = file.read(end.summary_start - _DATA_END_SIZE, _DATA_END_SIZE)
    if RECORD_HEAD.unpack_from(head) != (Opcode.DATA_END, 4):
        return 0
    return int(struct.unpack_from("<I", head, RECORD_HEAD.size)[0])


def _add_messages(index: Index, channels: Mapping[int, str], body: bytes) -> bool:
    """The messages of the last chunk on one channel; False if they cannot be where the index says."""
    if len(body) < 6 or not index.chunks:
        return False
    channel_id, size = struct.unpack_from("<HI", body)
    if channel_id not in channels or size != len(body) - 6 or size % _ENTRY.itemsize:
        return False
    entries = np.frombuffer(body, _ENTRY, offset=6)
    last = index.chunks[-1].uncompressed_size - RECORD_HEAD.size - MESSAGE_HEAD.size
    if len(entries) and (last < 0 or int(entries["offset"].max()) > last):
        return False
    places = index.topics.get(channels[channel_id])
    if places is not None:
        order = np.argsort(entries["offset"], kind="stable")
        places.chunk.extend([len(index.chunks) - 1] * len(entries))
        places.offset.frombytes(entries["offset"][order].astype(np.int64).tobytes())
        places.log_ns.frombytes(np.minimum(entries["log_ns"][order], 2**63 - 1).astype(np.int64).tobytes())
    return True
