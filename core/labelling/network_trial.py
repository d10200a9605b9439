"""A network from a file is asked once before it is used: within bounds of memory, for answers that can be any."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import onnxruntime

from core.errors import FormatError, PhalanxError
from core.frames import FloatArray, Side
from core.markers.layout import load_layout

if TYPE_CHECKING:
    from core.labelling.network import LabelNetwork

MOST_MEMORY = 1 << 28
"""Bytes that a trial may take. The networks of Phalanx take a tenth of it for their largest clouds."""

_LAYOUT = "han19"
_SIZES = (1.0, 0.8, 1.2)
_AROUND_M = 0.15
_NEAR_ONE = 0.01
_MEND = "Give another file made by phalanx train labeller."


def bounded(options: onnxruntime.SessionOptions) -> None:
    """Lets a session allocate MOST_MEMORY at most, together with all others so bounded; and compute nothing before it
    is asked: what the runtime folds together when it loads a network is not bounded."""
    _allocator()
    options.add_session_config_entry("session.use_env_allocators", "1")
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
    options.log_severity_level = 4  # what goes wrong is said once, by us


def try_out(network: LabelNetwork, most_points: int, source: str) -> None:
    """Asks of a cloud as large as any, and of a hand alone. Raises FormatError where the answers are of other shapes
    than asked for, not finite, or no probabilities."""
    layout = load_layout(_LAYOUT)
    m = len(layout.joints)
    others = np.random.default_rng(0).uniform(-_AROUND_M, _AROUND_M, (most_points - m, 3))
    cloud, hand = np.concatenate([layout.positions_m, others]), layout.positions_m
    asked: tuple[tuple[FloatArray, Side | None], ...] = (cloud, None), (hand, "right"), (hand, "left")
    for points, side in asked:
        n = len(points)
        wanted = {"label": (n, m + 1), "point": (m, n + 1), "right": (n,)}
        try:
            answers = network.labels_at(_SIZES[: 1 if side is None else None], points, layout, side)
        except PhalanxError as error:
            raise FormatError(error.what, _MEND) from error
        except Exception as error:  # the runtime has no common base for what it raises
            raise FormatError(f"{source} cannot be run on the points of a hand.", _MEND) from error
        for labels in answers:
            given = {name: getattr(labels, name).shape for name in wanted}
            if given != wanted:
                raise FormatError(f"{source} answers with shapes {given} where {wanted} are asked for.", _MEND)
            if not (_are_one(labels.label) and _are_one(labels.point) and np.isfinite(labels.right).all()):
                raise FormatError(f"{source} answers with numbers that are no probabilities.", _MEND)


def _are_one(probabilities: FloatArray) -> bool:
    """Does every row sum to one?"""
    return bool((np.abs(probabilities.sum(axis=-1) - 1.0) < _NEAR_ONE).all())  # NaN is not


@cache
def _allocator() -> None:
    """Of the process, once."""
    kind = onnxruntime.OrtMemoryInfo(
        "Cpu", onnxruntime.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, onnxruntime.OrtMemType.DEFAULT
    )
    onnxruntime.create_and_register_allocator(kind, onnxruntime.OrtArenaCfg({"max_mem": MOST_MEMORY}))
