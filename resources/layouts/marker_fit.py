"""Where the markers of a layout really sit, found from labelled motion.

Poses, hand size and marker positions are found in turn (the data and prior terms of Han 2018, 4.5): each round
solves the pose of every chosen frame, then moves every marker to the mean of where it was seen in the frame of
its bone, held back by a prior on where it was said to be. Simpler than core.calibration, and bound to no person:
bones stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from core.frames import NO_POINT, FloatArray
from core.hand.skeleton import Skeleton
from core.kinematics.solver import HandPose, HandSolver
from core.labelling.search import TemplateSearch
from core.markers.layout import MarkerLayout

ASTRAY_M = 0.006
"""A fit worse than this from the pose before is tried again from every typical pose."""


@dataclass(frozen=True)
class MarkerFit:
    """Markers found from motion. scale: of the hand. rms_before_m, rms_after_m over all frames; rms_m (m,) each [m]."""

    layout: MarkerLayout
    scale: float
    rms_before_m: float
    rms_after_m: float
    rms_m: FloatArray


def fit_markers(
    skeleton: Skeleton,
    layout: MarkerLayout,
    points_m: FloatArray,
    *,
    start: HandPose,
    rounds: int = 10,
    prior_frames: float = 5.0,
    fit_scale: bool = True,
) -> MarkerFit:
    """Move the markers of a right hand to where motion shows them.

    points_m: (t, m, 3) float64 [m], labelled, NaN where unseen, frames in order of time.
    start: a pose near the first frame. prior_frames: the layout's own positions count as so many observations.
    """
    positions = layout.positions_m.copy()
    seen = ~np.isnan(points_m[..., 0])
    weights = seen.astype(np.float64)
    targets = np.nan_to_num(points_m)
    scale = start.scale
    rms_before = float("nan")
    rms = np.zeros(len(positions))
    for turn in range(rounds + 1):
        solver = HandSolver(skeleton, replace(layout, positions_m=positions))
        search = TemplateSearch(skeleton, solver.layout, solver)
        pose = start.copy()
        pose.scale = scale
        total = np.zeros_like(positions)
        squared = np.zeros(len(positions))
        log_scale = 0.0
        for t in range(len(points_m)):
            solver.solve(pose, targets[t], weights[t], free_scale=False, iterations=30)
            if pose.rms_m > ASTRAY_M:
                point = np.where(seen[t], np.arange(len(positions)), NO_POINT)
                pose = search.fit_labelled(targets[t], point, scale)
            joints = pose.joints_world[layout.joints]
            local = np.einsum("mba,mb->ma", joints[:, :3, :3], targets[t] - joints[:, :3, 3]) / scale
            total += weights[t, :, None] * (local + skeleton.joint_positions_m[layout.joints])
            squared += weights[t] * ((pose.markers_world_m - targets[t]) ** 2).sum(1)
            if fit_scale and t % 10 == 0:
                sized = pose.copy()
                solver.solve(sized, targets[t], weights[t], free_scale=True, iterations=20)
                log_scale += np.log(sized.scale) / len(range(0, len(points_m), 10))
        rms = np.sqrt(squared / np.maximum(weights.sum(0), 1.0))
        overall = float(np.sqrt(squared.sum() / weights.sum()))
        if turn == 0:
            rms_before = overall
        if turn < rounds:
            positions = (total + prior_frames * layout.positions_m) / (weights.sum(0)[:, None] + prior_frames)
            if fit_scale:
                scale = float(np.exp(log_scale))
    return MarkerFit(replace(layout, positions_m=positions), scale, rms_before, overall, rms)
