"""Files of parts, spoilt within while what holds them together stays right: lengths, offsets and checksums."""

from __future__ import annotations

import io
import json
import struct
import warnings
import zipfile
from random import Random

from tests.fuzz.json_mutations import content_spoilt
from tests.fuzz.mutations import BYTES, binary_number_replaced

_SHAPES = ("(1099511627776,)", "(-1,)", "(2, 0, 3)", "()", "(4611686018427387904, 4)", "(1,)", "(3, 5, 7)")
_KINDS = ("|O", "<U8", "<f8", "|S4", "<i8", "<c16", "<M8[s]", ">f4", "|V8", "<f99", "<U1000000000")


def _header_spoilt(data: bytes, random: Random) -> bytes:
    """An .npy whose header claims another shape or kind of number."""
    size = int.from_bytes(data[8:10], "little")
    header = data[10 : 10 + size].decode("latin-1", "replace")
    try:
        if random.random() < 0.5:
            begin, end = header.index("(", header.index("shape")), header.index(")") + 1
            header = header[:begin] + random.choice(_SHAPES) + header[end:]
        else:
            begin = header.index("'descr': '") + 10
            header = header[:begin] + random.choice(_KINDS) + header[header.index("'", begin) :]
    except ValueError:
        return data
    text = header.rstrip().encode("latin-1", "replace") + b"\n"
    return data[:8] + len(text).to_bytes(2, "little") + text + data[10 + size :]


def npz_spoilt(data: bytes, random: Random) -> bytes:
    """One array of an .npz spoilt, missing, named otherwise or given twice; the archive's checksums are right."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = [(info.filename, archive.read(info)) for info in archive.infolist()]
    except Exception:  # spoilt before
        return data
    if not members:
        return data
    at = random.randrange(len(members))
    name, content = members[at]
    match random.randrange(6):
        case 0:
            del members[at]
        case 1:
            members.append((random.choice((name, "../" + name, "x")), content))
        case 2:
            members[at] = (random.choice(members)[0], content)
        case 3 | 4:
            members[at] = (name, _header_spoilt(content, random))
        case _:
            members[at] = (name, random.choice(BYTES)(content, random))
    made = io.BytesIO()
    packing = random.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    with warnings.catch_warnings(action="ignore"), zipfile.ZipFile(made, "w", packing) as archive:
        for name, content in members:
            archive.writestr(name, content)
    return made.getvalue()


def glb_spoilt(data: bytes, random: Random) -> bytes:
    """The document or the buffer of a .glb spoilt; its lengths are right."""
    try:
        size = struct.unpack_from("<I", data, 12)[0]
        document, buffer = data[20 : 20 + size], data[28 + size :]
        json.loads(document)
    except (struct.error, ValueError, RecursionError):
        return data
    if random.random() < 0.7:
        document = content_spoilt(document, random)
    else:
        buffer = random.choice((*BYTES, binary_number_replaced))(buffer, random)
    document += b" " * (-len(document) % 4)
    buffer += bytes(-len(buffer) % 4)
    length = 28 + len(document) + len(buffer)
    return (
        struct.pack("<4sIIII", b"glTF", 2, length, len(document), 0x4E4F534A) + document
        + struct.pack("<II", len(buffer), 0x004E4942) + buffer
    )  # fmt: skip


def datagrams_of(data: bytes) -> list[bytes]:
    """The packets of a recorded conversation: each after its length in two bytes. What is cut off is left out."""
    packets, at = [], 0
    while at + 2 <= len(data):
        size = int.from_bytes(data[at : at + 2], "little")
        packets.append(data[at + 2 : at + 2 + size])
        at += 2 + size
    return packets


def conversation_of(packets: list[bytes]) -> bytes:
    """The reverse."""
    return b"".join(len(packet).to_bytes(2, "little") + packet for packet in packets)


def datagrams_spoilt(data: bytes, random: Random) -> bytes:
    """Packets of a conversation spoilt, lost, repeated, exchanged, or with another length than they say."""
    packets = datagrams_of(data)
    for _ in range(random.choice((1, 3, 10)) if packets else 0):
        at = random.randrange(len(packets))
        match random.randrange(6):
            case 0 if len(packets) > 1:
                del packets[at]
            case 1:
                packets[at:at] = [packets[at]] * random.choice((1, 20))
            case 2:
                other = random.randrange(len(packets))
                packets[at], packets[other] = packets[other], packets[at]
            case 3:
                packets[at] = random.choice(BYTES)(packets[at], random)[:65_000]
            case _:  # the payload alone: the length in its header stays right
                payload = random.choice(BYTES)(packets[at][4:], random)[:65_000]
                packets[at] = packets[at][:2] + len(payload).to_bytes(2, "little") + payload
    return conversation_of(packets)
