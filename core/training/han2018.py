"""The network of Han 2018 as published, to compare with: a depth image of the points in, the markers' places out.

Section 3.1 and Table 1: points are seen by an orthographic camera through their centre, zoomed to fit a 52 x 52 image
with a margin of 10 %, their depth between 0.1 and 1 as intensity; convolutions tell where each marker is in that view,
and bipartite matching (eq. 1) gives points their names (core.training.depth_image). Training looks along random
axes, use along the best of ten. Not as published: Adam in place of plain gradient descent, which needs many times the
clouds that a processor without graphics card gets through, and products in 16 bits, which make that two to three times
as many.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor, nn
from torch.nn import functional

from core.errors import PhalanxError
from core.frames import FloatArray, IntArray
from core.training.clouds import NONE, RIGHT, Clouds
from core.training.depth_image import SIZE, best_turn, images, matched, places_m, viewed
from core.training.export import write_card
from core.training.labeller import LICENCE, OWN_LICENCE, VALIDATION, Order, batches, data_of, poses_of
from core.training.loop import LARGEST_STEP, WEIGHT_DECAY, Progress, rate

BATCH, PEAK_RATE = 64, 1e-3


class HanNetwork(nn.Module):
    """Table 1. (b, 1, 52, 52) to (b, m, 3), places in the image: column and row -1..1, and depth."""

    def __init__(self, n_markers: int) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        for into, out, pooled in (
            (1, 64, False),
            (64, 64, True),
            (64, 128, False),
            (128, 128, False),
            (128, 128, True),
        ):
            layers += [nn.Conv2d(into, out, 3), nn.BatchNorm2d(out), nn.ReLU()]
            if pooled:
                layers.append(nn.MaxPool2d(2))
        self.convolutions = nn.Sequential(*layers)
        self.dense = nn.Sequential(nn.Linear(10368, 2048), nn.ReLU(), nn.Linear(2048, 3 * n_markers))

    def forward(self, images: Tensor) -> Tensor:
        """images: (b, 1, 52, 52)."""
        places: Tensor = self.dense(self.convolutions(images).flatten(1)).unflatten(1, (-1, 3))
        return places


def make_reference(
    order: Order, report: Callable[[Progress], None], stopped: Callable[[], bool] = lambda: False
) -> dict[str, Any]:
    """Trains it on the same clouds, right hands, one layout, and writes it with its card."""
    if order.layout is None:
        raise PhalanxError("The architecture of Han 2018 knows one layout.", "Name it with --layout, such as han19.")
    torch.set_num_threads(order.threads)
    torch.manual_seed(order.seed)
    random = np.random.default_rng([order.seed, 6])
    source = batches(order, poses_of(order), BATCH)
    torch.set_flush_denormal(True)
    model = HanNetwork(len(order.layout.joints)).to(memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(model.parameters(), lr=PEAK_RATE, weight_decay=WEIGHT_DECAY, fused=True)
    began = last = time.monotonic()
    samples = 0
    losses: list[float] = []
    checked = next(source)
    while True:
        share = min((time.monotonic() - began) / order.seconds, 1.0)
        over = share >= 1.0 or stopped()
        if time.monotonic() - last > max(order.seconds / 40.0, 1.0) or over:
            accuracy = named_right(model, checked, np.random.default_rng(order.seed))
            spent = time.monotonic() - began
            loss = float(np.mean(losses)) if losses else math.nan
            report(Progress(share, samples, samples / spent, loss, accuracy, max(order.seconds - spent, 0.0)))
            last, losses = time.monotonic(), []
            if over:
                break
        for group in optimiser.param_groups:
            group["lr"] = rate(share, PEAK_RATE)
        model.train()
        pictures, truth, told = _lesson(random, next(source), len(order.layout.joints))
        with torch.autocast("cpu", dtype=torch.bfloat16):
            places = model(pictures.contiguous(memory_format=torch.channels_last))
        loss_now = functional.mse_loss(places[told].float(), truth[told])
        optimiser.zero_grad(set_to_none=True)
        loss_now.backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), LARGEST_STEP)
        optimiser.step()
        losses.append(float(loss_now.detach()))
        samples += len(pictures)
    _export(model, order)
    card = {
        "architecture": "Han 2018, Table 1", "layouts": order.layout.name, "seed": str(order.seed),
        "data": data_of(order),
        "budget": {"clouds": samples, "seconds": round(time.monotonic() - began), "threads": order.threads},
        "validation": {"share of visible markers named right, on made clouds": round(accuracy, 5)},
        "licence": OWN_LICENCE if order.recordings else LICENCE,
    }  # fmt: skip
    write_card(card, order.out.with_suffix(".json"))
    return card


def named_right(model: HanNetwork, clouds: Clouds, random: np.random.Generator) -> float:
    """Share of the visible markers of single hands that get their own point."""
    model.eval()
    right = total = 0
    for row in range(min(len(clouds.layout), VALIDATION)):
        points, label = _one_hand(clouds, row)
        valid = np.ones((1, len(points)), dtype=np.bool_)
        seen, zoom, reach = viewed(points[None], valid, best_turn(random, points)[None])
        with torch.no_grad():
            places = model(torch.from_numpy(images(seen, valid))).double().numpy()
        point = matched(places_m(places, zoom, reach)[0], places_m(seen, zoom, reach)[0])
        shown = np.flatnonzero(label != NONE)
        right += int((point[label[shown]] == shown).sum())
        total += len(shown)
    return right / max(total, 1)


def _one_hand(clouds: Clouds, row: int) -> tuple[FloatArray, IntArray]:
    """Points and labels of one cloud as a right hand; a second hand's points are taken out."""
    sides = clouds.side[row]
    main = RIGHT if (sides == RIGHT).any() else 1 - RIGHT
    kept = clouds.valid[row] & ((sides == main) | (sides == NONE))
    points = clouds.points_m[row, kept].astype(np.float64)
    return points * ((1.0, 1.0, 1.0) if main == RIGHT else (-1.0, 1.0, 1.0)), clouds.label[row, kept]


def _lesson(random: np.random.Generator, clouds: Clouds, m: int) -> tuple[Tensor, Tensor, Tensor]:
    """Images (b, 1, 52, 52), true places (b, m, 3) and which are told (b, m): only markers that are seen have one."""
    b = len(clouds.valid)
    lefts = (clouds.side != RIGHT).all(axis=1)
    upright = clouds.mirrored(lefts)
    valid = upright.valid & ((upright.side == RIGHT) | (upright.side == NONE))
    seen, _, _ = viewed(upright.points_m.astype(np.float64), valid, Rotation.random(b, rng=random).as_matrix())
    truth, told = np.zeros((b, m, 3), dtype=np.float32), np.zeros((b, m), dtype=np.bool_)
    rows, columns = np.nonzero(valid & (upright.label != NONE))
    truth[rows, upright.label[rows, columns]] = seen[rows, columns]
    told[rows, upright.label[rows, columns]] = True
    return torch.from_numpy(images(seen, valid)), torch.from_numpy(truth), torch.from_numpy(told)


def _export(model: HanNetwork, order: Order) -> None:
    model.eval()
    torch.onnx.export(
        model, (torch.zeros(1, 1, SIZE, SIZE),), str(order.out), input_names=["image"], output_names=["places"],
        dynamic_axes={"image": {0: "b"}, "places": {0: "b"}}, opset_version=17, dynamo=False,
    )  # fmt: skip
