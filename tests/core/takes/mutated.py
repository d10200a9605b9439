"""Takes changed at random with every checksum made right again: `python -m tests.core.takes.mutated SEED COUNT`.

Whatever they hold, reading them ends in results or in a PhalanxError. Prints how each ended and the most memory.
"""

from __future__ import annotations

import json
import struct
import sys
import tempfile
import time
import traceback
import zlib
from argparse import Namespace
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path
from typing import TypeVar

import numpy as np
from mcap.opcode import Opcode

from app.commands import info
from app.commands.result import to_json
from core.errors import PhalanxError
from core.profile import load_profile
from core.takes.container import MAGIC
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.records import MESSAGE_HEAD, RECORD_HEAD, decompress, parse_chunk
from core.takes.recover import recover
from core.takes.take import Mark, StreamCounts, TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.core.takes.crafted import chunk, message_index, metadata, offsets_of, seal, signed
from tests.core.takes.frames import (
    GLOVE,
    OPTICAL,
    OTHER,
    clock_sample,
    inertial_frame,
    marker_frame,
    plain_bones,
    plain_frame,
    tracked_frame,
)
from tests.memory import most_bytes

NUMBERS = (0, 1, 2, 5, 0x7F, 0x80, 0xFF, 2**15, 2**16 - 1, 2**31 - 1, 2**32 - 1, 2**40, 2**62, 2**63, 2**64 - 1)
WORDS = (
    "", "0", "-1", "1", "3", "9" * 5000, "1" * 13, "٩", "nan", "inf", "-inf", "1e308", "1e-320", "-120", "65", "x\0y",
    "1_0", "[" * 2000, "9999-12-31T23:59:59+00:00", "0001-01-01T00:00:00", "2024-01-01T00:00:00-23:59", "\u202e",
)  # fmt: skip
KEYS = (
    "version", "performers", "created_utc", "rate_hz", "name", "written", "received", "dropped.x", "length_s",
    "first_s", "lost", "rejected", "solved", "tracked.left", "streams", "key", "what", "bone.1", "sides",
)  # fmt: skip

NAMES = (
    "phalanx.take", "phalanx.counts", "phalanx.device", "phalanx.stream.1", "phalanx.stream.2", "phalanx.counts.2",
    "phalanx.stream.64",
)  # fmt: skip

T = TypeVar("T")


@dataclass(frozen=True)
class Record:
    opcode: int
    body: bytes
    claims: int | None = None

    @property
    def data(self) -> bytes:
        return RECORD_HEAD.pack(self.opcode, len(self.body) if self.claims is None else self.claims) + self.body


def split(data: bytes) -> list[Record]:
    """The records in bytes that hold nothing else."""
    found, position = [], 0
    while position + RECORD_HEAD.size <= len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, position)
        position += RECORD_HEAD.size
        found.append(Record(opcode, data[position : position + length]))
        position += length
    return found


