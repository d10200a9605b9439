"""Calibration from motion of made performers, whose hands and markers are known.

Each is of the human range in size, a child's hand to a very large one's (app.people), and otherwise of the population
(core.hand.anthropometry), wearing a layout as well as one puts it on: every marker
4 mm per axis off along the skin and 1 mm in height. The performance goes through the named poses for 30 s in 400
frames, with 0.3 mm of white noise per axis; in 5 % of the frames two labels of the hand are swapped.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from app.people import add_sizes, said, size_of
from core.calibration.hand import calibrate_hand
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

LAYOUTS = ("han19", "schroeder17", "qualisys13")
PERFORMERS = 4
NOISE_M = 0.0003
ALONG_M, NORMAL_M = 0.004, 0.001
POSE_S = 0.7
FRAMES = 400


@dataclass(frozen=True)
class Made:
    """truth: who performed. given: what is known before. frames carry ids, labels say what each claims to be."""

    truth: Profile
    given: Profile
    frames: list[MarkerFrame]
    labels: dict[int, tuple[Side, int]]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this experiment."""
    add_sizes(parser)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Prints one line per layout and performer."""
    seeds = range(arguments.seed + 1, arguments.seed + 1 + PERFORMERS)
    print(f"  Performers: {said(arguments, seeds)}.")
    print("  layout       seed   bones [mm]      markers [mm]    RMS of other frames [mm]   errors over what is said")
    print("                      mean    most    mean    most       before    after          of the 23 measures")
    figures: dict[str, Any] = {}
    for layout in LAYOUTS:
        for seed in seeds:
            scene = made(seed, layout, arguments.frames or FRAMES, size=size_of(arguments, seed))
            one = figures[f"{layout}, {seed}"] = _calibrated(scene)
            bones, markers, rms = one["bones_mm"], one["markers_mm"], one["rms_mm"]
            print(
                f"  {layout:12} {seed:4} {bones['mean']:7.2f} {bones['max']:7.2f} {markers['mean']:7.2f} "
                f"{markers['max']:7.2f} {rms['before']:12.2f} {rms['after']:8.2f} {one['score']:18.2f}"
            )
    return figures


def _calibrated(scene: Made) -> dict[str, Any]:
    found = calibrate_hand(scene.frames, scene.given, labels=scene.labels)
    profile, truth = found.profile, scene.truth
    bones = 1e3 * np.abs(profile.hand.skeleton.bone_lengths_m - truth.hand.skeleton.bone_lengths_m)[1:]
    markers = 1e3 * np.linalg.norm(profile.worn.positions_m - truth.worn.positions_m, axis=1)
    errors = np.log([measure.ratio for measure in found.measures]) - np.log(truth.shape.ratios)
    scores = errors / [measure.std for measure in found.measures]
    return {
        "bones_mm": {"mean": bones.mean(), "max": bones.max()},
        "markers_mm": {"mean": markers.mean(), "max": markers.max()},
        "rms_mm": {
            "before": 1e3 * found.held_out.before.overall_m,
            "after": 1e3 * found.held_out.after.overall_m,
        },
        "noise_mm": 1e3 * found.noise_m,
        "score": float(np.sqrt((scores**2).mean())),
    }


@cache
def made(
    seed: int, layout_name: str = "han19", count: int = FRAMES, seconds: float = 30.0, swapped: float = 0.05,
    sides: tuple[Side, ...] = ("right",), still_thumb: bool = False,
    size: float | None = None,
) -> Made:  # fmt: skip
    """Somebody of the population wearing the layout as well as one puts it on; in a share of frames two labels of a
    hand are swapped. size: to the template's, in the mean of the 23 measures; None: drawn of adults."""
    random = np.random.default_rng(seed)
    prior, layout = shape_prior(ADULT_SIZE_STD), load_layout(layout_name)
    ratios: FloatArray = np.exp(random.multivariate_normal(prior.mean_log, prior.covariance_log))
    shape = HandShape(ratios if size is None else ratios * size / ratios.mean())
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
