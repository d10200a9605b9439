"""Training of the labelling network: clouds without end, a time to spend, the best weights so far."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from core.frames import FloatArray
from core.labelling.marker_features import N_FEATURES, UNIT_M, marker_features
from core.training.clouds import LEFT, NONE, RIGHT, Clouds
from core.training.network import Answer, Labeller

PEAK_RATE, AGAIN_RATE = 1.5e-3, 1e-3
"""Highest learning rate, of a network that knows nothing yet and of one that is trained on."""
WARM_UP, END_RATE = 0.03, 0.01
WEIGHT_DECAY = 1e-3
LARGEST_STEP = 1.0
ANY_SIDE, WRONG_SIDE = 0.45, 0.10
"""Shares of the questions that leave the side open, and that ask for a hand that is not there."""
COLUMN_WEIGHT, SIDE_WEIGHT, EARLY_WEIGHT = 0.5, 0.3, 0.3


@dataclass(frozen=True)
class Question:
    """Clouds as tensors, and what is asked and true of them.

    markers: (b, m, 12), what is known of each performer's markers. marked: (b, m), which there are. wanted: (b, n),
    index of the marker, m for none. where: (b, m), index of a marker's point, n where it is hidden.
    single: (b,), False where two hands are asked for at once and a marker has no one point.
    """

    points_m: Tensor
    valid: Tensor
    asked: Tensor
    markers: Tensor
    marked: Tensor
    wanted: Tensor
    where: Tensor
    single: Tensor
    side: Tensor


@dataclass(frozen=True)
class Progress:
    """loss: mean since the last report. accuracy: share of the markers of validation clouds that are named right."""

    share: float
    samples: int
    samples_per_s: float
    loss: float
    accuracy: float
    left_s: float


def markers_of(clouds: Clouds) -> tuple[Tensor, Tensor]:
    """(b, m, 12), features of the markers of every cloud, padded, and (b, m), which there are."""
    most = clouds.told_m.shape[1]
    features = np.zeros((len(clouds.layouts), most, N_FEATURES), dtype=np.float32)
    marked = np.zeros((len(clouds.layouts), most), dtype=np.bool_)
    for row, layout in enumerate(clouds.layouts):
        m = len(layout.joints)
        features[row, :m], marked[row, :m] = marker_features(layout), True
    features, marked = features[clouds.layout], marked[clouds.layout]
    features[..., :3] = clouds.told_m / UNIT_M
    return torch.from_numpy(features), torch.from_numpy(marked)


def question(clouds: Clouds, asked: FloatArray) -> Question:
    """asked: (b,), 1 the right hand, -1 the left, 0 whatever is there."""
    markers, marked = markers_of(clouds)
    b, n = clouds.valid.shape
    m = markers.shape[1]
    sign = np.where(clouds.side == NONE, 0, np.where(clouds.side == RIGHT, 1, -1))
    meant = (clouds.label != NONE) & ((asked[:, None] == 0.0) | (sign == asked[:, None]))
    wanted = np.where(meant, clouds.label, m)
    where = np.full((b, m + 1), n)
    rows, columns = np.nonzero(meant)
    where[rows, wanted[rows, columns]] = columns
    both = (sign == 1).any(axis=1) & (sign == -1).any(axis=1)
    return Question(
        torch.from_numpy(clouds.points_m), torch.from_numpy(clouds.valid),
        torch.from_numpy(asked.astype(np.float32)), markers, marked,
        torch.from_numpy(wanted), torch.from_numpy(where[:, :m]),
        torch.from_numpy(~both | (asked != 0.0)), torch.from_numpy(sign),
    )  # fmt: skip


def asked_of(random: np.random.Generator, clouds: Clouds) -> FloatArray:
    """(b,): what training asks of each cloud."""
    b = len(clouds.layout)
    lefts, rights = (clouds.side == LEFT).any(axis=1), (clouds.side == RIGHT).any(axis=1)
    there = np.where(lefts & rights, random.choice([-1.0, 1.0], b), np.where(rights, 1.0, -1.0))
    chance = random.random(b)
    wrong = (chance > 1.0 - WRONG_SIDE) & ~(lefts & rights)
    return np.where(chance < ANY_SIDE, 0.0, np.where(wrong, -there, there))


def answered(model: Labeller, asked: Question) -> Answer:
    """What the network says."""
    answer: Answer = model(asked.points_m, asked.asked, asked.markers, asked.valid, asked.marked)
    return answer


def columns(answer: Answer, valid: Tensor) -> Tensor:
    """(b, m, n + 1) logits: which point a marker is, the last for "hidden"."""
    scores = answer.label[..., :-1].transpose(1, 2)
    scores = scores + torch.where(valid, 0.0, -1e4)[:, None]
    return torch.cat([scores, answer.hidden[..., None]], dim=-1)


def loss_of(answer: Answer, asked: Question) -> Tensor:
    """Cross-entropy over each point's names, over each marker's points, and of the sides of points."""
    wanted = asked.wanted[asked.valid]
    rows = functional.cross_entropy(answer.label[asked.valid], wanted)
    for label in answer.early:
        rows = rows + EARLY_WEIGHT * functional.cross_entropy(label[asked.valid], wanted)
    told = asked.marked & asked.single[:, None]
    by_column = functional.cross_entropy(columns(answer, asked.valid)[told], asked.where[told])
    sided = (asked.side != 0) & (asked.asked == 0.0)[:, None]
    loss = rows + COLUMN_WEIGHT * by_column
    if bool(sided.any()):
        by_side = functional.binary_cross_entropy_with_logits(answer.side[sided], (asked.side[sided] > 0).float())
        loss = loss + SIDE_WEIGHT * by_side
    return loss


def rate(share: float, peak: float = PEAK_RATE) -> float:
    """Learning rate over the time spent: up, then down on a cosine."""
    if share < WARM_UP:
        return peak * max(share / WARM_UP, 0.01)
    along = min((share - WARM_UP) / (1.0 - WARM_UP), 1.0)
    return peak * (END_RATE + (1.0 - END_RATE) * 0.5 * (1.0 + math.cos(math.pi * along)))


def named_right(model: Labeller, clouds: Clouds, side: str = "known") -> float:
    """Share of the points that have their right name or are rightly none, before any assignment."""
    asked = np.zeros(len(clouds.layout))
    if side == "known":
        asked = np.where((clouds.side == RIGHT).any(axis=1), 1.0, -1.0)
    posed = question(clouds, asked)
    with torch.no_grad():
        answer = answered(model, posed)
    right = (answer.label.argmax(-1) == posed.wanted)[posed.valid]
    return float(right.float().mean())


def train(
    model: Labeller,
    batches: Iterator[Clouds],
    validation: Clouds,
    seconds: float,
    seed: int,
    report: Callable[[Progress], None],
    keep: Callable[[Labeller], None],
    stopped: Callable[[], bool] = lambda: False,
    report_every_s: float = 20.0,
    peak_rate: float = PEAK_RATE,
) -> Progress:
    """Trains for so many seconds, or until `stopped`; `keep` is called with every better model.

    Returns the last progress, its accuracy that of the best model.
    """
    random = np.random.default_rng([seed, 1])
    optimiser = torch.optim.AdamW(
        model.parameters(), lr=PEAK_RATE, weight_decay=WEIGHT_DECAY, betas=(0.9, 0.98), fused=True
    )
    began = last = time.monotonic()
    samples, before, best = 0, 0, -1.0
    losses: list[float] = []
    while True:
        now = time.monotonic()
        share = min((now - began) / seconds, 1.0)
        over = share >= 1.0 or stopped()
        if now - last > report_every_s or over:
            model.eval()
            accuracy = named_right(model, validation)
            if accuracy >= best:
                best = accuracy
                keep(model)
            mean = float(np.mean(losses)) if losses else math.nan
            speed = (samples - before) / max(now - last, 1e-9)
            progress = Progress(share, samples, speed, mean, accuracy, max(seconds - (now - began), 0.0))
            report(progress)
            if over:
                return replace(progress, accuracy=best)
            last, before, losses = time.monotonic(), samples, []
        for group in optimiser.param_groups:
            group["lr"] = rate(share, peak_rate)
        model.train()
        clouds = next(batches)
        posed = question(clouds, asked_of(random, clouds))
        loss = loss_of(answered(model, posed), posed)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), LARGEST_STEP)
        optimiser.step()
        losses.append(float(loss.detach()))
        samples += len(clouds.layout)
