"""Which of the points that carry a name can be the markers they are named after, all on one hand.

A wrong point bends the digit it is on and moves the rest, so how far it lies off says little, and least on a digit
with few markers. What counts is how much better all others fit without it: the hand is solved without each point in
turn, without each two that lie near one another (exchanged, they pull each other's digits about), and without the ends
of each two neighbouring fingers. A point left out costs as much as one that lies as far off as no point of this hand
does; the set that costs least is the hand's (truncated least squares, as in Yang et al. 2021, TEASER). Points
are left out until that gains no more, and taken back in where that is cheaper after all.

Joints may bend further here than where hands are solved: a thumb that folds further than most is no wrong name.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from core.frames import BoolArray, FloatArray
from core.hand.skeleton import DOF_NAMES, N_DOFS, N_ROOT_DOFS
from core.kinematics.solver import HandPose, HandSolver, solve_hands
from core.labelling.search import finger_exchanges
from core.track import outlier_m

LEAST_POINTS = 4
"""A hand with fewer is none."""

MOST_WRONG = 1.0 / 3.0
"""Of the points of a hand: where more are wrong, what is left would fit any hand, also one of the other side."""

NEAR_M = 0.040
"""Points so near to each other may be exchanged without either standing out."""

WORTH_M = 0.001
"""A set is better if it is worth a point so far off: less is what solving leaves open."""

EASED_RAD = np.radians(30.0)
"""How much further than its limits a joint may bend before a name is doubted."""

N_AT_ONCE = 8
"""Sets of points that are solved in one call."""

ITERATIONS = 12


@dataclass(frozen=True)
class Fit:
    """A pose, and the markers (m,) bool whose points it is of."""

    pose: HandPose
    kept: BoolArray

    @property
    def misfit_m2(self) -> float:
        """Sum of the squared distances of these points from their markers."""
        return float(np.count_nonzero(self.kept) * self.pose.rms_m**2)

    @property
    def usual_m(self) -> float:
        """How well such a hand fits [m], by this fit alone: over the coordinates that it has not used up."""
        spare = max(3 * int(np.count_nonzero(self.kept)) - N_DOFS - 1, 1)
        return float(np.sqrt(3.0 * self.misfit_m2 / spare))


@dataclass(frozen=True)
class Asked:
    """What is asked about the points of one frame.

    points_m: (m, 3) float64 [m], of each marker. given: (m,) bool, the markers that have one. usual_m: how well the
    hand usually fits [m], None where that is not known and is taken from the points that are kept. share: (m,) float64,
    what leaving out each costs, 1 where nothing is known against it. start: from where the hand is solved; None: from
    the best pose so far. free_scale: its size is not known.
    """

    points_m: FloatArray
    given: BoolArray
    share: FloatArray
    usual_m: float | None = None
    start: HandPose | None = None
    free_scale: bool = False

    def cost_m2(self, fit: Fit) -> float:
        """What the points cost that are kept, and those that are not."""
        usual_m = fit.usual_m if self.usual_m is None else self.usual_m
        return fit.misfit_m2 + outlier_m(usual_m) ** 2 * self._count_out(fit.kept)

    def least_cost_m2(self, kept: BoolArray) -> float:
        """What a set costs though it fit to perfection."""
        return float(outlier_m(self.usual_m or 0.0) ** 2 * self._count_out(kept))

    def beyond_doubt(self, whole: Fit) -> bool:
        """Would leaving out any point of the whole cost more than it could gain?"""
        return whole.misfit_m2 <= float(self.share[self.given].min()) * outlier_m(self.usual_m or 0.0) ** 2

    def _count_out(self, kept: BoolArray) -> float:
        return float(self.share[self.given & ~kept].sum())


class Consensus:
    """Finds the points that fit together, for one solver."""

    def __init__(self, solver: HandSolver) -> None:
        skeleton, layout = solver.skeleton, solver.layout
        ease = np.full(len(skeleton.limits_rad), EASED_RAD)
        ease[[name.endswith("_mcp_abduction") for name in DOF_NAMES[N_ROOT_DOFS:]]] = 0.0  # or fingers cross
        eased = replace(skeleton, limits_rad=skeleton.limits_rad + ease[:, None] * np.array([-1.0, 1.0]))
        self._solver = HandSolver(eased, layout, solver.prior)
        self._ends = [np.concatenate(pair) for pair in finger_exchanges(layout)]

    def best(self, whole: Fit, asked: Asked, others: Sequence[BoolArray] = ()) -> Fit:
        """The points that cost least, and their pose; `whole`, the fit of all that are given, where nothing is left
        out. others: sets of markers (m,) bool that may be a better beginning."""
        if asked.beyond_doubt(whole):
            return whole
        fit = self._search(asked, whole, others)
        return whole if np.array_equal(fit.kept, whole.kept) else fit

    def _search(self, asked: Asked, whole: Fit, others: Sequence[BoolArray]) -> Fit:
        given = asked.given
        least = max(LEAST_POINTS, math.ceil((1.0 - MOST_WRONG) * np.count_nonzero(given)))
        (best,) = self._solved([given], asked, whole.pose)
        cost = asked.cost_m2(best)
        tried = {given.tobytes()}
        sets = [given & some for some in others] + self._changed(asked, given)
        while True:
            cheap = [some for some in sets if some.sum() >= least and asked.least_cost_m2(some) < cost]
            new = {some.tobytes(): some for some in cheap if some.tobytes() not in tried}
            tried |= new.keys()
            found = self._solved(list(new.values()), asked, best.pose)
            costs = [asked.cost_m2(fit) for fit in found]
            if not costs or min(costs) > cost - WORTH_M**2:
                return best
            k = int(np.argmin(costs))
            best, cost = found[k], costs[k]
            sets = self._changed(asked, best.kept)

    def _changed(self, asked: Asked, kept: BoolArray) -> list[BoolArray]:
        """The sets that are one step away."""
        points_m, rows = asked.points_m, np.flatnonzero(kept)
        near = [
            np.array(pair)
            for pair in combinations(rows, 2)
            if np.linalg.norm(np.subtract(*points_m[list(pair)])) < NEAR_M
        ]
        sets = []
        for out in [*rows[:, None], *near, *self._ends]:
            some = kept.copy()
            some[out] = False
            sets.append(some)
        for back in np.flatnonzero(asked.given & ~kept):
            some = kept.copy()
            some[back] = True
            sets.append(some)
        return sets

    def _solved(self, sets: Sequence[BoolArray], asked: Asked, near: HandPose) -> list[Fit]:
        """The hand as each of the sets has it."""
        start = asked.start or near
        poses = [start.copy() for _ in sets]
        for k in range(0, len(sets), N_AT_ONCE):
            some, weights = poses[k : k + N_AT_ONCE], [each.astype(np.float64) for each in sets[k : k + N_AT_ONCE]]
            spare = N_AT_ONCE - len(some)  # one size for all calls, for which buffers are kept
            some += [start.copy() for _ in range(spare)]
            weights += [np.zeros(len(asked.given))] * spare
            solve_hands(
                [self._solver] * N_AT_ONCE, some, [asked.points_m] * N_AT_ONCE, weights,
                free_scale=asked.free_scale, iterations=ITERATIONS,
            )  # fmt: skip
        return [Fit(pose, kept) for pose, kept in zip(poses, sets, strict=True)]
