"""Test and retest: the same recording solved with two calibrations of one performer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.calibration.fixed_error import FixedError
from core.errors import PhalanxError
from core.frames import FloatArray, HandFrame, HandState, MarkerFrame, Side, TrackedFrame
from core.hand.mirror import mirror_theta
from core.hand.skeleton import N_ROOT_DOFS
from core.profile import Profile
from core.takes.reprocess import Progress, solve

BLOCK = 128
"""Frames whose deviations are found at once."""


@dataclass(frozen=True)
class Retest:
    """Of the 20 joint angles, over the hands tracked with both calibrations.

    mean_rad, most_rad: (20,) float64 [rad], mean and largest amount by which the angles differ. stated_rad: (2, 20)
    float64 [rad], root mean square of the deviation that each calibration states. within: (20,) float64 in 0..1, share
    of the differences within two standard deviations of a difference of both. hands: how many were compared.
    """

    mean_rad: FloatArray
    most_rad: FloatArray
    stated_rad: FloatArray
    within: FloatArray
    hands: int


def retest(
    frames: Sequence[MarkerFrame],
    profiles: tuple[Profile, Profile],
    labels: Mapping[int, tuple[Side, int]] | None = None,
    progress: Progress | None = None,
) -> Retest:
    """Solve `frames` with both profiles. labels: as of core.takes.reprocess.solve.

    Raises PhalanxError if no hand is tracked with both, CancelledError if `progress` returns False.
    """
    solved = [
        solve(frames, profile, _half(progress, 0.5 * i), labels=labels) for i, profile in enumerate(profiles)
    ]  # fmt: skip
    both = [_hands(one, other) for one, other in zip(*solved, strict=True)]
    thetas = np.asarray([pair for pairs in both for pair in pairs])
    if not len(thetas):
        raise PhalanxError("No hand is tracked with both calibrations.", "Choose other seconds with --from and --to.")
    angles = thetas[:, :, N_ROOT_DOFS:]
    apart = np.abs(angles[:, 0] - angles[:, 1])
    stated = np.stack([_stated(profile, thetas[:, i]) for i, profile in enumerate(profiles)])
    return Retest(
        apart.mean(axis=0),
        apart.max(axis=0),
        np.sqrt(np.square(stated).mean(axis=1)),
        (apart <= 2.0 * np.hypot(*stated)).mean(axis=0),
        len(thetas),
    )


def _hands(one: TrackedFrame, other: TrackedFrame) -> list[tuple[FloatArray, FloatArray]]:
    """Parameters of the hands of a frame that are tracked in both, as right hands."""
    found = []
    for a, b in zip(one.hands, other.hands, strict=True):
        if a.state is HandState.TRACKED and b.state is HandState.TRACKED:
            found.append((_right(a), _right(b)))
    return found


def _right(hand: HandFrame) -> FloatArray:
    return mirror_theta(hand.theta_rad) if hand.side == "left" else hand.theta_rad


def _stated(profile: Profile, thetas_rad: FloatArray) -> FloatArray:
    """(f, 20) float64 [rad]. A calibrated hand is of size 1, and every marker of it counts."""
    ones, shown = np.ones(len(thetas_rad)), np.ones(len(profile.layout.joints), dtype=np.bool_)
    error = FixedError(profile, "right", thetas_rad, ones, shown)
    blocks = (slice(begin, begin + BLOCK) for begin in range(0, len(thetas_rad), BLOCK))
    return np.concatenate([error.std(thetas_rad[rows], ones[rows])[:, N_ROOT_DOFS:] for rows in blocks])


def _half(progress: Progress | None, begin: float) -> Progress | None:
    return None if progress is None else lambda share, text: progress(begin + 0.5 * share, text)
