"""Markers on the things that a synthetic performer handles, so that they can be tracked as props."""

from __future__ import annotations

from typing import cast

import numpy as np

from core.frames import FloatArray
from core.motion.pose_file import Prop as Thing
from core.props.prop import Prop, PropModel, Shape

N_MARKERS = 5
STEM_M = 0.008
NEAREST_M = 0.025
"""Markers of a small thing stand on longer stems, no nearer to its middle than this."""

_CANDIDATES = 200


def marked(name: str, thing: Thing, seed: int = 0) -> Prop:
    """A thing with five markers on stems, spread so that no two are near and no two distances are equal."""
    random = np.random.default_rng(seed)
    shape = "cylinder" if thing.shape == "disk" else thing.shape
    sets = [_on_stems(thing, random.normal(size=(N_MARKERS, 3))) for _ in range(_CANDIDATES)]
    best = max(sets, key=_told_apart)
    return Prop(name, np.round(best, 6), PropModel(cast(Shape, shape), thing.size_m))


def _on_stems(thing: Thing, directions: FloatArray) -> FloatArray:
    """(m, 3) [m]: where rays from the middle leave the thing, and a stem further."""
    rays = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    half = 0.5 * np.asarray(thing.size_m)
    with np.errstate(divide="ignore"):
        match thing.shape:
            case "sphere":
                reach = np.full(len(rays), half[0])
            case "box":
                reach = (half / np.abs(rays)).min(axis=1)
            case _:
                reach = np.minimum(half[0] / np.hypot(rays[:, 0], rays[:, 1]), half[1] / np.abs(rays[:, 2]))
    placed: FloatArray = rays * np.maximum(reach + STEM_M, NEAREST_M)[:, None]
    return placed


def _told_apart(markers_m: FloatArray) -> float:
    """The smallest difference of two distances [m], and no more than a third of the smallest distance."""
    rows, columns = np.triu_indices(len(markers_m), 1)
    distances = np.sort(np.linalg.norm(markers_m[rows] - markers_m[columns], axis=1))
    return float(min(np.diff(distances).min(), distances[0] / 3.0))
