"""Motions that no subspace of ours was made from: Han's users, solved with all their markers, and other performers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import FloatArray
from core.hand.model import template
from core.hand.skeleton import DIGIT_DOF_NAMES, N_ROOT_DOFS
from core.kinematics.solver import HandPose, HandSolver
from core.labelling.search import TemplateSearch
from core.markers.layout import load_layout
from core.motion.performer import PERIOD_S, Performer
from core.profile import Profile
from core.untrusted.npz import read_npz

HAN = "han2018"
USERS = (1, 2, 3, 4)
SOUND_RMS_M = 0.006
"""Frames that all 19 markers explain worse are no true poses: the noise in the data alone is 3.2 mm."""

LEAST_FRAMES = 60
SIZE_FRAMES = 60
GRASP_SHARE = 0.5

_FLEXIONS = [i for i, name in enumerate(DIGIT_DOF_NAMES) if i >= 4 and name.endswith(("mcp_flexion", "pip_flexion"))]


def han_motions(
    data: Path, count: int, seed: int, most: int | None = None, kept: Callable[[FloatArray], bool] | None = None
) -> list[FloatArray]:
    """Poses (t, 26) of `count` right-hand sequences of each user, drawn at random among those of LEAST_FRAMES or more,
    and of these only motions that are `kept`; at most the first `most` frames of each. Raises FormatError."""
    random, motions = np.random.default_rng(seed), []
    for user in USERS:
        sequences = [points for points in _sequences(data, user) if len(points) >= LEAST_FRAMES]
        solve, left = _solver_of(sequences, random), count
        for i in random.permutation(len(sequences)):
            if not left:
                break
            motion = solve(sequences[i][:most])
            if len(motion) and (kept is None or kept(motion)):
                motions.append(motion)
                left -= 1
    return motions


def is_grasp(motion: FloatArray) -> bool:
    """Does a motion look like grasping? In half of its frames or more the four fingers are bent together, 25 to 75
    degrees at knuckle and middle joint on average, no two of them more than 25 degrees apart, and the thumb stands
    across the palm or out from it by 10 degrees or more."""
    angles = np.degrees(motion[:, N_ROOT_DOFS:])
    bend = angles[:, _FLEXIONS].reshape(len(angles), 4, 2).mean(axis=2)
    together = (bend.mean(axis=1) > 25.0) & (bend.mean(axis=1) < 75.0) & (np.ptp(bend, axis=1) < 25.0)
    return bool((together & (angles[:, :2].max(axis=1) > 10.0)).mean() >= GRASP_SHARE)


def performed(activity: str, seed: int, rate_hz: float = 10.0, seconds: float = PERIOD_S) -> FloatArray:
    """(t, 26) right hand of the built-in performer."""
    performer = Performer(Profile("", load_layout("han19"), ("right",)), seed, activity)
    return np.stack([performer.theta("right", i / rate_hz) for i in range(int(seconds * rate_hz))])


def _sequences(data: Path, user: int) -> list[FloatArray]:
    """Right-hand sequences (t, 19, 3) [m]. Raises FormatError."""
    path = data / HAN / f"han_user{user}.npz"
    mend = "Give the folder that holds han2018/."
    held = read_npz(path, ("hand", "points", "sequence", "marker_names"), str(path), mend)
    right = held["hand"] == 1
    points, sequence = held["points"][right].astype(np.float64), held["sequence"][right]
    names = tuple(str(name) for name in held["marker_names"])
    if names != load_layout("han19").marker_names:
        raise FormatError(f"{path} holds the markers {', '.join(names)}.", "Give files of 19 markers.")
    return [points[sequence == number] for number in np.unique(sequence)]


def _solver_of(sequences: list[FloatArray], random: np.random.Generator) -> Callable[[FloatArray], FloatArray]:
    """Solves points (t, 19, 3) of one user to poses, at the size that random frames of theirs have in the median."""
    skeleton, layout = template().skeleton, load_layout("han19")
    solver = HandSolver(skeleton, layout)
    search, named = TemplateSearch(skeleton, layout, solver), np.arange(len(layout.joints))
    every = np.concatenate(sequences)
    drawn = every[random.integers(len(every), size=SIZE_FRAMES)]
    size = float(np.median([search.fit_labelled(points, named, None).scale for points in drawn]))
    weights = np.ones(len(layout.joints))

    def solve(points_m: FloatArray) -> FloatArray:
        thetas, pose = [], HandPose.at_rest(len(layout.joints))
        pose.rms_m = np.inf
        for points in points_m:
            if pose.rms_m <= SOUND_RMS_M:
                solver.solve(pose, points, weights, iterations=30)
            if pose.rms_m > SOUND_RMS_M:
                pose = search.fit_labelled(points, named, size)
            if pose.rms_m <= SOUND_RMS_M:
                thetas.append(pose.theta_rad.copy())
        return np.asarray(thetas).reshape(-1, 26)

    return solve