class Mutator:
    """Changes a good take. rng: where, and how."""

    def __init__(self, take: bytes, rng: np.random.Generator) -> None:
        data = take[len(MAGIC) :]
        self._records = [one for one in split(data) if one.opcode not in (Opcode.CHUNK, Opcode.MESSAGE_INDEX)]
        end = next((i for i, one in enumerate(self._records) if one.opcode == Opcode.DATA_END), None)
        self._records = self._records[:end]
        self._sealed, self._inner = end is not None, []
        for one in split(data):
            if one.opcode == Opcode.CHUNK:
                place = parse_chunk(one.body[:64], 0, len(one.body))
                assert place is not None
                unpacked = decompress(place, one.body[place.offset :])
                assert unpacked is not None
                self._inner.append(split(unpacked))
        self._rng = rng

    def take(self) -> bytes:
        """One more changed take."""
        outer, inner = list(self._records), [list(one) for one in self._inner]
        for _ in range(int(self._rng.integers(1, 4))):
            where = [outer, *inner][int(self._rng.integers(1 + len(inner)))]
            self._change(where)
        body = b"".join(one.data for one in outer)
        for records in inner:
            body += self._chunk(b"".join(one.data for one in records))
        return seal(MAGIC + body) if self._sealed else MAGIC + body

    def _one(self, of: Sequence[T]) -> T:
        return of[int(self._rng.integers(len(of)))]

    def _chunk(self, unpacked: bytes) -> bytes:
        compression = self._one(("lz4", "zstd", ""))
        odd = self._rng.random() < 0.1
        made = chunk(unpacked, compression, self._one(NUMBERS) if odd else None)
        by_channel: dict[int, list[int]] = {}
        for offset in offsets_of(unpacked) if len(unpacked) < 1 << 22 else []:
            if offset + 11 <= len(unpacked):
                by_channel.setdefault(struct.unpack_from("<H", unpacked, offset + 9)[0], []).append(offset)
        for channel_id, offsets in by_channel.items():
            if self._rng.random() < 0.1:
                offsets = [self._one([*offsets, *NUMBERS]) for _ in range(self._rng.integers(20))]
            made += message_index(offsets, channel_id)
        return made

    def _change(self, records: list[Record]) -> None:
        if not records:
            return
        i, rng = int(self._rng.integers(len(records))), self._rng
        kind = rng.integers(12)
        if kind == 0:
            del records[i]
        elif kind == 1:
            records[i:i] = [records[i]] * int(rng.integers(1, 200))
        elif kind == 2:
            j = int(rng.integers(len(records)))
            records[i], records[j] = records[j], records[i]
        elif kind == 3:
            records[i] = replace(records[i], opcode=int(rng.integers(256)))
        elif kind == 4:
            records[i] = replace(records[i], claims=self._one(NUMBERS))
        elif kind in (5, 6):
            words = {self._one(KEYS): self._one(WORDS) for _ in range(3)}
            records.append(split(metadata(self._one(NAMES), words))[0])
        else:
            records[i] = self._body(records[i])

    def _body(self, one: Record) -> Record:
        """With its own checksum made right, if it has one."""
        if one.opcode == Opcode.MESSAGE and self._rng.random() < 0.8:
            head, data = one.body[: MESSAGE_HEAD.size], one.body[MESSAGE_HEAD.size : -5]
            return replace(one, body=head + signed(self._bytes(data)))
        if one.opcode == Opcode.ATTACHMENT:
            body = self._bytes(one.body[:-4])
            return replace(one, body=body + struct.pack("<I", zlib.crc32(body)))
        return replace(one, body=self._bytes(one.body))

    def _bytes(self, data: bytes) -> bytes:
        rng, changed = self._rng, bytearray(data)
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(changed) + 1))
            match rng.integers(5):
                case 0 if at < len(changed):
                    changed[at] ^= 1 << rng.integers(8)
                case 1:
                    number = struct.pack("<Q", self._one(NUMBERS))[: self._one((1, 2, 4, 8))]
                    changed[at : at + len(number)] = number
                case 2:
                    del changed[at : at + int(rng.integers(1, 40))]
                case 3:
                    changed[at:at] = rng.bytes(int(rng.integers(1, 40)))
                case _:
                    changed[at:at] = changed[at // 2 : at] * int(rng.integers(1, 20))
        return bytes(changed)


def good(folder: Path, sealed: bool) -> bytes:
    """A take of every kind of record."""
    rng, path = np.random.default_rng(1), folder / f"good{sealed}.mcap"
    cast = [load_profile("schroeder6")] * 2
    writer = TakeWriter(path, TakeInfo("good", "Ann", rate_hz=120), cast, (OPTICAL, GLOVE, OTHER), OPTICAL.key)
    for i in range(8):
        writer.raw(OPTICAL.key, plain_frame(i) if i % 2 else marker_frame(rng))
        writer.raw(GLOVE.key, plain_bones(i) if i % 2 else inertial_frame(rng))
        writer.raw((OPTICAL, GLOVE, OTHER)[i % 3].key, clock_sample(rng))
        writer.solved(tracked_frame(rng, 2))
    writer.raw(OTHER.key, plain_frame(0))
    writer.mark(Mark(0.1, "clap"))
    if sealed:
        others = {GLOVE.key: StreamCounts(8, 8), OTHER.key: StreamCounts(1, 1)}
        writer.seal(TakeCounts(8, 8, solved=8, length_s=1.0, first_s=0.1, others=others))
    else:
        writer.close()
    return path.read_bytes()


def read_through(path: Path) -> None:
    """What the window asks of a take."""
    with open_take(path) as take:
        _ = take.verdict.texts, take.holes.words, take.span_s, take.complete
        for key in take.streams:
            _ = take.holes_in(key).words
        for frames in take.topics.values():
            for i in range(len(frames)):
                try:
                    _ = frames[i]
                except PhalanxError:
                    continue


def told(path: Path) -> None:
    """What `info` prints."""
    with redirect_stdout(StringIO()):
        to_json(info.run(Namespace(file=path)).figures)


READERS: tuple[Callable[[Path], object], ...] = (read_through, verify, recover, read_recording, told)


def main(seed: int, n: int) -> None:
    """Prints a JSON object: how many ended how, what went wrong, the longest [s] and the most memory [byte]."""
    rng = np.random.default_rng(seed)
    ended: Counter[str] = Counter()
    wrong: list[str] = []
    longest_s = 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        mutators = [Mutator(good(folder, sealed), rng) for sealed in (True, False)]
        for k in range(n):
            path = folder / f"mutated_{k}.mcap"
            path.write_bytes(mutators[k % 2].take())
            for read in READERS:
                began_s = time.process_time()
                try:
                    read(path)
                    ended["result"] += 1
                except PhalanxError as error:
                    ended[type(error).__name__] += 1
                except BaseException:
                    wrong.append(f"{read.__name__}, take {k} of seed {seed}: {traceback.format_exc()}")
                longest_s = max(longest_s, time.process_time() - began_s)
            for left in folder.glob("mutated_*"):
                left.unlink()
    print(json.dumps({"ended": ended, "wrong": wrong, "longest_s": longest_s, "bytes": most_bytes()}))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
