"""From solved frames to a subspace: which postures can be learnt from, and how well the result serves."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from core.errors import PhalanxError
from core.frames import FloatArray, HandFrame, HandKey, HandState, TrackedFrame
from core.hand.skeleton import N_ROOT_DOFS
from core.motion.subspace import N_ANGLES, Subspace, subspace_of, thinned

SURE_RAD = float(np.radians(6.0))
"""A hand is learnt from where every joint angle is known so well (one standard deviation): what the markers do not
determine was filled in by an older subspace, and would be learnt as if it had been seen."""

SEEN_SHARE = 0.9
"""And where a take of an older Phalanx does not say how sure its angles are, where so many of its markers were seen."""

LEAST_POSTURES = 100
HELD_OUT = 0.2
"""Share of every motion, at its end, on which the result is measured before all of it is learnt from."""


@dataclass(frozen=True)
class Motion:
    """Postures of one hand through a recording. tracked, sure: how many frames there were. postures_rad: (n, 20), the
    sure ones, thinned, in the order of time."""

    name: str
    tracked: int
    sure: int
    postures_rad: FloatArray


@dataclass(frozen=True)
class Learnt:
    """A subspace, and the root mean square error per angle [rad] on HELD_OUT of the motion of one learnt from the rest
    with as many dimensions, and of `other` with as many; NaN where too little was held out."""

    subspace: Subspace
    postures: int
    own_rad: float
    other_rad: float


def motions_of(name: str, frames: Iterable[TrackedFrame]) -> list[Motion]:
    """The motion of every hand that was tracked. name: whose or which, for messages."""
    tracked: Counter[HandKey] = Counter()
    sure: defaultdict[HandKey, list[FloatArray]] = defaultdict(list)
    for frame in frames:
        for hand in frame.hands:
            if hand.state is HandState.TRACKED:
                tracked[hand.key] += 1
                if _is_sure(hand):
                    sure[hand.key].append(hand.theta_rad[N_ROOT_DOFS:])
    several = any(key.performer for key in tracked)
    motions = []
    for key in sorted(tracked):
        postures = np.array(sure[key]).reshape(-1, N_ANGLES)
        whose = f"{name}, performer {key.performer + 1}" if several else name
        motions.append(Motion(f"{whose}, {key.side}", tracked[key], len(postures), postures[thinned(postures)]))
    return motions


def learn(
    motions: Sequence[Motion], name: str, description: str, other: Subspace, *, variance: float = 0.95,
    dimensions: int | None = None,
) -> Learnt:  # fmt: skip
    """A subspace of all these motions, and how well one like it serves what it was not made from.

    Raises PhalanxError where there are fewer than LEAST_POSTURES postures.
    """
    postures = np.concatenate([np.empty((0, N_ANGLES)), *(motion.postures_rad for motion in motions)])
    if len(postures) < LEAST_POSTURES:
        tracked, sure = (sum(getattr(motion, what) for motion in motions) for what in ("tracked", "sure"))
        raise PhalanxError(
            f"Only {len(postures)} different postures: {tracked:,} hands were tracked, {sure:,} of them sure to "
            f"{np.degrees(SURE_RAD):.0f} degrees in every joint; a subspace needs {LEAST_POSTURES}.",
            "Give longer takes with varied motion, recorded with a layout that has a marker on every bone.",
        )
    subspace = subspace_of(postures, name, description, variance=variance, dimensions=dimensions)
    cuts = [round((1.0 - HELD_OUT) * len(motion.postures_rad)) for motion in motions]
    rest = np.concatenate([motion.postures_rad[:cut] for motion, cut in zip(motions, cuts, strict=True)])
    unseen = np.concatenate([motion.postures_rad[cut:] for motion, cut in zip(motions, cuts, strict=True)])
    count = min(subspace.dimensions, other.dimensions)
    own = subspace_of(rest, name, dimensions=count)
    return Learnt(subspace, len(postures), _rms_rad(own, unseen), _rms_rad(other.truncated(count), unseen))


def _rms_rad(subspace: Subspace, postures_rad: FloatArray) -> float:
    return float(np.sqrt(np.mean((subspace.nearest(postures_rad) - postures_rad) ** 2)))


def _is_sure(hand: HandFrame) -> bool:
    std = hand.theta_std[N_ROOT_DOFS:]
    if np.isfinite(std).all():
        return bool(std.max() <= SURE_RAD)
    return bool(hand.observed.mean() >= SEEN_SHARE)
