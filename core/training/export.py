"""A trained network as one small ONNX file, with what it is and how it was made inside, and a card beside it."""

from __future__ import annotations

import base64
import io
import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn

from core.labelling.marker_features import N_FEATURES
from core.labelling.network import ENCODED, ENCODER_INPUTS, FORMAT, INPUTS, OUTPUTS, VERSION
from core.training.network import Answer, Labeller
from core.whole_file import write_whole

OPSET = 17
Names = tuple[str, ...]
_AXES = {
    "points_m": {0: "b", 1: "n"}, "asked": {0: "b"}, "markers": {1: "m"}, "memory": {1: "m"}, "kept": {1: "m"},
    "log_label": {0: "b", 1: "n", 2: "names"}, "log_point": {0: "b", 1: "m", 2: "places"}, "side": {0: "b", 1: "n"},
}  # fmt: skip
HALF = "_half"
"""Ends the name of a constant that is stored in half precision."""
_HALVED = 256  # numbers of the smallest such


class Calibrated(nn.Module):
    """What answers: logarithms of probabilities that mean what they say (Guo 2017: one temperature)."""

    def __init__(self, model: Labeller, temperature: float) -> None:
        super().__init__()
        self.model = model
        self.temperature = temperature

    def forward(self, points_m: Tensor, asked: Tensor, memory: Tensor, kept: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """(b, n, 3), (b,), (1, m, w), (1, m, 2 w) to (b, n, m + 1), (b, m, n + 1), (b, n): b clouds of one layout."""
        answer: Answer = self.model.answered(points_m, asked, memory, kept)
        scores = torch.cat([answer.label[..., :-1].transpose(1, 2), answer.hidden[..., None]], dim=-1)
        return (
            torch.log_softmax(answer.label / self.temperature, dim=-1),
            torch.log_softmax(scores / self.temperature, dim=-1),
            answer.side,
        )


class Encoder(nn.Module):
    """What is run once per layout."""

    def __init__(self, model: Labeller) -> None:
        super().__init__()
        self.model = model

    def forward(self, markers: Tensor) -> tuple[Tensor, Tensor]:
        """(1, m, 12) to (1, m, w) and (1, m, 2 w)."""
        encoded: tuple[Tensor, Tensor] = self.model.encoded(markers)
        return encoded


def export(model: Labeller, temperature: float, about: Mapping[str, str], path: Path) -> None:
    """Writes the network, the encoder of layouts within its metadata. about: goes there too.

    Raises FormatError where it cannot be written.
    """
    encoder, content = graphs(model, temperature)
    for graph in (encoder, content):
        _halve(graph.graph)
    within = base64.b64encode(encoder.SerializeToString()).decode("ascii")
    for key, value in {"format": FORMAT, "version": VERSION, "encoder": within, **about}.items():
        entry = content.metadata_props.add()
        entry.key, entry.value = key, value
    onnx.checker.check_model(content)
    write_whole(path, content.SerializeToString(), "Network")


def graphs(model: Labeller, temperature: float) -> tuple[onnx.ModelProto, onnx.ModelProto]:
    """The encoder of layouts, and what answers, in single precision."""
    layout, points = torch.ones(1, 19, N_FEATURES), torch.linspace(-0.05, 0.05, 60).reshape(1, 20, 3)
    model.eval()
    with torch.no_grad():
        example = (points, torch.zeros(1), *model.encoded(layout))
    encoder = _graph(Encoder(model), (layout,), ENCODER_INPUTS, ENCODED)
    return encoder, _graph(Calibrated(model, temperature), example, INPUTS, OUTPUTS)


def _graph(module: nn.Module, example: tuple[Tensor, ...], inputs: Names, outputs: Names) -> onnx.ModelProto:
    """One module as ONNX."""
    axes = {name: _AXES[name] for name in (*inputs, *outputs) if name in _AXES}
    stream = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(
            module.eval(), example, stream, input_names=list(inputs), output_names=list(outputs),
            dynamic_axes=axes, opset_version=OPSET, dynamo=False,
        )  # fmt: skip
    content = onnx.load_from_string(stream.getvalue())
    _any_number_of_clouds(content.graph)
    return content


def _any_number_of_clouds(graph: onnx.GraphProto) -> None:
    """Takes back that tracing wrote down one cloud wherever a shape is changed: 0 is what comes in, in ONNX."""
    shapes = {node.input[1] for node in graph.node if node.op_type == "Reshape"}
    for node in graph.node:
        if node.op_type == "Constant" and node.output[0] in shapes:
            shape = numpy_helper.to_array(node.attribute[0].t).copy()
            shape[0] = 0
            node.attribute[0].t.CopyFrom(numpy_helper.from_array(shape))


def write_card(card: Mapping[str, Any], path: Path) -> None:
    """The card of a network as JSON beside it. Raises FormatError."""
    write_whole(path, json.dumps(card, indent=2, ensure_ascii=False) + "\n", "Card")


def _halve(graph: onnx.GraphProto) -> None:
    """Large weights in half precision, widened again when the network is loaded: half the file, the same speed."""
    widened = []
    for tensor in list(graph.initializer):
        values = numpy_helper.to_array(tensor)
        if values.dtype != np.float32 or values.size < _HALVED:
            continue
        name = tensor.name
        graph.initializer.remove(tensor)
        graph.initializer.append(numpy_helper.from_array(values.astype(np.float16), name + HALF))
        widened.append(onnx.helper.make_node("Cast", [name + HALF], [name], to=onnx.TensorProto.FLOAT))
    for node in reversed(widened):
        graph.node.insert(0, node)
