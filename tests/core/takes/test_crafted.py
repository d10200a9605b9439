"""Takes whose checksums are right and whose contents are not: bounded by the bytes there are, read as far as they are
true."""

from __future__ import annotations

import struct
import subprocess
import sys
import tracemalloc
from pathlib import Path

import pytest
from mcap.opcode import Opcode

from core.errors import PhalanxError
from core.takes.checked import check
from core.takes.container import TOPICS
from core.takes.reader import open_take
from core.takes.records import MAX_CHUNK
from core.takes.recover import recover
from core.takes.take import TakeCounts
from core.takes.verify import verify
from tests.core.takes import crafted
from tests.core.takes.crafted import Crafted, chunk, message, message_index, offsets_of, raw, record, signed
from tests.core.takes.frames import bits, plain_frame
from tests.data import ROOT

COUNTS = {"received": "5", "written": "5", "lost": "0", "rejected": "0", "solved": "0"}
FIVE = b"".join(raw(i) for i in range(5))
OFFSETS = offsets_of(FIVE)
CHANNELS = b"".join(crafted.channel(channel_id, topic) for topic, channel_id in list(TOPICS.items())[:3])


def written(folder: Path, data: bytes) -> Path:
    path = folder / "take.mcap"
    path.write_bytes(data)
    return path


def the_five(path: Path) -> None:
    with open_take(path) as take:
        assert bits(tuple(take.raw)) == bits(tuple(plain_frame(i) for i in range(5)))


def test_a_crafted_take_is_a_take(tmp_path: Path) -> None:
    """What the others are made by makes good ones, too."""
    path = written(tmp_path, Crafted([chunk(FIVE), message_index(OFFSETS)], counts=COUNTS).sealed())
    the_five(path)
    assert verify(path).condition == "is whole" and verify(path).counts == TakeCounts(5, 5)
    assert recover(path).path is None


LYING = {
    "the same again": [chunk(FIVE), message_index([*OFFSETS, *OFFSETS])],
    "one record many times": [chunk(FIVE), message_index([OFFSETS[0]] * 5000)],
    "two indexes": [chunk(FIVE), message_index(OFFSETS), message_index(OFFSETS)],
    "outside": [chunk(FIVE), message_index([*OFFSETS, len(FIVE)])],
    "far outside": [chunk(FIVE), message_index([*OFFSETS, 2**63 + 5])],
    "before its chunk": [message_index(OFFSETS), chunk(FIVE)],
    "another channel": [chunk(FIVE), message_index(OFFSETS, channel_id=9)],
    "half an entry": [chunk(FIVE), record(Opcode.MESSAGE_INDEX, struct.pack("<HI", 1, 7) + bytes(7))],
    "no head": [chunk(FIVE), record(Opcode.MESSAGE_INDEX, b"\1")],
}


@pytest.mark.parametrize("kind", LYING)
def test_an_index_that_lies_is_not_believed(tmp_path: Path, kind: str) -> None:
    path = written(tmp_path, Crafted(LYING[kind], counts=COUNTS).sealed())
    the_five(path)
    with open_take(path) as take:
        assert take.problems == ("Its index does not lead to its records, though every one is readable.",) or (
            kind in ("half an entry", "no head") and take.damage
        )
    assert recover(path).recovered == 5


@pytest.mark.parametrize("offsets", [OFFSETS[:3], [OFFSETS[0] + 1, *OFFSETS[1:]], []])
def test_an_index_that_leads_elsewhere_is_found_by_everyone_who_reads(tmp_path: Path, offsets: list[int]) -> None:
    path = written(tmp_path, Crafted([chunk(FIVE), message_index(offsets)], counts=COUNTS).sealed())
    with open_take(path) as take:
        checked = check(take)
        assert bits(tuple(checked.take.raw)) == bits(tuple(plain_frame(i) for i in range(5)))
        assert "The index of /raw does not agree with its records." in checked.take.damage
    assert not verify(path).ok
    recovered = recover(path).path
    assert recovered is not None and verify(recovered).ok
    the_five(recovered)


