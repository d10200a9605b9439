"""Takes made record by record, with right checksums whatever they hold."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import lz4.frame
import zstandard
from mcap.opcode import Opcode

from core.profile import load_profile
from core.takes.codec import encode_raw
from core.takes.container import MAGIC, TOPICS
from core.takes.records import CHUNK_HEAD, MESSAGE_HEAD, RECORD_HEAD
from tests.core.takes.frames import plain_frame


def record(opcode: int, body: bytes) -> bytes:
    return RECORD_HEAD.pack(opcode, len(body)) + body


def text(words: str) -> bytes:
    return struct.pack("<I", len(words.encode())) + words.encode()


def texts(words: Mapping[str, str]) -> bytes:
    body = b"".join(text(key) + text(value) for key, value in words.items())
    return struct.pack("<I", len(body)) + body


def header() -> bytes:
    return record(Opcode.HEADER, text("phalanx") + text("phalanx x"))


def metadata(name: str, words: Mapping[str, str]) -> bytes:
    return record(Opcode.METADATA, text(name) + texts(words))


def attachment(name: str, data: bytes) -> bytes:
    body = struct.pack("<QQ", 0, 0) + text(name) + text("application/json") + struct.pack("<Q", len(data)) + data
    return record(Opcode.ATTACHMENT, body + struct.pack("<I", zlib.crc32(body)))


PROFILE = attachment("profile.json", load_profile("schroeder6").to_json().encode())


def channel(channel_id: int, topic: str) -> bytes:
    return record(Opcode.CHANNEL, struct.pack("<HH", channel_id, 0) + text(topic) + text("protobuf") + texts({}))


def signed(body: bytes) -> bytes:
    """A message's data with the checksum that every message ends in."""
    return body + struct.pack("<BI", 15 << 3 | 5, zlib.crc32(body))


def message(data: bytes, number: int = 0, channel_id: int = 1, log_ns: int = 10**9) -> bytes:
    return record(Opcode.MESSAGE, MESSAGE_HEAD.pack(channel_id, number, log_ns, log_ns) + data)


def raw(i: int) -> bytes:
    """The message of a plain frame."""
    return message(encode_raw(plain_frame(i)), i)


PACKERS = {"": lambda data: data, "lz4": lz4.frame.compress, "zstd": zstandard.compress}


def chunk(records: bytes, compression: str = "lz4", claims: int | None = None) -> bytes:
    packed = PACKERS[compression](records)
    size = len(records) if claims is None else claims
    head = CHUNK_HEAD.pack(0, 2**63, size, zlib.crc32(records), len(compression))
    return record(Opcode.CHUNK, head + compression.encode() + struct.pack("<Q", len(packed)) + packed)


def message_index(offsets: Iterable[int], channel_id: int = 1, log_ns: int = 10**9) -> bytes:
    entries = b"".join(struct.pack("<QQ", log_ns, offset) for offset in offsets)
    return record(Opcode.MESSAGE_INDEX, struct.pack("<HI", channel_id, len(entries)) + entries)


def offsets_of(records: bytes) -> list[int]:
    """Where the messages among records begin."""
    found, position = [], 0
    while position < len(records):
        opcode, length = RECORD_HEAD.unpack_from(records, position)
        if opcode == Opcode.MESSAGE:
            found.append(position)
        position += RECORD_HEAD.size + length
    return found


@dataclass
class Crafted:
    """A take of a header, metadata, profile and these records, in one order and with whatever summary."""

    records: Sequence[bytes] = ()
    info: Mapping[str, str] = field(default_factory=lambda: {"version": "1", "name": "x", "rate_hz": "120"})
    counts: Mapping[str, str] | None = None

    def data(self) -> bytes:
        channels = b"".join(channel(channel_id, topic) for topic, channel_id in list(TOPICS.items())[:3])
        counts = b"" if self.counts is None else metadata("phalanx.counts", self.counts)
        about = (header(), metadata("phalanx.take", self.info), counts, PROFILE)
        return b"".join((MAGIC, *about, channels, *self.records))

    def sealed(self, summary: bytes | None = None) -> bytes:
        """With data end, summary and footer, all their checksums right."""
        return seal(self.data(), summary)


def seal(data: bytes, summary: bytes | None = None) -> bytes:
    """A data section (magic and records) with a right ending."""
    if summary is None:
        summary = b"".join(channel(channel_id, topic) for topic, channel_id in list(TOPICS.items())[:3])
    end = data + record(Opcode.DATA_END, struct.pack("<I", zlib.crc32(data)))
    footer = RECORD_HEAD.pack(Opcode.FOOTER, 20) + struct.pack("<QQ", len(end), 0)
    return end + summary + footer + struct.pack("<I", zlib.crc32(summary + footer)) + MAGIC


def resealed(data: bytes) -> bytes:
    """A sealed file, or what was changed in it, with the checksums made right again."""
    if len(data) < len(MAGIC) + 50 or data[-8:] != MAGIC:
        return data
    (start,) = struct.unpack_from("<Q", data, len(data) - 28)
    if not len(MAGIC) + 13 <= start <= len(data) - 37:
        return data
    summary = data[start:-12]
    return b"".join(
        (data[: start - 4], struct.pack("<I", zlib.crc32(data[: start - 13])), summary,
         struct.pack("<I", zlib.crc32(summary)), MAGIC)
    )  # fmt: skip
