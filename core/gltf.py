"""The container of glTF 2.0: one JSON document and one buffer of numbers, in a .glb file or a .gltf file beside it."""

from __future__ import annotations

import base64
import binascii
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import FormatError
from core.untrusted.files import open_file, read_bytes
from core.untrusted.json_text import parse_json

Document = dict[str, Any]

_MAGIC, _VERSION = b"glTF", 2
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
_COMPONENTS = {"uint8": 5121, "uint16": 5123, "uint32": 5125, "float32": 5126}
_DTYPES = {code: np.dtype(name).newbyteorder("<") for name, code in _COMPONENTS.items()}
_TYPES: dict[tuple[int, ...], str] = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
_SHAPES = {name: shape for shape, name in _TYPES.items()}

MOST_BYTES = 1 << 28
"""Of a file that is read."""

VERTICES, INDICES = 34962, 34963
"""Targets of buffer views that a graphics card reads."""


@dataclass
class GlbBuilder:
    """Collects arrays and the accessors that point at them."""

    accessors: list[Document] = field(default_factory=list)
    views: list[Document] = field(default_factory=list)
    buffer: bytearray = field(default_factory=bytearray)

    def add(self, values: NDArray[Any], target: int | None = None, bounds: bool = False) -> int:
        """Index of a new accessor to (n, ...) values, 4 x 4 matrices as columns. bounds: tells minimum and maximum."""
        if values.shape[1:] == (4, 4):
            values = values.transpose(0, 2, 1)
        values = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
        data = values.tobytes()
        view: Document = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        self.buffer += data + bytes(-len(data) % 4)
        accessor: Document = {
            "bufferView": len(self.views),
            "componentType": _COMPONENTS[values.dtype.name],
            "count": len(values),
            "type": _TYPES[values.shape[1:]],
        }
        if bounds:
            accessor["min"] = np.atleast_1d(values.min(axis=0)).tolist()
            accessor["max"] = np.atleast_1d(values.max(axis=0)).tolist()
        self.views.append(view)
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def write(self, path: Path, document: Document) -> None:
        """Writes the document with all that was added."""
        document = document | {
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.buffer)}],
        }
        text = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode("utf-8")
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + len(self.buffer)
        with path.open("wb") as stream:
            stream.write(struct.pack("<4sII", _MAGIC, _VERSION, length))
            stream.write(struct.pack("<II", len(text), _JSON) + text)
            stream.write(struct.pack("<II", len(self.buffer), _BINARY))
            stream.write(self.buffer)


@dataclass(frozen=True)
class Gltf:
    """A document and its buffer in memory."""

    document: Document
    buffer: bytes

    def array(self, accessor: int) -> NDArray[np.float64]:
        """The values of an accessor, (n, ...) float64, matrices as rows, normalized integers as shares of one.

        Raises KeyError, IndexError, TypeError or ValueError where the document asks for what the buffer does not hold.
        """
        described = self.document["accessors"][_index(accessor)]
        if "sparse" in described:
            raise ValueError("it stores an array as sparse, which is not read")
        view = self.document["bufferViews"][_index(described["bufferView"])]
        count, shape = _index(described["count"]), _SHAPES[described["type"]]
        dtype = _DTYPES[described["componentType"]]
        width = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
        stride = _index(view.get("byteStride", width))
        begin, length = _index(view.get("byteOffset", 0)), _index(view["byteLength"])
        inside = _index(described.get("byteOffset", 0))
        needed = inside + stride * (count - 1) + width if count else inside
        if stride < width or begin + length > len(self.buffer) or needed > length:
            raise ValueError(
                f"an array of {count} {described['type']} does not fit into the {length} bytes given for it, "
                f"of {len(self.buffer)}"
            )
        stored = np.ndarray((count, *shape), dtype, self.buffer, begin + inside, _strides(stride, shape, dtype))
        values = (stored.swapaxes(1, 2) if described["type"] == "MAT4" else stored).astype(np.float64)
        if described.get("normalized"):
            values /= float(np.iinfo(dtype).max)
        return values


def read_glb(path: Path) -> Gltf:
    """A .glb file. Raises OSError, and ValueError where it is not sound."""
    data = read_bytes(path, MOST_BYTES)
    try:
        magic, version, length = struct.unpack_from("<4sII", data)
        json_length, json_kind = struct.unpack_from("<II", data, 12)
        start = 20 + json_length
        binary_length, binary_kind = struct.unpack_from("<II", data, start)
    except struct.error as error:
        raise ValueError(f"it has {len(data)} bytes") from error
    sound = (magic, version, length) == (_MAGIC, _VERSION, len(data)) and (json_kind, binary_kind) == (_JSON, _BINARY)
    if not sound or start + 8 + binary_length != len(data):
        raise ValueError(f"its header is not that of {len(data)} bytes of glTF 2.0")
    return Gltf(_document(data[20:start]), data[start + 8 :])


def read_gltf(path: Path) -> Gltf:
    """A .gltf or .glb file; the buffer of a .gltf is in it or lies in the same folder.

    Raises OSError, and ValueError or KeyError where it is not sound.
    """
    with open_file(path) as stream:
        if stream.read(4) == _MAGIC:
            return read_glb(path)
    document = _document(read_bytes(path, MOST_BYTES))
    (buffer,) = document["buffers"]
    uri = buffer["uri"]
    if not isinstance(uri, str):
        raise ValueError(f"its buffer is {uri!r}")
    head, comma, text = uri.partition(",")
    if head.startswith("data:") and head.endswith(";base64") and comma:
        try:
            return Gltf(document, base64.b64decode(text, validate=True))
        except binascii.Error as error:
            raise ValueError("the buffer in it is not base64") from error
    if Path(uri).name != uri:
        raise ValueError(f"its buffer {uri!r} does not lie beside it")
    return Gltf(document, read_bytes(path.with_name(uri), MOST_BYTES))


def _document(data: bytes) -> Document:
    try:
        document = parse_json(data, "its document", "", MOST_BYTES)
    except FormatError as error:
        raise ValueError(error.what.rstrip(".")) from error
    if not isinstance(document, dict):
        raise ValueError("its JSON is no document of glTF")
    return document


def _index(value: Any) -> int:
    """A count, an offset or an index: never negative, so that nothing is read from the end."""
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ValueError(f"{value!r} stands where a number of things is meant")
    return value


def _strides(stride: int, shape: tuple[int, ...], dtype: np.dtype[Any]) -> tuple[int, ...]:
    """Bytes from one to the next along each axis of an (n, *shape) array whose rows begin `stride` apart."""
    inner = [dtype.itemsize * int(np.prod(shape[i + 1 :], dtype=np.int64)) for i in range(len(shape))]
    return stride, *inner
