"""Takes spoilt within, with checksums, offsets and lengths made right again: damage that only a crafted file has."""

from __future__ import annotations

import contextlib
import struct
import zlib
from dataclasses import dataclass
from random import Random

import lz4.frame
import zstandard

from tests.fuzz.json_mutations import content_spoilt
from tests.fuzz.mutations import BYTES, MOST_BYTES, NUMBERS, binary_number_replaced

MAGIC = b"\x89MCAP0\r\n"
FOOTER, MESSAGE, CHUNK, CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX = 0x02, 0x05, 0x06, 0x08, 0x09, 0x0A
METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = 0x0C, 0x0D, 0x0E, 0x0F
_HEAD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQI")
_MESSAGE_HEAD = 22
_BOMB_BYTES = 256 << 20


@dataclass
class Record:
    """One record of the file. offset: where it stood; -1 of one that was put in."""

    kind: int
    content: bytes
    offset: int = -1

    @property
    def encoded(self) -> bytes:
        """As it stands in the file."""
        return _HEAD.pack(self.kind, len(self.content)) + self.content


def records_of(data: bytes, start: int = 0) -> list[Record]:
    """The whole records from `start`; what does not fit is left out."""
    found, at = [], start
    while at + _HEAD.size <= len(data):
        kind, size = _HEAD.unpack_from(data, at)
        end = at + _HEAD.size + size
        if end > len(data) or kind == MAGIC[0]:
            break
        found.append(Record(kind, data[at + _HEAD.size : end], at))
        at = end
    return found


