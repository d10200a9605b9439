"""How sound bytes and text are spoilt. All chance comes from the generator given, so that a case can be made again."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Sequence
from random import Random

Mutation = Callable[[bytes, Random], bytes]

MOST_BYTES = 4 << 20
"""No spoilt file is longer: what is asked is what a small file can do."""

_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")

NUMBERS = (
    b"0", b"-0", b"-1", b"1e308", b"-1e308", b"1e999", b"1e-320", b"NaN", b"-nan", b"Infinity", b"-inf", b"1e400000",
    b"2147483647", b"-2147483649", b"9223372036854775807", b"18446744073709551616", b"9" * 5000, b"0." + b"3" * 5000,
    b"1_000", b"0x10", b"\xd9\xa3", b"\xef\xbc\x91", b"1,5", b"1.2.3", b"--1", b"+", b".", b"e5", b"",
    b" ", b"true", b"null",
)  # fmt: skip
"""What a number in a text is replaced by: too large, too small, none, of other alphabets, of 5,000 digits."""

_FORMATS = ("<H", "<I", "<Q", "<f", "<d", ">H", ">I", ">f", "<q")
_BINARY = {
    "H": (0, 1, 0x7FFF, 0x8000, 0xFFFF),
    "I": (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x10000000, 0x00FFFFFF),
    "Q": (0, 1, 1 << 31, 1 << 34, 1 << 40, (1 << 62), (1 << 63) - 1, 1 << 63, (1 << 64) - 1),
    "q": (-1, -(1 << 63), 4_000_000_000),
    "f": (float("nan"), float("inf"), -float("inf"), 3.4e38, -1.0, 1e-40, 1e10),
    "d": (float("nan"), float("inf"), -float("inf"), 1.7e308, -1.0, 5e-324, 1e18),
}


def _where(data: bytes, random: Random) -> int:
    """A place; half of the time near the start, where headers are."""
    return random.randrange(min(len(data), 600) if random.random() < 0.5 else len(data)) if data else 0


def _span(data: bytes, random: Random) -> tuple[int, int]:
    begin = _where(data, random)
    return begin, min(len(data), begin + random.choice((1, 2, 4, 8, 16, 60, 300, 2000)))


def truncated(data: bytes, random: Random) -> bytes:
    return data[: _where(data, random)]


def bits_flipped(data: bytes, random: Random) -> bytes:
    spoilt = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 8, 40)) if data else 0):
        spoilt[_where(data, random)] ^= 1 << random.randrange(8)
    return bytes(spoilt)


def bytes_replaced(data: bytes, random: Random) -> bytes:
    begin, end = _span(data, random)
    fill = random.choice((bytes(end - begin), b"\xff" * (end - begin), random.randbytes(end - begin)))
    return data[:begin] + fill + data[end:]


def binary_number_replaced(data: bytes, random: Random) -> bytes:
    form = random.choice(_FORMATS)
    packed = struct.pack(form, random.choice(_BINARY[form[1]]))
    at = _where(data, random)
    at -= at % random.choice((1, 2, 4))
    return data[:at] + packed + data[at + len(packed) :]


def block_removed(data: bytes, random: Random) -> bytes:
    begin, end = _span(data, random)
    return data[:begin] + data[end:]


def block_repeated(data: bytes, random: Random) -> bytes:
    begin, end = _span(data, random)
    times = random.choice((1, 2, 5, 50, 1000))
    return (data[:end] + data[begin:end] * times + data[end:])[:MOST_BYTES]


def block_moved(data: bytes, random: Random) -> bytes:
    begin, end = _span(data, random)
    rest = data[:begin] + data[end:]
    at = _where(rest, random)
    return rest[:at] + data[begin:end] + rest[at:]


def noise_inserted(data: bytes, random: Random) -> bytes:
    at = _where(data, random)
    return data[:at] + random.randbytes(random.choice((1, 3, 20, 500))) + data[at:]


def spliced(others: Sequence[bytes]) -> Mutation:
    """The start of one sound file with the end of another."""

    def splice(data: bytes, random: Random) -> bytes:
        other = random.choice(others)
        return data[: _where(data, random)] + other[_where(other, random) :]

    return splice


def text_number_replaced(data: bytes, random: Random) -> bytes:
    places = list(_NUMBER.finditer(data[:100_000]))
    for place in sorted(random.sample(places, min(len(places), random.choice((1, 1, 1, 3, 30)))), key=_start)[::-1]:
        data = data[: place.start()] + random.choice(NUMBERS) + data[place.end() :]
    return data


def _start(place: re.Match[bytes]) -> int:
    return place.start()


def _lines_spoilt(data: bytes, random: Random) -> bytes:
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    at = random.randrange(min(len(lines), 12) if random.random() < 0.6 else len(lines))
    match random.randrange(5):
        case 0:
            del lines[at]
        case 1:
            lines[at:at] = [lines[at]] * random.choice((1, 3, 300))
        case 2:
            other = random.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at]
        case 3:
            lines[at] = b"\n"
        case _:
            lines[at] = lines[at].rstrip(b"\r\n")
    return b"".join(lines)[:MOST_BYTES]


def lines_spoilt(data: bytes, random: Random) -> bytes:
    """One removed, repeated, exchanged, emptied, or run into the next."""
    return _lines_spoilt(data, random)


def cells_spoilt(data: bytes, random: Random) -> bytes:
    """A delimiter, quote or line break more, fewer, or another one."""
    places = [m.start() for m in re.finditer(rb"[,;\t\n\":{}\[\]]", data[:100_000])]
    if not places:
        return data
    at = random.choice(places)
    return data[:at] + random.choice((b"", b",", b";", b"\t", b"\n", b'"', b",,,,", b"\r", b"[", b"}")) + data[at + 1 :]


def encoded_otherwise(data: bytes, random: Random) -> bytes:
    """Another encoding, a byte order mark, a NUL, bytes of no encoding."""
    text = data.decode("utf-8", "replace")
    match random.randrange(6):
        case 0:
            return text.encode("utf-16")
        case 1:
            return text.encode("utf-32", "replace")
        case 2:
            return b"\xef\xbb\xbf" + data
        case 3:
            return b"\xff\xfe" + data
        case 4:
            return noise_at(data, random, b"\0")
        case _:
            return noise_at(
                data, random, random.choice((b"\xc3\x28", b"\xed\xa0\x80", b"\x1b[2J", "\u202e\u0661".encode()))
            )


def noise_at(data: bytes, random: Random, what: bytes) -> bytes:
    at = _where(data, random)
    return data[:at] + what + data[at:]


BYTES: tuple[Mutation, ...] = (
    truncated, bits_flipped, bytes_replaced, binary_number_replaced, binary_number_replaced, block_removed,
    block_repeated, block_moved, noise_inserted,
)  # fmt: skip
TEXT: tuple[Mutation, ...] = (
    truncated, bits_flipped, text_number_replaced, text_number_replaced, text_number_replaced, lines_spoilt,
    lines_spoilt, cells_spoilt, encoded_otherwise, block_repeated, block_removed, block_moved,
)  # fmt: skip


def spoilt(samples: Sequence[bytes], mutations: Sequence[Mutation], random: Random) -> bytes:
    """A sound file of these, mutated once or a few times."""
    data = random.choice(samples)
    for _ in range(random.choice((1, 1, 1, 2, 3, 6))):
        data = random.choice(mutations)(data, random)[:MOST_BYTES]
    return data
