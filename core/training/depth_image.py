"""Points as the network of Han 2018 sees them: a depth image along some axis (section 3.1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from core.frames import NO_POINT, BoolArray, FloatArray, IntArray

SIZE, MARGIN = 52, 0.1
NEAREST, DEEPEST = 0.1, 1.0
AXES = 10


def viewed(points_m: FloatArray, valid: BoolArray, turns: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points (b, n, 3) as the camera with rows `turns` (b, 3, 3) sees them: column and row in -1..1, depth 0.1..1.

    Returns (b, n, 3), and what undoes it: the zoom (b, 1, 1) and how deep the points reach (b, 1, 1) [m].
    """
    own = np.einsum("bac,bnc->bna", turns, points_m)
    low = np.where(valid[..., None], own, np.inf).min(axis=1, keepdims=True)
    high = np.where(valid[..., None], own, -np.inf).max(axis=1, keepdims=True)
    middle, reach = 0.5 * (low + high), np.maximum(high - low, 1e-6)
    zoom = (1.0 - 2.0 * MARGIN) * 2.0 / reach[..., :2].max(axis=2, keepdims=True)
    flat = (own[..., :2] - middle[..., :2]) * zoom
    depth = NEAREST + (DEEPEST - NEAREST) * (own[..., 2:] - low[..., 2:]) / reach[..., 2:]
    return np.concatenate([flat, depth], axis=2), zoom, reach[..., 2:]


def places_m(seen: FloatArray, zoom: FloatArray, reach: FloatArray) -> FloatArray:
    """(b, n, 3) [m]: places in the view as lengths, so that depth counts as much as width when they are compared."""
    metres: FloatArray = np.concatenate([seen[..., :2] / zoom, seen[..., 2:] * reach / (DEEPEST - NEAREST)], axis=2)
    return metres


def images(seen: FloatArray, valid: BoolArray) -> NDArray[np.float32]:
    """(b, 1, 52, 52) float32: every point one pixel of its depth."""
    drawn = np.zeros((len(seen), 1, SIZE, SIZE), dtype=np.float32)
    pixel = np.clip(np.rint((seen[..., :2] + 1.0) * 0.5 * (SIZE - 1)), 0, SIZE - 1).astype(np.int64)
    rows, columns = np.nonzero(valid)
    at = pixel[rows, columns]
    drawn[rows, 0, at[:, 1], at[:, 0]] = seen[rows, columns, 2]
    return drawn


def best_turn(random: np.random.Generator, points_m: FloatArray) -> FloatArray:
    """(3, 3): of ten random axes the one along which points (n, 3) spread most in the image."""
    turns = Rotation.random(AXES, rng=random).as_matrix()
    flat = np.einsum("kac,nc->kna", turns, points_m - points_m.mean(axis=0))[..., :2]
    spread = np.linalg.eigvalsh(np.einsum("kna,knb->kab", flat, flat))
    chosen: FloatArray = turns[int(spread.sum(axis=1).argmax())]
    return chosen


def matched(places: FloatArray, points: FloatArray) -> IntArray:
    """(m,) index of each marker's point, NO_POINT where there are more markers than points: least sum of distances."""
    point = np.full(len(places), NO_POINT, dtype=np.int64)
    markers, chosen = linear_sum_assignment(np.linalg.norm(places[:, None] - points[None], axis=2))
    point[markers] = chosen
    return point
