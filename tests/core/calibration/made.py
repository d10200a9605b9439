"""A performer whose hand and markers are known, and the recording of it that a studio would have."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from core.calibration.surface import surface_normals
from core.frames import FloatArray, MarkerFrame, Side, Times
from core.hand.anthropometry import ADULT_SIZE_STD, shape_prior
from core.hand.mirror import mirror_points
from core.hand.model import template
from core.hand.poses import POSE_NAMES, pose
from core.hand.shape import HandShape
from core.kinematics.forward import markers_world
from core.markers.layout import load_layout
from core.profile import Profile

NOISE_M = 0.0003
ALONG_M, NORMAL_M = 0.004, 0.001
POSE_S = 0.7


@dataclass(frozen=True)
class Made:
    """truth: who performed. given: what is known before. frames carry ids, labels say what each claims to be."""

    truth: Profile
    given: Profile
    frames: list[MarkerFrame]
    labels: dict[int, tuple[Side, int]]


@cache
def made(
    seed: int, layout_name: str = "han19", count: int = 400, seconds: float = 30.0, swapped: float = 0.05,
    sides: tuple[Side, ...] = ("right",), still_thumb: bool = False,
) -> Made:  # fmt: skip
    """An adult of the population wearing the layout as well as one puts it on; in a share of frames two labels of a
    hand are swapped."""
    random = np.random.default_rng(seed)
    prior, layout = shape_prior(ADULT_SIZE_STD), load_layout(layout_name)
    shape = HandShape(np.exp(random.multivariate_normal(prior.mean_log, prior.covariance_log)))
    m, normals = len(layout.joints), surface_normals(template(), layout.positions_m)
    along = random.normal(0.0, ALONG_M, (m, 3))
    along -= (along * normals).sum(1, keepdims=True) * normals
    worn = layout.positions_m + along + normals * random.normal(0.0, NORMAL_M, (m, 1))
    truth = Profile("Made", replace(layout, positions_m=worn), sides, 1.0, shape)
    labels = {k: (side, k % m) for i, side in enumerate(sides) for k in range(i * m, (i + 1) * m)}
    times_s = seconds / count * np.arange(count)
    # Two hands do different things.
    thetas = [_performance(random, times_s, still_thumb) for _ in sides]

    def points_m(i: int) -> FloatArray:
        hands = []
        for side, theta in zip(sides, thetas, strict=True):
            markers = markers_world(truth.hand.skeleton, theta[i], layout.joints, truth.worn.positions_m)
            hands.append(mirror_points(markers) - (0.5, 0.0, 0.0) if side == "left" else markers)
        return np.concatenate(hands)

    def frames() -> Iterator[MarkerFrame]:
        for i, time_s in enumerate(times_s.tolist()):
            points = points_m(i)
            ids = np.arange(len(points))
            if random.random() < swapped:
                pair = random.choice(m, 2, replace=False)
                ids[pair] = ids[pair[::-1]]
            points = points + random.normal(0.0, NOISE_M, points.shape)
            yield MarkerFrame(i, Times(time_s, time_s, time_s), points, ids, np.full(len(points), np.nan))

    return Made(truth, Profile("", layout, sides), list(frames()), labels)


def _performance(random: np.random.Generator, times_s: FloatArray, still_thumb: bool) -> FloatArray:
    """(n, 26) parameters of a right hand that goes smoothly from one named pose to another and turns as it goes."""
    count = int(np.ceil(times_s[-1] / POSE_S)) + 2
    names = [name for _ in range(count) for name in random.permutation(POSE_NAMES)][:count]
    postures = np.asarray([pose(name) for name in names])
    postures += random.normal(0.0, 0.08, postures.shape)
    if still_thumb:
        postures[:, :4] = pose("relaxed")[:4]
    roots = np.concatenate([random.normal(0.0, 0.1, (count, 3)), random.normal(0.0, 0.6, (count, 3))], axis=1)
    knots = np.concatenate([roots, np.clip(postures, *template().skeleton.limits_rad.T)], axis=1)
    before, share = np.divmod(times_s / POSE_S, 1.0)
    row, x = before.astype(np.int64), share[:, None]
    smooth = x**3 * (10.0 + x * (6.0 * x - 15.0))
    thetas: FloatArray = knots[row] + smooth * (knots[row + 1] - knots[row])
    return thetas