def _text(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def _texts(data: bytes) -> list[bytes]:
    """The texts of a metadata record: its name, then keys and values in turn."""
    size = struct.unpack_from("<I", data)[0]
    found, at = [data[4 : 4 + size]], 8 + size
    while at + 4 <= len(data):
        size = struct.unpack_from("<I", data, at)[0]
        found.append(data[at + 4 : at + 4 + size])
        at += 4 + size
    return found


def _message_spoilt(content: bytes, random: Random) -> bytes:
    """Its message damaged, and the checksum in it right."""
    body = random.choice(BYTES)(content[_MESSAGE_HEAD:-5], random)
    return content[:_MESSAGE_HEAD] + body + b"\x7d" + struct.pack("<I", zlib.crc32(body))


def _metadata_spoilt(content: bytes, random: Random) -> bytes:
    texts = _texts(content)
    at = random.randrange(len(texts))
    texts[at] = random.choice(NUMBERS) if random.random() < 0.7 else random.choice(BYTES)(texts[at], random)
    if random.random() < 0.2 and len(texts) > 2:
        texts += [b"dropped." + random.choice(NUMBERS), random.choice(NUMBERS)]
    return _text(texts[0]) + _text(b"".join(map(_text, texts[1:])))


def _attachment_spoilt(content: bytes, random: Random) -> bytes:
    try:
        at = 16
        for _ in range(2):
            at += 4 + struct.unpack_from("<I", content, at)[0]
        size = struct.unpack_from("<Q", content, at)[0]
    except struct.error:
        return content
    body = content[at + 8 : at + 8 + size]
    body = content_spoilt(body, random) if random.random() < 0.7 else random.choice(BYTES)(body, random)
    return content[:at] + struct.pack("<Q", len(body)) + body + bytes(4)


def _content_spoilt(record: Record, random: Random) -> bytes:
    try:
        if record.kind == MESSAGE and random.random() < 0.7:
            return _message_spoilt(record.content, random)
        if record.kind == METADATA and random.random() < 0.8:
            return _metadata_spoilt(record.content, random)
        if record.kind == ATTACHMENT and random.random() < 0.8:
            return _attachment_spoilt(record.content, random)
        if record.kind == CHUNK and random.random() < 0.9:
            return _chunk_spoilt(record.content, random)
    except (struct.error, RuntimeError, zstandard.ZstdError):  # spoilt before
        return record.content
    return random.choice((*BYTES, binary_number_replaced, binary_number_replaced))(record.content, random)


def _chunk_spoilt(content: bytes, random: Random) -> bytes:
    """What is in it damaged, or what unpacks to far more; its sizes and checksum are right, mostly."""
    start, end, size, _ = _CHUNK.unpack_from(content)
    name_size = struct.unpack_from("<I", content, _CHUNK.size)[0]
    at = _CHUNK.size + 4
    name, packed = content[at : at + name_size], content[at + name_size + 8 :]
    if random.random() < 0.05:
        bomb = zstandard.ZstdCompressor().compressobj(_BOMB_BYTES)
        block = bytes(1 << 20)
        packed = b"".join([*(bomb.compress(block) for _ in range(_BOMB_BYTES >> 20)), bomb.flush()])
        claimed = random.choice((_BOMB_BYTES, size, 1 << 40))
        return _CHUNK.pack(start, end, claimed, 0) + _text(b"zstd") + struct.pack("<Q", len(packed)) + packed
    records = records_of(lz4.frame.decompress(packed) if name == b"lz4" else packed)
    _spoil(records, random)
    plain = b"".join(record.encoded for record in records)
    name, packed = random.choice(
        ((b"lz4", lz4.frame.compress(plain)), (b"zstd", zstandard.compress(plain)), (b"", plain), (b"lz5", plain))
    )
    claimed = len(plain) if random.random() < 0.9 else random.choice((0, 1, 1 << 34, 1 << 62, (1 << 64) - 1))
    head = _CHUNK.pack(start, end, claimed, zlib.crc32(plain))
    return head + _text(name) + struct.pack("<Q", len(packed)) + packed


def _spoil(records: list[Record], random: Random) -> None:
    for _ in range(random.choice((1, 1, 2, 5)) if records else 0):
        at = random.randrange(len(records)) if records else 0
        match random.randrange(8) if records else -1:
            case 0:
                del records[at]
            case 1:
                again = Record(records[at].kind, records[at].content)
                records[at:at] = [again] * random.choice((1, 3, 64, 500))
            case 2:
                records.insert(random.randrange(len(records)), records.pop(at))
            case -1:
                pass
            case _:
                records[at] = Record(records[at].kind, _content_spoilt(records[at], random), records[at].offset)


def _linked(records: list[Record]) -> bytes:
    """The file of these records, with offsets, lengths and checksums as they now are."""
    new_of: dict[int, tuple[int, Record]] = {}
    at = len(MAGIC)
    for record in records:
        new_of.setdefault(record.offset, (at, record))
        at += len(record.encoded)
    made, data_crc, summary = bytearray(MAGIC), 0, 0
    for record in records:
        content = record.content
        with contextlib.suppress(struct.error):  # too short for its own fields
            content = _relinked(record, new_of, data_crc, made[summary:] if summary else b"")
        made += Record(record.kind, content).encoded
        if record.kind == DATA_END:
            summary = len(made)
        elif not summary:
            data_crc = zlib.crc32(made[len(made) - len(record.encoded) :], data_crc or zlib.crc32(MAGIC))
    return bytes(made) + MAGIC


def _relinked(record: Record, new_of: dict[int, tuple[int, Record]], data_crc: int, summary: bytes) -> bytes:
    content = record.content

    def moved(offset: int) -> tuple[int, int]:
        """Where a record is now, and its length."""
        where, found = new_of.get(offset, (offset, record))
        return where, len(found.encoded)

    match record.kind:
        case 0x0F:  # data end
            return struct.pack("<I", data_crc)
        case 0x09:  # attachment
            return content[:-4] + struct.pack("<I", zlib.crc32(content[:-4]))
        case 0x0A | 0x0D:  # index of attachments, of metadata
            return struct.pack("<QQ", *moved(struct.unpack_from("<Q", content)[0])) + content[16:]
        case 0x0E:  # offsets within the summary
            where, _ = moved(struct.unpack_from("<Q", content, 1)[0])
            return content[:1] + struct.pack("<Q", where) + content[9:]
        case 0x08:  # index of chunks
            where, length = moved(struct.unpack_from("<Q", content, 16)[0])
            size = struct.unpack_from("<I", content, 32)[0]
            entries = bytearray(content[36 : 36 + size])
            for at in range(0, len(entries) - 9, 10):
                struct.pack_into("<Q", entries, at + 2, moved(struct.unpack_from("<Q", entries, at + 2)[0])[0])
            return content[:16] + struct.pack("<QQI", where, length, size) + bytes(entries) + content[36 + size :]
        case 0x02:  # footer
            start, offsets = (moved(offset)[0] for offset in struct.unpack_from("<QQ", content))
            head = _HEAD.pack(FOOTER, len(content)) + struct.pack("<QQ", start, offsets)
            return head[_HEAD.size :] + struct.pack("<I", zlib.crc32(summary + head)) + content[20:]
    return content


def crafted(data: bytes, random: Random) -> bytes:
    """A take whose records are spoilt and whose links and checksums are right."""
    records = records_of(data, len(MAGIC))
    _spoil(records, random)
    made = _linked(records) if data.endswith(MAGIC) else MAGIC + b"".join(record.encoded for record in records)
    if random.random() < 0.15:  # a record's own claim of its length
        at = random.choice([record.offset for record in records if record.offset >= 0] or [len(MAGIC)])
        claim = random.choice((0, 1 << 20, 1 << 34, 1 << 40, 1 << 62, (1 << 63) - 1, (1 << 64) - 1))
        made = made[: at + 1] + struct.pack("<Q", claim) + made[at + 9 :]
    return made[:MOST_BYTES]
