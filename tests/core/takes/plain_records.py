"""What a take holds, record by record, whether sealed or not."""

from __future__ import annotations

from pathlib import Path

from mcap.opcode import Opcode

from core.takes.container import MAGIC
from core.takes.records import RECORD_HEAD, decompress, parse_chunk

_OF_THE_FILE = (Opcode.MESSAGE_INDEX, Opcode.DATA_END)


def records(path: Path) -> list[tuple[int, bytes]]:
    """(opcode, body) of the records before the end of the data, those of chunks in their place."""
    data = path.read_bytes()
    return [one for one in _split(data, len(MAGIC)) if one[0] not in _OF_THE_FILE]


def _split(data: bytes, position: int) -> list[tuple[int, bytes]]:
    found = []
    while position + RECORD_HEAD.size <= len(data):
        opcode, length = RECORD_HEAD.unpack_from(data, position)
        body = data[position + RECORD_HEAD.size : position + RECORD_HEAD.size + length]
        position += RECORD_HEAD.size + length
        if opcode == Opcode.CHUNK:
            place = parse_chunk(body[:64], 0, len(body))
            assert place is not None
            unpacked = decompress(place, body[place.offset :])
            assert unpacked is not None
            found += _split(unpacked, 0)
        else:
            found.append((opcode, body))
        if opcode == Opcode.DATA_END:
            break
    return found
