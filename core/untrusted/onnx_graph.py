"""What an ONNX file asks to be done, read from its bytes before anything runs it.

Only the fields that matter are looked at (onnx.proto of ONNX 1.17); whether the rest is sound the runtime finds out.
"""

from __future__ import annotations

from collections.abc import Iterator

from core.errors import FormatError

MOST_BYTES = 1 << 26
"""Of a file; the networks of Phalanx have less than 1 MB."""

OPERATIONS = frozenset({
    "Add", "BatchNormalization", "Cast", "Clip", "Concat", "Constant", "Conv", "Div", "Dropout", "Equal", "Erf",
    "Exp", "Flatten", "Gather", "Gemm", "Identity", "LayerNormalization", "Log", "LogSoftmax", "MatMul", "Max",
    "MaxPool", "Min", "Mul", "Neg", "Pow", "Reciprocal", "ReduceMax", "ReduceMean", "ReduceSum", "Relu", "Reshape",
    "Shape", "Sigmoid", "Slice", "Softmax", "Split", "Sqrt", "Squeeze", "Sub", "Tanh", "Transpose", "Unsqueeze",
    "Where",
})  # fmt: skip
"""What such networks are made of. Nothing in it loops, draws, reads a file, or makes much of one number."""

MOST_FIELDS = 1 << 18
"""Of all messages in a file: forty times as many as the networks of Phalanx have."""

_DOMAINS = (b"", b"ai.onnx")
_MOST_SHOWN = 40

# Numbers of fields, by message.
_MODEL_GRAPH, _MODEL_FUNCTIONS = 7, 25
_GRAPH_NODE, _GRAPH_TENSOR, _GRAPH_SPARSE = 1, 5, 15
_NODE_OPERATION, _NODE_ATTRIBUTE, _NODE_DOMAIN = 4, 5, 7
_ATTRIBUTE_TENSOR, _ATTRIBUTE_GRAPH, _ATTRIBUTE_TENSORS, _ATTRIBUTE_GRAPHS = 5, 6, 10, 11
_ATTRIBUTE_SPARSE, _ATTRIBUTE_SPARSES = 22, 23  # unpacked when it is loaded: 100 bytes to 2 GB
_TENSOR_ELSEWHERE, _TENSOR_LOCATION = 13, 14


def check_graph(content: bytes, source: str, mend: str) -> None:
    """Raises FormatError for a network that is too large, calls what is not of OPERATIONS, or keeps numbers in other
    files or in a way that unpacks to more. content: of an .onnx file."""
    if len(content) > MOST_BYTES:
        raise FormatError(f"{source} has {len(content):,} bytes; {MOST_BYTES:,} at most are read.", mend)
    try:
        _Model().check(content)
    except _UnfitError as error:
        raise FormatError(f"{source} {error}.", mend) from error
    except (ValueError, IndexError, TypeError) as error:
        raise FormatError(f"{source} is no network that can be run.", mend) from error


class _UnfitError(Exception):
    """Why, as the end of a sentence."""


Value = memoryview | int


class _Model:
    """One file, gone through once."""

    def __init__(self) -> None:
        self._left = MOST_FIELDS  # that may still come

    def check(self, content: bytes) -> None:
        for number, value in self._fields(memoryview(content)):
            if number == _MODEL_FUNCTIONS:
                raise _UnfitError("defines operations of its own")
            if number == _MODEL_GRAPH:
                self._graph(value)

    def _graph(self, graph: Value) -> None:
        for number, value in self._fields(graph):
            if number == _GRAPH_SPARSE:
                raise _UnfitError("keeps numbers in a way that is not read")
            if number == _GRAPH_TENSOR:
                self._tensor(value)
            elif number == _GRAPH_NODE:
                self._node(value)

    def _node(self, node: Value) -> None:
        operation, domain = b"", b""
        for number, value in self._fields(node):
            if number == _NODE_OPERATION:
                operation = bytes(_part(value))
            elif number == _NODE_DOMAIN:
                domain = bytes(_part(value))
            elif number == _NODE_ATTRIBUTE:
                self._attribute(value)
        name = operation.decode("utf-8", "replace")
        if domain not in _DOMAINS or name not in OPERATIONS:
            whole = f"{domain.decode('utf-8', 'replace')}.{name}" if domain else name
            raise _UnfitError(f"asks for the operation {whole[:_MOST_SHOWN]!r}, which no network of Phalanx is made of")

    def _attribute(self, attribute: Value) -> None:
        for number, value in self._fields(attribute):
            if number in (_ATTRIBUTE_TENSOR, _ATTRIBUTE_TENSORS):
                self._tensor(value)
            elif number in (_ATTRIBUTE_GRAPH, _ATTRIBUTE_GRAPHS):
                raise _UnfitError("holds networks within a network")
            elif number in (_ATTRIBUTE_SPARSE, _ATTRIBUTE_SPARSES):
                raise _UnfitError("keeps numbers in a way that is not read")

    def _tensor(self, tensor: Value) -> None:
        for number, value in self._fields(tensor):
            if number == _TENSOR_ELSEWHERE or (number == _TENSOR_LOCATION and value != 0):
                raise _UnfitError("keeps its numbers in another file")

    def _fields(self, message: Value) -> Iterator[tuple[int, Value]]:
        for field in _fields(message):
            self._left -= 1
            if self._left < 0:
                raise _UnfitError(f"has more than {MOST_FIELDS:,} parts, which no network of Phalanx has")
            yield field


def _part(value: Value) -> memoryview:
    if isinstance(value, int):
        raise ValueError("a number where a message is meant")
    return value


def _fields(message: Value) -> Iterator[tuple[int, Value]]:
    """Number and value of each field of a protobuf message. Raises ValueError and IndexError where it is none."""
    data, i = _part(message), 0
    while i < len(data):
        tag, i = _varint(data, i)
        number, kind = tag >> 3, tag & 7
        if kind == 0:
            value, i = _varint(data, i)
            yield number, value
            continue
        if kind == 2:
            length, i = _varint(data, i)
        elif kind in (1, 5):
            length = 8 if kind == 1 else 4
        else:
            raise ValueError(f"fields of kind {kind}")
        if length > len(data) - i:
            raise ValueError(f"{length} bytes claimed, {len(data) - i} there")
        yield number, data[i : i + length]
        i += length


def _varint(data: memoryview, i: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = data[i]
        value |= (byte & 0x7F) << shift
        i += 1
        if byte < 0x80:
            return value, i
    raise ValueError("a number without an end")
