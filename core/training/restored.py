"""A trained network read back from its file, so that training can go on from it."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from onnx import numpy_helper

from core.errors import FormatError, PhalanxError
from core.labelling.network import network_bytes
from core.training.export import HALF, graphs
from core.training.network import LAYERS, Labeller
from core.untrusted.onnx_graph import check_graph

FEWEST_LAYERS = 4
"""Of networks that earlier versions trained."""


def restored(path: Path) -> Labeller:
    """The network that `path` was exported from, its large weights rounded to half precision; one of fewer layers gets
    those that it lacks, which change nothing until they are trained.

    Raises FormatError where the file is no network of this make.
    """
    try:
        data = network_bytes(path)
        check_graph(data, f"Network {path}", "Give a file made by phalanx train labeller.")
        content = onnx.load_from_string(data)
        within = {entry.key: entry.value for entry in content.metadata_props}
        encoder = onnx.load_from_string(base64.b64decode(within["encoder"]))
    except PhalanxError:
        raise
    except Exception as error:  # the parser has no common base for what it raises
        raise FormatError(f"Network {path} cannot be read.", "Give a file made by phalanx train labeller.") from error
    known = {**dict(_constants(encoder)), **dict(_constants(content))}
    for layers in range(LAYERS, FEWEST_LAYERS - 1, -1):
        model = _filled(known, layers)
        if model is not None:
            return deepened(model, LAYERS)
    raise FormatError(f"Network {path} is of another make than this Phalanx trains.", "Train a new one without it.")


def deepened(model: Labeller, layers: int) -> Labeller:
    """The same network with more layers, the new ones last: what they add is zero until they are trained."""
    deeper, own = Labeller(layers), len(model.attention)
    deeper.load_state_dict({**deeper.state_dict(), **model.state_dict()})
    with torch.no_grad():
        for i in range(own, layers):
            for last in (deeper.attention[i].out, deeper.reading[i].out, deeper.feed[i].net[-1]):
                last.weight.zero_()
                last.bias.zero_()
    return deeper


def _filled(known: dict[str, NDArray[np.float32]], layers: int) -> Labeller | None:
    """The network of so many layers with these constants of an export as its weights; None where they are another's.

    An export folds weights into constants under names and shapes of its own. Which number went where is seen by
    exporting a network whose weights are numbered.
    """
    model = Labeller(layers)
    total = sum(parameter.numel() for parameter in model.parameters())
    weights = np.full(total, np.nan, dtype=np.float32)
    for name, number in _numbered(layers, total):
        values = known.get(name)
        if values is None or values.shape != number.shape:
            return None
        weights[number.ravel()] = values.ravel()
    first = 0
    with torch.no_grad():
        for parameter in model.parameters():
            own = weights[first : first + parameter.numel()]
            parameter.copy_(torch.from_numpy(own).reshape(parameter.shape))
            first += parameter.numel()
    return model


_FIRST = 1 << 16  # above whatever else a graph holds, and all of them exact in single precision


def _numbered(layers: int, total: int) -> Iterator[tuple[str, NDArray[np.int64]]]:
    """Name and, by number, weights of every constant of an export that is made of weights."""
    model = Labeller(layers)
    first = _FIRST
    with torch.no_grad():
        for parameter in model.parameters():
            numbers = torch.arange(first, first + parameter.numel(), dtype=torch.float32)
            parameter.copy_(numbers.reshape(parameter.shape))
            first += parameter.numel()
    for graph in graphs(model, temperature=0.5):
        for name, values in _constants(graph):
            whole = np.rint(values)
            if values.size and np.array_equal(values, whole) and whole.min() >= _FIRST and whole.max() < _FIRST + total:
                yield name, whole.astype(np.int64) - _FIRST


def _constants(content: onnx.ModelProto) -> Iterator[tuple[str, NDArray[np.float32]]]:
    prefix = "encoder " if len(content.graph.output) == 2 else ""
    for tensor in content.graph.initializer:
        values = numpy_helper.to_array(tensor)
        if values.dtype in (np.float32, np.float16):
            yield prefix + tensor.name.removesuffix(HALF), values.astype(np.float32)
