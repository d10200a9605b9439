"""From a seed and some minutes to a labelling network in a file, with its card."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from core.errors import FormatError
from core.markers.layout import MarkerLayout, load_layout
from core.training.calibration import fitted_temperature
from core.training.clouds import Clouds, made
from core.training.export import export, write_card
from core.training.labelled import LabelledFrames, labelled_supply
from core.training.layouts import TAUGHT
from core.training.loop import AGAIN_RATE, PEAK_RATE, Progress, train
from core.training.network import Labeller
from core.training.poses import Pool, pool
from core.training.restored import restored
from core.training.supply import BATCH, supply
from core.untrusted.json_text import read_json

VALIDATION = 1024
"""Clouds that are never trained on."""
OWN_SHARE = 0.5
"""Share of the batches that come from a user's own recordings, where there are some."""
_VALIDATION_SEED = 4
_REPORTS = 40
SHORT_S = 60.0
LICENCE = "As Phalanx: BSD-3-Clause. Trained on synthetic hands alone."
OWN_LICENCE = "As the recordings it was trained on allow."


@dataclass(frozen=True)
class Order:
    """What to train. layout: the only one the network must know; None: all shipped ones and any other.

    recordings: a user's own, worn in `layout`. threads: of this machine to use. start: an earlier network to go on
    from.
    """

    seconds: float
    seed: int
    out: Path
    layout: MarkerLayout | None = None
    recordings: tuple[LabelledFrames, ...] = ()
    threads: int = 1
    start: Path | None = None


def make(
    order: Order, report: Callable[[Progress], None], stopped: Callable[[], bool] = lambda: False
) -> dict[str, Any]:
    """Trains, calibrates and writes the best network and its card. Returns the card. Raises FormatError."""
    torch.set_num_threads(order.threads)
    torch.set_flush_denormal(True)
    torch.manual_seed(order.seed)
    began = time.monotonic()
    poses = poses_of(order)
    checked = made(
        np.random.default_rng([order.seed, _VALIDATION_SEED]), poses, [order.layout or load_layout("han19")],
        VALIDATION, False,
    )  # fmt: skip
    model = Labeller() if order.start is None else restored(order.start)
    best: dict[str, Any] = {}

    def keep(better: Labeller) -> None:
        best["temperature"] = fitted_temperature(better, checked)
        export(better, best["temperature"], _about(order), order.out)

    last = train(
        model, batches(order, poses), checked, order.seconds, order.seed, report, keep, stopped,
        report_every_s=max(order.seconds / _REPORTS, 1.0), peak_rate=AGAIN_RATE if order.start else PEAK_RATE,
    )  # fmt: skip
    card = {
        **_about(order),
        **_before(order),
        "data": data_of(order),
        "budget": {
            "clouds": last.samples,
            "seconds": round(time.monotonic() - began),
            "threads": order.threads,
            "torch": torch.__version__,
        },
        "parameters": sum(p.numel() for p in model.parameters()),
        "temperature": round(best["temperature"], 4),
        "validation": {
            "share of points named right, before assignment, on made clouds": round(last.accuracy, 5),
            "clouds": VALIDATION,
        },
        "licence": OWN_LICENCE if order.recordings else LICENCE,
    }
    write_card(card, order.out.with_suffix(".json"))
    return card


def poses_of(order: Order) -> Pool:
    """The postures of a training: few for a short one, which is only to see that it works."""
    random = np.random.default_rng(order.seed)
    return pool(random, 2_000, 1) if order.seconds < SHORT_S else pool(random)


def batches(order: Order, poses: Pool, size: int = BATCH) -> Iterator[Clouds]:
    """What there is to learn from: made clouds, and a user's own where there are some."""
    ours = supply(order.seed, poses, order.layout, size)
    if not order.recordings or order.layout is None:
        return ours
    theirs = labelled_supply(order.seed, order.recordings, order.layout, size)
    return _mixed(np.random.default_rng([order.seed, 5]), ours, theirs)


def _mixed(random: np.random.Generator, ours: Iterator[Clouds], theirs: Iterator[Clouds]) -> Iterator[Clouds]:
    while True:
        yield next(theirs) if random.random() < OWN_SHARE else next(ours)


def _about(order: Order) -> dict[str, str]:
    return {
        "architecture": "points and markers as sets, attention over distances, volumes for left and right",
        "layouts": order.layout.name if order.layout else ", ".join(TAUGHT) + ", varied and made up",
        "seed": str(order.seed),
    }


def _before(order: Order) -> dict[str, Any]:
    """What its card says of the network that was gone on from: its time and clouds count too."""
    if order.start is None:
        return {}
    try:
        earlier = read_json(order.start.with_suffix(".json"), "The card of the network", "")
        return {"started from": {key: earlier[key] for key in ("seed", "budget", "started from") if key in earlier}}
    except (FormatError, TypeError):
        return {"started from": "a network without a card"}


def data_of(order: Order) -> str:
    """For a card: what was learnt from."""
    made_up = (
        "synthetic: the hand of Phalanx in shapes of the human range, postures of its library and its performer, "
        "markers hidden by view of 4 to 16 cameras and at random, reflections, a second hand, things held"
    )
    names: Sequence[str] = [recording.name for recording in order.recordings]
    return made_up + (f"; and recordings: {', '.join(names)}" if names else "")
