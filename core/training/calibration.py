"""Confidence that means what it says: one temperature over all logits (Guo et al. 2017), from clouds not trained on."""

from __future__ import annotations

import numpy as np
import torch
from torch.nn import functional

from core.training.clouds import RIGHT, Clouds
from core.training.loop import answered, columns, question
from core.training.network import Labeller

TEMPERATURES = np.geomspace(0.5, 3.0, 41)


def fitted_temperature(model: Labeller, clouds: Clouds) -> float:
    """The one of TEMPERATURES at which the truth about clouds of single hands is likeliest."""
    posed = question(clouds, np.where((clouds.side == RIGHT).any(axis=1), 1.0, -1.0))
    model.eval()
    with torch.no_grad():
        answer = answered(model, posed)
    told = posed.marked
    rows, row_truth = answer.label[posed.valid], posed.wanted[posed.valid]
    markers, marker_truth = columns(answer, posed.valid)[told], posed.where[told]

    def unlikely(temperature: float) -> float:
        by_row = functional.cross_entropy(rows / temperature, row_truth)
        return float(by_row + functional.cross_entropy(markers / temperature, marker_truth))

    return float(min(TEMPERATURES, key=unlikely))