def test_records_within_records_are_not_unpacked_again_and_again(tmp_path: Path) -> None:
    """Each of them is whole, and holds all that follow: read as the index has them they are 600 MB."""
    inner = b""
    nested = []
    for i in range(600):
        inner = message(signed(struct.pack("<BB", 8, 2) + b"\x82\x01" + _varint(len(inner)) + inner), i)
        nested.append(len(inner))
    offsets = [len(inner) - size for size in nested][::-1]
    path = written(tmp_path, Crafted([chunk(inner), message_index(offsets)]).sealed())
    with open_take(path) as take:
        readable = 0
        for i in range(len(take.raw)):
            try:
                readable += len(take.raw.message(i)[1])
            except PhalanxError:
                continue
        assert readable <= len(inner)
    assert not verify(path).ok


def _varint(n: int) -> bytes:
    out = b""
    while n > 0x7F:
        out, n = out + bytes([n & 0x7F | 0x80]), n >> 7
    return out + bytes([n])


@pytest.mark.parametrize("opcode", [1, 4, 6, 7, 9, 12, 200])
@pytest.mark.parametrize("claim", [1, 2**40, 2**63 - 1, 2**64 - 1])
@pytest.mark.parametrize("where", ["records", "summary"])
def test_a_length_beyond_its_part_of_the_file(tmp_path: Path, opcode: int, claim: int, where: str) -> None:
    liar = struct.pack("<BQ", opcode, claim)
    good = [chunk(FIVE), message_index(OFFSETS)]
    if where == "records":
        data = Crafted([*good, liar], counts=COUNTS).sealed()
    else:
        data = Crafted(good, counts=COUNTS).sealed(CHANNELS + liar)
    path = written(tmp_path, data)
    tracemalloc.start()
    the_five(path)
    assert recover(path).recovered == 5
    assert not verify(path).ok
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()


SMALL = message(signed(b""))
FULL = MAX_CHUNK - 1000
BOMBS = {
    "one chunk too large": lambda: chunk(record(0x80, bytes(1 << 28)), "zstd"),
    "many chunks": lambda: chunk(record(0x80, bytes(FULL)), "zstd") * 400,
    "small messages": lambda: chunk(SMALL * (FULL // len(SMALL)), "zstd") * 40,
    "large messages": lambda: chunk(message(signed(b"\x2a\x80\x80\x80\x01" + bytes(1 << 21))) * 15, "zstd") * 40,
    "many points": lambda: chunk(message(signed(b"\x32\xf0\xff\x7f" + bytes(0x1FFFF0))) * 15, "zstd") * 100,
    "many rigid bodies": lambda: chunk(message(signed(b"\x42\x00" * (1 << 20))) * 15, "zstd") * 100,
}
"""Little files that hold much."""

READ = """
import sys, time
from core.errors import PhalanxError
from core.takes.reader import open_take
from core.takes.recover import recover
from core.takes.verify import verify
from tests.memory import most_bytes
for read in (lambda path: open_take(path).close(), verify, recover):
    began_s = time.process_time()
    try:
        read(sys.argv[1])
    except PhalanxError as error:
        print(error, file=sys.stderr)
    print(time.process_time() - began_s)
print(most_bytes())
"""


@pytest.mark.parametrize(("kind", "indexed"), [*((kind, False) for kind in BOMBS), ("many chunks", True)])
def test_what_unpacks_is_bounded(tmp_path: Path, kind: str, indexed: bool) -> None:
    data = Crafted([BOMBS[kind]()])
    path = written(tmp_path, data.sealed() if indexed else data.data())
    done = subprocess.run(
        [sys.executable, "-c", READ, path], cwd=ROOT, capture_output=True, text=True, timeout=240, check=False
    )
    assert done.returncode == 0 and "Recover the take" not in done.stderr, done.stderr
    *seconds, peak = map(float, done.stdout.split())
    assert len(seconds) == 3 and max(seconds) < 10 and peak < 500e6, (seconds, peak, path.stat().st_size)
