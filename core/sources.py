"""Where each number of a pose comes from: measured by this frame's points, or not, and then what stands in for them.

A number is *measured* if the points of its frame alone, all other angles anywhere within their limits, tell it more
closely than what is believed without them could at best: the posture prior, were all other angles known, and where
markers are hidden the motion that is carried on. These are the two that the solver weighs against each other, in its
own weights, so that it is what decides the value; how far off it may then be is what its standard deviation says.

Everything follows from the frames as they are solved and kept, in their order, and the profile.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from core.cast import cast_of, hands_of
from core.frames import BoolArray, FloatArray, HandFrame, HandKey, HandState, IntArray, TrackedFrame
from core.gap_filling import right_pose
from core.guesses import POINT_NOISE_M, Guesses
from core.hand.skeleton import DOF_NAMES, N_DOFS, N_ROOT_DOFS
from core.kinematics.prior import LEAST_RESIDUAL_RAD, NO_PRIOR
from core.kinematics.solver import HandPose, HandSolver
from core.profile import Profile
from core.track import LEAST_STRAY_S, STRAY_RAD, tracking_solver

Codes = NDArray[np.int8]
"""Each an index into SOURCES, or UNKNOWN."""

SOURCES = ("measured", "prior", "filled", "limit")
"""measured: the points decide. prior: usual postures, or the motion before, decide. filled: a gap's curve. limit: the
joint stands at its limit, to which points or prior have pushed it. A filled angle at a limit is filled."""

MEASURED, PRIOR, FILLED, LIMIT = range(len(SOURCES))

UNKNOWN = -1
"""Of a hand that is not tracked."""

ROOT_BELIEVED = np.array([0.01] * 3 + [LEAST_RESIDUAL_RAD] * 3)
"""The wrist has no statistics. Its place [m] and rotation [rad] are measured if the points alone tell them so closely:
no angle is believed closer than that by postures, and it moves the tips of the fingers by about so much."""

AT_LIMIT_RAD = 1e-6
"""So near to its limit a joint stands at it."""


class Information:
    """What the points of a frame tell of a hand, and what is believed without any."""

    def __init__(self, solver: HandSolver) -> None:
        """solver: of the hand as it is tracked."""
        self._points = HandSolver(solver.skeleton, solver.layout, NO_PRIOR)
        self.believed = np.concatenate([ROOT_BELIEVED, POINT_NOISE_M / np.sqrt(np.diag(solver.prior.precision_m2))])
        """(26,) float64 [m, rad], standard deviation of each parameter by the posture prior, all others known."""

    def told(self, pose: HandPose, seen: BoolArray, noise_m: float = POINT_NOISE_M) -> FloatArray:
        """(26,) float64 [m, rad], standard deviation of each parameter of a right hand by the points of the markers
        `seen` (m,) alone, all others anywhere within the joint limits. noise_m: of a point's coordinate."""
        return self._points.uncertainty(pose, seen.astype(np.float64), noise_m)[0]

    def measured(self, pose: HandPose, seen: BoolArray) -> BoolArray:
        """(26,) bool, whether the points tell each parameter more closely than postures do."""
        return self.told(pose, seen) < self.believed


class HandSources:
    """Follows one hand."""

    def __init__(self, solver: HandSolver) -> None:
        self._information = Information(solver)
        self._guesses = Guesses(solver)
        low, high = solver.skeleton.limits_rad.T
        self._low, self._high = low + AT_LIMIT_RAD, high - AT_LIMIT_RAD
        self._unseen_s = np.full(N_DOFS - N_ROOT_DOFS, np.inf)
        self._last_s = np.nan

    def of(self, time_s: float, hand: HandFrame) -> Codes:
        """(26,) int8, of the next frame."""
        dt_s, self._last_s = time_s - self._last_s, time_s
        if hand.state is not HandState.TRACKED:
            self._guesses.reset()
            self._unseen_s[:] = np.inf  # nothing is carried on from before
            return np.full(N_DOFS, UNKNOWN, dtype=np.int8)
        pose, seen, angles = right_pose(hand), hand.observed, hand.theta_rad[N_ROOT_DOFS:]
        believed = self._information.believed
        guessed = self._guesses.of(pose, seen)
        if dt_s > 0.0:  # NaN is not
            self._unseen_s += dt_s
        self._unseen_s[~guessed] = 0.0
        if guessed.any():
            carried = STRAY_RAD * np.maximum(self._unseen_s[guessed], LEAST_STRAY_S) ** 1.5
            believed = believed.copy()
            believed[N_ROOT_DOFS:][guessed] = 1.0 / np.hypot(1.0 / believed[N_ROOT_DOFS:][guessed], 1.0 / carried)
        measured = self._information.told(pose, seen) < believed
        source: Codes = np.where(measured, MEASURED, PRIOR).astype(np.int8)
        source[N_ROOT_DOFS:][(angles <= self._low) | (angles >= self._high)] = LIMIT
        source[np.flatnonzero(hand.filled)] = FILLED
        return source


class Sources:
    """Follows every hand of a stream. Frames of other hands than the profiles' are passed over."""

    def __init__(self, profiles: Profile | Sequence[Profile]) -> None:
        cast = cast_of(profiles)
        solvers = [tracking_solver(profile) for profile in cast]
        self._hands = {hand: HandSources(solvers[hand.performer]) for hand in hands_of(cast)}

    def of(self, frame: TrackedFrame) -> dict[HandKey, Codes]:
        """Of each hand of the next frame (26,) int8, as HandSources.of."""
        now_s = frame.times.device_s if np.isfinite(frame.times.device_s) else frame.times.host_s
        return {hand.key: self._hands[hand.key].of(now_s, hand) for hand in frame.hands if hand.key in self._hands}


@dataclass(frozen=True)
class SourceShares:
    """Where the numbers of a recording come from: of each 26 in every frame and hand that is tracked.

    counts: (26, 4) int64, values of each parameter by source, in the order of SOURCES.
    """

    counts: IntArray = field(default_factory=lambda: np.zeros((N_DOFS, len(SOURCES)), dtype=np.int64))

    @property
    def shares(self) -> dict[str, float]:
        """Share of all values per source, 0..1; {} where nothing was tracked."""
        total = self.counts.sum()
        by_source = self.counts.sum(axis=0)
        return {name: float(n / total) for name, n in zip(SOURCES, by_source, strict=True)} if total else {}

    @property
    def by_angle(self) -> dict[str, dict[str, float]]:
        """The same of each of DOF_NAMES."""
        total = np.maximum(self.counts.sum(axis=1, keepdims=True), 1)
        return {
            name: dict(zip(SOURCES, row.tolist(), strict=True)) if self.counts.any() else {}
            for name, row in zip(DOF_NAMES, self.counts / total, strict=True)
        }


def source_shares(frames: Iterable[TrackedFrame], profiles: Profile | Sequence[Profile]) -> SourceShares:
    """Of the frames of a recording, as they are shown."""
    counts = np.zeros((len(SOURCES), N_DOFS), dtype=np.int64)
    for each in _each(frames, profiles):
        for k in range(len(SOURCES)):
            counts[k] += each == k
    return SourceShares(counts.T)


def _each(frames: Iterable[TrackedFrame], profiles: Profile | Sequence[Profile]) -> Iterator[Codes]:
    sources = Sources(profiles)
    for frame in frames:
        yield from sources.of(frame).values()
