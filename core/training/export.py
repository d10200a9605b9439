"""A trained network as one small ONNX file, with what it is and how it was made inside, and a card beside it."""

from __future__ import annotations

import json
import logging
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn

from core.errors import FormatError
from core.labelling.marker_features import N_FEATURES
from core.labelling.network import FORMAT, INPUTS, OUTPUTS, VERSION
from core.training.network import Answer, Labeller

OPSET = 17
_HALVED = 256  # weights of more numbers are stored in half precision


class Calibrated(nn.Module):
    """What is exported: logarithms of probabilities that mean what they say (Guo 2017: one temperature)."""

    def __init__(self, model: Labeller, temperature: float) -> None:
        super().__init__()
        self.model = model
        self.temperature = temperature

    def forward(self, points_m: Tensor, asked: Tensor, markers: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """(b, n, 3), (b,), (1, m, 12) to (b, n, m + 1), (b, m, n + 1), (b, n)."""
        answer: Answer = self.model(points_m, asked, markers)
        scores = torch.cat([answer.label[..., :-1].transpose(1, 2), answer.hidden[..., None]], dim=-1)
        return (
            torch.log_softmax(answer.label / self.temperature, dim=-1),
            torch.log_softmax(scores / self.temperature, dim=-1),
            answer.side,
        )


def export(model: Labeller, temperature: float, about: Mapping[str, str], path: Path) -> None:
    """Writes the network. about: goes into the file's own metadata. Raises FormatError where it cannot be written."""
    half = path.with_name(path.name + ".part")
    calibrated = Calibrated(model, temperature).eval()
    example = (torch.randn(1, 20, 3) * 0.05, torch.zeros(1), torch.rand(1, 19, N_FEATURES))
    axes = {
        "points_m": {0: "b", 1: "n"}, "asked": {0: "b"}, "markers": {1: "m"},
        "log_label": {0: "b", 1: "n", 2: "names"}, "log_point": {0: "b", 1: "m", 2: "places"}, "side": {0: "b", 1: "n"},
    }  # fmt: skip
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            logging.getLogger("torch.onnx").setLevel(logging.ERROR)
            torch.onnx.export(
                calibrated, example, str(half), input_names=list(INPUTS), output_names=list(OUTPUTS),
                dynamic_axes=axes, opset_version=OPSET, dynamo=False,
            )  # fmt: skip
        content = onnx.load(str(half))
        _halve(content.graph)
        for key, value in {"format": FORMAT, "version": VERSION, **about}.items():
            entry = content.metadata_props.add()
            entry.key, entry.value = key, value
        onnx.checker.check_model(content)
        onnx.save(content, str(half))
        half.replace(path)
    except OSError as error:
        raise FormatError(
            f"Network {path} cannot be written ({error.strerror or error}).", "Choose another place with --out."
        ) from error
    finally:
        half.unlink(missing_ok=True)


def write_card(card: Mapping[str, Any], path: Path) -> None:
    """The card of a network as JSON beside it."""
    path.write_text(json.dumps(card, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def _halve(graph: onnx.GraphProto) -> None:
    """Large weights in half precision, widened again when the network is loaded: half the file, the same speed."""
    widened = []
    for tensor in list(graph.initializer):
        values = numpy_helper.to_array(tensor)
        if values.dtype != np.float32 or values.size < _HALVED:
            continue
        name = tensor.name
        graph.initializer.remove(tensor)
        graph.initializer.append(numpy_helper.from_array(values.astype(np.float16), f"{name}_half"))
        widened.append(onnx.helper.make_node("Cast", [f"{name}_half"], [name], to=onnx.TensorProto.FLOAT))
    for node in reversed(widened):
        graph.node.insert(0, node)
