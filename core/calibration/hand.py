"""The profile of a performer from a recording of a moving hand: shape and marker positions found from motion alone.

Han 2018 (4.5) moves markers on a hand of known shape and asks for poses that are held; Schröder 2017 scans the hand
first. Here the engine tracks the recording with what is known, frames as unlike each other as can be are chosen, and
poses, shape and markers are found together (core.calibration.bundle). Points that do not fit, such as those with
another's label, lose their weight.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.calibration.alike import alike_shots
from core.calibration.bundle import OUTLIER_SIGMAS, Bundle
from core.calibration.findings import (
    Compared,
    Fit,
    MarkerPlace,
    Measure,
    doubtful_words,
    marker_places,
    measures,
    never_seen_words,
    still_words,
    unseen_words,
)
from core.calibration.fixed import FixedCovariance
from core.calibration.geometry import Estimate
from core.calibration.keyframes import farthest_points
from core.calibration.posterior import information, left_open
from core.calibration.priors import priors_for
from core.calibration.record import Calibrated, finite
from core.calibration.shots import Shots, shots_of
from core.errors import CancelledError, PhalanxError
from core.frames import BoolArray, FloatArray, IntArray, MarkerFrame, Side
from core.hand.model import template
from core.hand.shape import LARGEST, N_SHAPE, SMALLEST
from core.hand.skeleton import DIGITS
from core.kinematics.solver import HandPose, HandSolver
from core.markers.layout import MarkerLayout
from core.profile import Profile
from core.takes.reprocess import Progress, solve

KEYFRAMES = 120
LEAST_SHOTS = 20
HELD_OUT = 400
"""Most shots, not used to calibrate, on which the result is tried."""

STILL_RAD = np.radians(12.0)
"""A digit whose flexion stays within this range tells nothing of its joints."""

START_NOISE_M, LEAST_NOISE_M = 0.002, 0.0001
MOST_ROUNDS = 8
SETTLED = 0.02
"""Rounds end when the noise that is found changes by no more than this share."""


@dataclass(frozen=True)
class HandCalibration:
    """A profile, and what is to be known about it.

    shots: tracked hands that were looked at; keyframes: those calibrated from; independent: how many with errors of
    their own would tell as much (core.calibration.alike). noise_m: standard deviation of one
    coordinate of a point about the model. mislabelled: share of the keyframes' points that were left aside.
    key, held_out: RMS before and after on the keyframes and on shots not used, without points left aside; before is
    the given profile at the size found for it. measures: none if the shape was kept. still: digits that hardly moved.
    """

    profile: Profile
    shots: int
    keyframes: int
    independent: float
    noise_m: float
    mislabelled: float
    key: Compared
    held_out: Compared
    measures: tuple[Measure, ...]
    markers: tuple[MarkerPlace, ...]
    still: tuple[str, ...]

    @property
    def unseen(self) -> list[str]:
        """What the recording did not tell, in sentences."""
        return unseen_words(list(self.measures))

    @property
    def doubts(self) -> list[str]:
        """What looks wrong about the markers, in sentences."""
        count = self.key.after.count + self.held_out.after.count
        never = [marker.name for marker, seen in zip(self.markers, count, strict=True) if not seen]
        return doubtful_words(list(self.markers), never)


def calibrate_hand(
    frames: Sequence[MarkerFrame],
    profile: Profile,
    *,
    labels: Mapping[int, tuple[Side, int]] | None = None,
    performer: str | None = None,
    keep_shape: bool = False,
    keyframes: int = KEYFRAMES,
    progress: Progress | None = None,
) -> HandCalibration:
    """Find shape and markers of the performer of some frames; either hand or both, which count as one.

    profile: what is known before, at least the layout. labels: device id to side and marker, where points are named;
    None to label them here. performer: name for the new profile, None to keep the old one. keep_shape: the profile's
    hand is right, perhaps but for a size that it leaves open; find the markers on it (as Han 2018, 4.5).
    Raises PhalanxError if there is too little to calibrate from, CancelledError if `progress` returns False.
    """
    report = _Report(progress)
    result, passes = None, 1 if labels is not None else 2
    # Labels found with the wrong hand are tried again with the right one.
    tracking = profile
    for turn in range(passes):
        begin, end = turn / passes, (turn + 1) / passes
        tracked = report.between(begin, begin + 0.6 * (end - begin))
        shots = shots_of(frames, solve(frames, tracking, tracked, labels=labels), len(profile.layout.joints))
        result = calibrate_shots(
            shots, profile, len(frames), keep_shape=keep_shape, keyframes=keyframes,
            progress=report.between(begin + 0.6 * (end - begin), end), start=tracking,
        )  # fmt: skip
        tracking = result.profile
    assert result is not None
    named = replace(result.profile, performer=profile.performer if performer is None else performer)
    return replace(result, profile=named)


def calibrate_shots(
    shots: Shots,
    profile: Profile,
    n_frames: int,
    *,
    keep_shape: bool = False,
    keyframes: int = KEYFRAMES,
    progress: Progress | None = None,
    start: Profile | None = None,
) -> HandCalibration:
    """As `calibrate_hand`, from hands already tracked with the profile `start` (None: with `profile`)."""
    report = _Report(progress)
    report("Choosing frames", 0.0)
    usable = np.flatnonzero(shots.usable) if len(shots) else np.zeros(0, dtype=np.int64)
    if len(usable) < LEAST_SHOTS:
        raise PhalanxError(
            f"A hand was tracked well in {len(usable):,} of {n_frames:,} frames; at least {LEAST_SHOTS} are needed.",
            "Check that --profile names the layout that was worn, and record 10 s in which every finger moves.",
        )
    if len(still_digits(shots[usable].thetas_rad)) == len(DIGITS):
        raise PhalanxError(
            f"The hand hardly moves: no digit bends by more than {np.degrees(STILL_RAD):.0f} degrees.",
            "Record again: open and close the hand, bend and spread every finger, touch it with the thumb.",
        )
    chosen = farthest_points(shots[usable].thetas_rad[:, 6:], keyframes)
    key = shots[usable[chosen]]
    layout, tracking = profile.layout, start or profile
    priors = priors_for(profile)
    bundle = Bundle(profile.limits.on(template().skeleton), layout.joints, layout.positions_m, key.points_m, priors)
    first = _start(key, tracking, layout, shots.scale)
    at, noise_m = adjust(bundle, first, report, keep_shape=keep_shape)
    alike = alike_shots(bundle, at, noise_m)
    known = information(bundle, at, noise_m, alike)
    found = () if keep_shape else tuple(measures(bundle, known, at.shape))
    covariance = left_open(known, keep_shape)
    # What is said of a marker's place is, of a hand that was kept, of its place on this hand.
    of_markers = left_open(known[N_SHAPE:, N_SHAPE:], False) if keep_shape else covariance[N_SHAPE:, N_SHAPE:]
    moved = replace(layout, positions_m=layout.positions_m + at.moved_m)
    new = profile.with_hand(layout=moved, shape=at.shape, scale=1.0)
    report("Trying the result", 0.9)
    others = shots[np.setdiff1d(np.arange(len(shots)), usable[chosen])]
    others = others[np.unique(np.linspace(0, len(others) - 1, min(HELD_OUT, len(others))).astype(np.int64))]
    before_scale = shots.scale if tracking is profile else _size_of(shots[usable], profile)
    key_compared, aside = compare(key, profile, before_scale, new, noise_m)
    held_out, _ = compare(others, profile, before_scale, new, noise_m)
    report("Done", 1.0)
    still = still_digits(at.thetas_rad)
    never = [name for k, name in enumerate(layout.marker_names) if np.isnan(shots.points_m[:, k, 0]).all()]
    record = Calibrated(
        FixedCovariance.of(covariance), noise_m, len(key), len(key) / alike,
        finite(key_compared.after.overall_m), finite(held_out.after.overall_m),
        (*never_seen_words(never), *unseen_words(list(found)), *still_words(still)),
    )  # fmt: skip
    return HandCalibration(
        replace(new, calibrated=record), len(shots), len(key), len(key) / alike, noise_m, aside,
        key_compared, held_out, found,
        tuple(marker_places(bundle, of_markers, layout.marker_names, at.moved_m)),
        still,
    )  # fmt: skip


def adjust(
    bundle: Bundle, start: Estimate, report: _Report | None = None, *, keep_shape: bool = False
) -> tuple[Estimate, float]:
    """Rounds of bundle adjustment, each with the noise that the one before left: first the shape, then the markers too.

    keep_shape: the markers alone. Returns the estimate and the noise of one coordinate [m].
    """
    report = report or _Report(None)
    of_shape: BoolArray = np.arange(bundle.n_shared) < N_SHAPE
    first, then = (~of_shape, ~of_shape) if keep_shape else (of_shape, np.ones_like(of_shape))
    at, noise_m = start, _rough_noise_m(bundle, start)
    for turn in range(MOST_ROUNDS):
        share = 0.05 + 0.85 * turn / MOST_ROUNDS
        text = "Finding the markers" if keep_shape else "Finding shape and markers"
        text = text if turn or keep_shape else "Finding the hand's shape"

        def look(share: float = share, text: str = text) -> None:
            report(text, share)

        at, _ = bundle.solve(at, noise_m, free := then if turn else first, each=look)
        before, residuals = noise_m, bundle.residuals_m(bundle.place(at))
        noise_m = max(bundle.noise_m(residuals, noise_m, float(free.sum())), LEAST_NOISE_M)
        if turn and abs(np.log(noise_m / before)) < SETTLED:
            break
    return at, noise_m


def still_digits(thetas_rad: FloatArray) -> tuple[str, ...]:
    """Digits that bend by no more than STILL_RAD over the shots (n, 26)."""
    angles = thetas_rad[:, 6:].reshape(len(thetas_rad), len(DIGITS), 4)
    bend = angles.sum(axis=2) - angles[:, :, 0] * (np.arange(len(DIGITS)) > 0)  # a finger's first angle is abduction
    ranges = np.percentile(bend, 95.0, axis=0) - np.percentile(bend, 5.0, axis=0)
    return tuple(digit for digit, range_ in zip(DIGITS, ranges, strict=True) if range_ < STILL_RAD)


def compare(shots: Shots, old: Profile, old_scale: float, new: Profile, noise_m: float) -> tuple[Compared, float]:
    """RMS of the same points under two profiles, and the share left aside: those that the new one cannot explain."""
    before, _ = _errors(shots, old, old_scale, noise_m)
    after, weights = _errors(shots, new, 1.0, noise_m)
    seen = ~np.isnan(shots.points_m[..., 0])
    kept = seen & (weights > 0.25)  # within OUTLIER_SIGMAS
    aside = 1.0 - kept.sum() / max(seen.sum(), 1)
    return Compared(_fit(before, kept), _fit(after, kept), len(shots)), float(aside)


def _fit(errors_m: FloatArray, kept: BoolArray) -> Fit:
    count: IntArray = kept.sum(axis=0)
    squares = np.where(kept, errors_m, 0.0) ** 2
    rms = np.sqrt(squares.sum(axis=0) / np.maximum(count, 1))
    return Fit(np.where(count > 0, rms, np.nan), count)


def _errors(shots: Shots, profile: Profile, scale: float, noise_m: float) -> tuple[FloatArray, FloatArray]:
    """Distance of every point from its marker [m] and its weight, (n, m) each: every pose solved anew, robustly."""
    solver = HandSolver(profile.hand.skeleton, profile.worn)
    n, m = len(shots), len(profile.layout.joints)
    errors, weights = np.full((n, m), np.nan), np.zeros((n, m))
    pose = HandPose.at_rest(m)
    observed, points = ~np.isnan(shots.points_m[..., 0]), np.nan_to_num(shots.points_m)
    for i in range(n):
        seen, targets = observed[i].astype(np.float64), points[i]
        weight = seen
        pose.theta_rad[:], pose.scale = shots.thetas_rad[i], scale
        for iterations in (20, 10, 10):
            solver.solve(pose, targets, weight, iterations=iterations)
            errors[i] = np.linalg.norm(pose.markers_world_m - targets, axis=1)
            weight = seen / (1.0 + (errors[i] / (OUTLIER_SIGMAS * noise_m)) ** 2) ** 2
        weights[i] = weight
    return errors, weights


def _start(key: Shots, tracking: Profile, layout: MarkerLayout, scale: float) -> Estimate:
    """Where the profile that tracked the shots stands."""
    ratios = np.clip(tracking.shape.ratios * scale, SMALLEST, LARGEST)
    at = Estimate.of_poses(key.thetas_rad, np.log(ratios), len(layout.joints))
    return replace(at, moved_m=tracking.layout.positions_m - layout.positions_m)


def _size_of(shots: Shots, profile: Profile) -> float:
    """Uniform size at which a profile explains shots that another one tracked."""
    if profile.scale is not None:
        return profile.scale
    solver = HandSolver(profile.hand.skeleton, profile.worn)
    sizes = []
    for i in np.unique(np.linspace(0, len(shots) - 1, 50).astype(int)):
        seen = ~np.isnan(shots.points_m[i, :, 0])
        pose = HandPose.at_rest(len(seen))
        pose.theta_rad[:] = shots.thetas_rad[i]
        solver.solve(pose, np.nan_to_num(shots.points_m[i]), seen.astype(np.float64), free_scale=True, iterations=30)
        sizes.append(pose.scale)
    return float(np.median(sizes))


def _rough_noise_m(bundle: Bundle, at: Estimate) -> float:
    """From the start: so large that no point is left aside that an unknown hand may explain."""
    distances = np.linalg.norm(bundle.residuals_m(bundle.place(at)), axis=-1)[bundle.seen]
    return max(float(np.sqrt(np.median(distances**2))), START_NOISE_M)


class _Report:
    """Progress of a part of the work; raises CancelledError when the answer is False."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress

    def __call__(self, text: str, share: float) -> None:
        if self._progress is not None and self._progress(share, text) is False:
            raise CancelledError

    def between(self, begin: float, end: float) -> Progress | None:
        """As a Progress of its own, for a part of this one."""
        outer = self._progress
        return None if outer is None else lambda share, text: outer(begin + share * (end - begin), text)
