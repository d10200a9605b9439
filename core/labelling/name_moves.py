"""Names that one hand's points may have been given in place of others, and how well the hand fits with either.

Asked over several frames at once: in one frame a hand bends to meet two names that were exchanged; in many it cannot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from core.frames import NO_POINT, BoolArray, FloatArray, IntArray
from core.hand.skeleton import DIGITS
from core.kinematics.solver import HandPose, HandSolver, solve_hands
from core.labelling.search import LEAST_POINTS, TemplateSearch
from core.markers.layout import MarkerLayout
from core.profile import Profile

N_AT_ONCE = 16
"""Fits in one compiled call."""

ITERATIONS = 12

Move = tuple[IntArray, IntArray]
"""Two sets of markers, each of which may bear the other's names."""


def moves_of(layout: MarkerLayout) -> list[Move]:
    """Each two markers; and the outer ends and the whole of each two digits."""
    moves = [(np.array([a]), np.array([b])) for a, b in combinations(range(len(layout.marker_names)), 2)]
    digits = [np.flatnonzero((layout.joints > 0) & ((layout.joints - 1) // 3 == g)) for g in range(len(DIGITS))]
    ordered = [own[np.argsort(layout.positions_m[own, 2])] for own in digits]  # from the tip to the palm
    for one, other in combinations(ordered, 2):
        moves += [(one[:n], other[:n]) for n in range(2, min(len(one), len(other)) + 1)]
    return moves


@dataclass(frozen=True)
class Shot:
    """The points of one frame by their names: points_m (m, 3) float64 [m], NaN for none, of a right hand."""

    points_m: FloatArray

    @cached_property
    def given(self) -> BoolArray:
        """(m,) bool."""
        return ~np.isnan(self.points_m[:, 0])

    def renamed(self, named: IntArray) -> Shot:
        """The same with other names: marker k has the point that was called named[k]."""
        return Shot(self.points_m[named])

    @property
    def mirrored(self) -> Shot:
        """The points as those of a left hand."""
        return Shot(self.points_m * (-1.0, 1.0, 1.0))


class NameFits:
    """Fits one performer's hand to named points. No posture is thought more usual than others: wrong names would be
    bent towards it."""

    def __init__(self, profile: Profile) -> None:
        self.scale = profile.scale
        self.search = TemplateSearch.of(profile)
        self.solver = HandSolver(profile.hand.skeleton, profile.worn)
        self.moves = moves_of(profile.worn)

    def poses(self, shots: Sequence[Shot]) -> list[HandPose]:
        """Of each, from nothing but its names. Each has LEAST_POINTS names."""
        found = []
        for shot in shots:
            point = np.where(shot.given, np.arange(len(shot.given)), NO_POINT)
            pose = self.search.pose_of_names(np.nan_to_num(shot.points_m), point, self.scale)
            assert pose is not None
            found.append(pose)
        return found

    def costs_m2(self, shots: Sequence[Shot]) -> FloatArray:
        """(k,) float64 [m^2]: sums of squared distances from the points of each to their markers."""
        return np.array([cost_m2(shot, pose) for shot, pose in zip(shots, self.poses(shots), strict=True)])

    def from_poses(self, shots: Sequence[Shot], starts: Sequence[HandPose]) -> list[HandPose]:
        """Of each, from a pose near by."""
        poses = [start.copy() for start in starts]
        for k in range(0, len(poses), N_AT_ONCE):
            some, theirs = poses[k : k + N_AT_ONCE], shots[k : k + N_AT_ONCE]
            spare = N_AT_ONCE - len(some)  # one size for all calls, for which buffers are kept
            targets = [np.nan_to_num(shot.points_m) for shot in theirs]
            weights = [shot.given.astype(np.float64) for shot in theirs]
            solve_hands(
                [self.solver] * N_AT_ONCE,
                some + [starts[0].copy() for _ in range(spare)],
                targets + [targets[0]] * spare,
                weights + [np.zeros_like(weights[0])] * spare,
                free_scale=self.scale is None,
                iterations=ITERATIONS,
            )
        return poses

    def best_move(self, shots: Sequence[Shot], poses: Sequence[HandPose]) -> IntArray:
        """The move that lets the hand fit best over all shots, as the names (m,) that `renamed` takes; those that there
        are where none can be made. poses: as the shots have them before it. Moves without points of both sets in each
        shot are left out."""
        m = len(shots[0].given)
        tried = []
        for one, other in self.moves:
            named = np.arange(m)
            named[one], named[other] = other, one
            if all(shot.given[one].any() and shot.given[other].any() for shot in shots):
                tried.append(named)
        flat = [(shot.renamed(named), pose) for named in tried for shot, pose in zip(shots, poses, strict=True)]
        if not flat:
            return np.arange(m)
        solved = self.from_poses([shot for shot, _ in flat], [pose for _, pose in flat])
        costs = np.array([cost_m2(shot, pose) for (shot, _), pose in zip(flat, solved, strict=True)])
        return tried[int(np.argmin(costs.reshape(-1, len(shots)).sum(axis=1)))]


def cost_m2(shot: Shot, pose: HandPose) -> float:
    """Sum of the squared distances of its points from their markers."""
    return float(np.square(pose.markers_world_m - shot.points_m)[shot.given].sum())


def enough(shot: Shot) -> bool:
    """Whether a hand can be fitted to it."""
    return int(shot.given.sum()) >= LEAST_POINTS
