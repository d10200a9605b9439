"""A good file, spoilt in the ways that disks, editors and strangers do."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator

NUMBER = re.compile(rb"-?\d+(\.\d+)?([eE][-+]?\d+)?")
ENTRY = re.compile(rb'"[^"\\]*"\s*:\s*("[^"\\]*"|-?[\d.]+|\[[^\[\]{}]*\]|true|false|null)\s*,')
ODD = (
    b"1e308", b"-1", b"1e999", b"NaN", b"-Infinity", b"9" * 5000, b"9" * 400, b'"text"', b'"0.1"', b"true", b"null",
    b"{}", b"[]", b"[[1, 2], [3]]", b"[" * 3000 + b"]" * 3000, b'"\\ud800"', b'"\\u0000"', b"0",
    b"18446744073709551616",
)  # fmt: skip
"""In place of a number, a text or a list."""


def mutations(good: bytes, count: int, seed: int, *, is_text: bool) -> Iterator[bytes]:
    """`count` spoilt files, always the same ones of a seed."""
    chance = random.Random(seed)
    ways = [_flipped, _cut, _inserted, _repeated, _zeroed]
    if is_text:
        ways += [_odd_number, _odd_number, _odd_value, _left_out, _twice]
    for _ in range(count):
        data = good
        for _ in range(chance.choice((1, 1, 1, 2, 4))):
            data = chance.choice(ways)(data, chance)
        yield data


def _place(data: bytes, chance: random.Random) -> int:
    return chance.randrange(max(len(data), 1))


def _flipped(data: bytes, chance: random.Random) -> bytes:
    spoilt = bytearray(data)
    for _ in range(chance.choice((1, 1, 8, 64)) if data else 0):
        spoilt[_place(data, chance)] ^= 1 << chance.randrange(8)
    return bytes(spoilt)


def _cut(data: bytes, chance: random.Random) -> bytes:
    return data[: _place(data, chance)]


def _inserted(data: bytes, chance: random.Random) -> bytes:
    i = _place(data, chance)
    return data[:i] + chance.randbytes(chance.choice((1, 4, 100))) + data[i:]


def _repeated(data: bytes, chance: random.Random) -> bytes:
    i, n = _place(data, chance), chance.choice((1, 20, 500))
    return data[:i] + data[i : i + n] * chance.choice((2, 3, 50)) + data[i + n :]


def _zeroed(data: bytes, chance: random.Random) -> bytes:
    i, n = _place(data, chance), chance.choice((1, 4, 512))
    return data[:i] + chance.choice((b"\0", b"\xff")) * len(data[i : i + n]) + data[i + n :]


def _odd_number(data: bytes, chance: random.Random) -> bytes:
    return _put(data, NUMBER, chance.choice(ODD), chance)


def _odd_value(data: bytes, chance: random.Random) -> bytes:
    found = list(ENTRY.finditer(data))
    if not found:
        return data
    entry = chance.choice(found)
    return data[: entry.start(1)] + chance.choice(ODD) + data[entry.end(1) :]


def _left_out(data: bytes, chance: random.Random) -> bytes:
    return _put(data, ENTRY, b"", chance)


def _twice(data: bytes, chance: random.Random) -> bytes:
    found = list(ENTRY.finditer(data))
    if not found:
        return data
    entry = chance.choice(found)
    return data[: entry.end()] + entry[0] + data[entry.end() :]


def _put(data: bytes, where: re.Pattern[bytes], what: bytes, chance: random.Random) -> bytes:
    found = list(where.finditer(data))
    if not found:
        return data
    place = chance.choice(found)
    return data[: place.start()] + what + data[place.end() :]
