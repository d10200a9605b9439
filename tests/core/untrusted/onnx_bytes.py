"""Networks in ONNX, written byte by byte: what no trainer makes."""

from __future__ import annotations

import base64
from collections.abc import Iterable

from core.labelling.network import ENCODED, ENCODER_INPUTS, FORMAT, INPUTS, OUTPUTS, VERSION

FLOAT, OPSET = 1, 17


def varint(value: int) -> bytes:
    """A number of a protobuf message."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes((*out, value))


def whole(number: int, value: int) -> bytes:
    """A field with a number."""
    return varint(number << 3) + varint(value)


def part(number: int, content: bytes | str) -> bytes:
    """A field with bytes, a text or another message."""
    content = content.encode() if isinstance(content, str) else content
    return varint(number << 3 | 2) + varint(len(content)) + content


def node(operation: str, takes: Iterable[str], gives: str, attribute: bytes = b"", domain: str = "") -> bytes:
    """One node of a graph."""
    fields = b"".join(part(1, name) for name in takes) + part(2, gives) + part(4, operation) + attribute
    return part(1, fields + (part(7, domain) if domain else b""))


def axis(value: int) -> bytes:
    """The attribute of that name."""
    return part(5, part(1, "axis") + whole(3, value) + whole(20, 2))


def model(nodes: bytes, takes: Iterable[str], gives: Iterable[str], about: dict[str, str] | None = None) -> bytes:
    """A file. about: its metadata."""
    kind = part(1, whole(1, FLOAT))
    named = b"".join(part(11, part(1, name) + part(2, kind)) for name in takes)
    named += b"".join(part(12, part(1, name) + part(2, kind)) for name in gives)
    entries = b"".join(part(14, part(1, key) + part(2, value)) for key, value in (about or {}).items())
    return whole(1, 8) + part(7, nodes + part(2, "graph") + named) + part(8, part(1, "") + whole(2, OPSET)) + entries


def encoder(nodes: bytes = b"") -> bytes:
    """An encoder of layouts that gives them back. nodes: it has, too."""
    return model(nodes + b"".join(node("Identity", ENCODER_INPUTS, name) for name in ENCODED), ENCODER_INPUTS, ENCODED)


def labeller(nodes: bytes, within: bytes = b"") -> bytes:
    """A file that says it is a labelling network. nodes: give OUTPUTS of INPUTS. within: more nodes of its encoder."""
    about = {"format": FORMAT, "version": VERSION, "encoder": base64.b64encode(encoder(within)).decode()}
    return model(nodes, INPUTS, OUTPUTS, about)
