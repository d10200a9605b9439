"""Schröder 2017, Fig. 17 on a real glove: markers before and after calibration from its first 10 s.

Whatever is fitted or chosen sees the first 10 s of the recording alone: the size of the generic hand, the calibration,
the posture prior of this performer and the weights of the affine predictor. The figures are of the other 50 s.

- Observed markers: RMS distance of all seen markers to the model's, every pose solved from all of them.
- A hidden marker: each of the 13 in turn is left out of all frames; mean distance of the model's from where it was
  seen, the pose solved from the other twelve with the posture prior of the generic subspace, or of the poses of the
  first 10 s. Its peers, in the same frames: the affine predictor of Pavllo 2019 (eq. 5-8, lambda 1e-8), and where the
  marker was last known, in the room or on the back of the hand.

Before: markers placed by anatomy on the generic hand, and the shipped layout, whose positions were fitted to the same
10 s. After: calibrated from either.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from core.calibration.hand import HandCalibration, calibrate_hand
from core.calibration.shots import Shots, shots_of
from core.frames import FloatArray
from core.kinematics.prior import PosturePrior, posture_prior
from core.kinematics.solver import HandPose, HandSolver
from core.markers.layout import MarkerLayout, load_layout
from core.profile import Profile
from core.recording import Recording
from core.takes.formats import read_recording
from core.takes.reprocess import solve
from resources.layouts.build_layouts import qualisys13

NEEDS = ("qualisys_hand",)
CALIBRATION_S = 10.0
LAMBDA = 1e-8
ITERATIONS = 20
WIDENED, LEAST_STD_RAD, NOISE_M = 1.5, 0.05, 0.0007
"""Of a performer's own posture prior: noise as the calibration finds it; the others are best on the second 5 s of the
recording where everything is fitted to the first 5 s."""

BACK = ("hand_top", "hand_left", "hand_right")
GOAL_RMS_MM, GOAL_HIDDEN_MM = 2.0, 5.0


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Prints both tables."""
    shipped = load_layout("qualisys13")
    recording = read_recording(arguments.data / NEEDS[0] / "recording.tsv")
    recording = _columns(recording, shipped)
    begin = int(CALIBRATION_S * recording.rate_hz)
    first, rest = recording.points_m[:begin], recording.points_m[begin:]
    if arguments.frames is not None:
        rest = rest[np.unique(np.linspace(0, len(rest) - 1, arguments.frames).astype(np.int64))]
    frames = list(recording.frames())[:begin]
    labels = {int(identity): ("right", k) for k, identity in enumerate(recording.ids)}

    figures: dict[str, Any] = {"frames": len(rest), "calibrated_from_s": CALIBRATION_S, "markers": {}}
    print(f"{begin:,} frames to calibrate from, {len(rest):,} others; mean over markers in mm")
    print("  markers                        observed RMS      hidden, generic prior    own prior")
    for name, layout in (("by anatomy", qualisys13()), ("shipped layout", shipped)):
        given = Profile("", layout, ("right",))
        shots = shots_of(frames, solve(frames, given, labels=labels), len(layout.joints))
        calibrated = calibrate_hand(frames, given, labels=labels)
        after = shots_of(frames, solve(frames, calibrated.profile, labels=labels), len(layout.joints))
        for word, profile, tracked in (
            ("before", replace(given, scale=shots.scale), shots),
            ("after", calibrated.profile, after),
        ):
            found = _tried(profile, tracked, rest)
            figures["markers"][f"{name}, {word}"] = found
            print(
                f"  {name + ', ' + word:28} {found['observed_rms_mm']:12.2f} "
                f"{found['hidden_generic_mm']['mean']:19.2f} {found['hidden_own_mm']['mean']:17.2f}"
            )
        figures[f"calibration, {name}"] = _summary(calibrated)
    print(f"  goal                         {GOAL_RMS_MM:12.2f} {GOAL_HIDDEN_MM:19.2f} {GOAL_HIDDEN_MM:17.2f}")

    peers = {
        "affine": affine_errors_m(first, rest),
        "last known in the room": last_known_errors_m(first, rest, ()),
        "last known on the hand": last_known_errors_m(first, rest, [shipped.marker_names.index(n) for n in BACK]),
    }
    figures["peers"] = {name: _hidden(errors, shipped) for name, errors in peers.items()}
    for name, found in figures["peers"].items():
        print(f"  {name:28} {'-':>12} {found['mean']:19.2f}")
    _print_markers(shipped, figures)
    return figures


def _columns(recording: Recording, layout: MarkerLayout) -> Recording:
    """Only the layout's markers, in its order."""
    columns = [recording.labels.index(name) for name in layout.marker_names]
    return replace(
        recording, points_m=recording.points_m[:, columns], labels=layout.marker_names, ids=np.arange(len(columns))
    )


def _tried(profile: Profile, tracked: Shots, rest: FloatArray) -> dict[str, Any]:
    """Figures of one profile on the other 50 s. tracked: what it made of the first 10 s."""
    own = own_prior(tracked.thetas_rad[tracked.usable][:, 6:])
    start, scale = tracked.thetas_rad[-1], profile.scale or 1.0
    observed = solved_m(profile, None, start, scale, rest)
    distances = np.linalg.norm(observed - rest, axis=2)
    return {
        "observed_rms_mm": 1e3 * float(np.sqrt(np.nanmean(distances**2))),
        "observed_markers_mm": dict(
            zip(profile.layout.marker_names, 1e3 * np.sqrt(np.nanmean(distances**2, axis=0)), strict=True)
        ),
        **{
            f"hidden_{word}_mm": _hidden(hidden_errors_m(profile, prior, start, scale, rest), profile.layout)
            for word, prior in (("generic", posture_prior(profile.subspace)), ("own", own))
        },
    }


def own_prior(postures_rad: FloatArray) -> PosturePrior:
    """The Gaussian of a performer's own postures (n, 20)."""
    covariance = WIDENED**2 * np.cov(postures_rad.T) + LEAST_STD_RAD**2 * np.eye(postures_rad.shape[1])
    return PosturePrior(postures_rad.mean(axis=0), NOISE_M**2 * np.linalg.inv(covariance))


def solved_m(
    profile: Profile, prior: PosturePrior | None, start: FloatArray, scale: float, points_m: FloatArray
) -> FloatArray:
    """(n, m, 3) float64 [m]: the model's markers in every frame (n, m, 3), each pose from the one before."""
    solver = HandSolver(profile.hand.skeleton, profile.worn, *([] if prior is None else [prior]))
    seen, targets = (~np.isnan(points_m[..., 0])).astype(np.float64), np.nan_to_num(points_m)
    pose, model = HandPose.at_rest(points_m.shape[1]), np.empty_like(points_m)
    pose.theta_rad[:], pose.scale = start, scale
    for t in range(len(points_m)):
        solver.solve(pose, targets[t], seen[t], iterations=ITERATIONS)
        model[t] = pose.markers_world_m
    return model


def hidden_errors_m(
    profile: Profile, prior: PosturePrior, start: FloatArray, scale: float, points_m: FloatArray
) -> FloatArray:
    """(n, m) float64 [m]: how far each marker is found from where it was seen, if it alone is left out."""
    errors = np.empty(points_m.shape[:2])
    for k in range(points_m.shape[1]):
        others = points_m.copy()
        others[:, k] = np.nan
        model = solved_m(profile, prior, start, scale, others)
        errors[:, k] = np.linalg.norm(model[:, k] - points_m[:, k], axis=1)
    return errors


def affine_errors_m(first_m: FloatArray, rest_m: FloatArray) -> FloatArray:
    """(n, m) float64 [m]: each marker as an affine combination of the others (Pavllo 2019, eq. 5-8).

    Fitted to the frames of `first_m` in which all are seen. A frame in which one of the others is missing too takes
    the weights without it.
    """
    whole = first_m[~np.isnan(first_m).any(axis=(1, 2))]
    m = whole.shape[1]
    # One row per marker; its coordinates in all frames, then as many ones: points are homogeneous.
    rows = np.concatenate([whole.transpose(1, 0, 2).reshape(m, -1), np.ones((m, len(whole)))], axis=1)
    products = rows @ rows.T
    errors = np.full(rest_m.shape[:2], np.nan)
    missing = np.isnan(rest_m[..., 0])
    for gaps in np.unique(missing, axis=0):
        these = np.flatnonzero((missing == gaps).all(axis=1))
        for k in range(m):
            others = np.flatnonzero(~gaps & (np.arange(m) != k))
            system = products[np.ix_(others, others)] + LAMBDA * np.eye(len(others))
            weights = np.linalg.solve(system, products[others, k])
            found = np.einsum("o,fod->fd", weights, rest_m[np.ix_(these, others)])
            errors[these, k] = np.linalg.norm(found - rest_m[these, k], axis=1)
    return errors


def last_known_errors_m(first_m: FloatArray, rest_m: FloatArray, carriers: Any) -> FloatArray:
    """(n, m) float64 [m]: each marker where it was when it was last seen, in the room or fixed to `carriers`.

    A marker that carries is held by the other carriers and moves with them as far as they tell.
    """
    known = np.array([first_m[np.flatnonzero(~np.isnan(first_m[:, k, 0]))[-1], k] for k in range(first_m.shape[1])])
    errors = np.full(rest_m.shape[:2], np.nan)
    for k in range(first_m.shape[1]):
        held = [c for c in carriers if c != k]
        for t, points in enumerate(rest_m):
            errors[t, k] = np.linalg.norm(_carried(known, points, k, held) - points[k])
    return errors


def _carried(known_m: FloatArray, points_m: FloatArray, k: int, carriers: list[int]) -> FloatArray:
    seen = [c for c in carriers if not np.isnan(points_m[c, 0])]
    if not seen:
        return known_m[k]
    then, now = known_m[seen].mean(axis=0), points_m[seen].mean(axis=0)
    if len(seen) < 3:
        return known_m[k] + now - then
    turn, _ = Rotation.align_vectors(points_m[seen] - now, known_m[seen] - then)
    return now + turn.apply(known_m[k] - then)


def _hidden(errors_m: FloatArray, layout: MarkerLayout) -> dict[str, Any]:
    by_marker = 1e3 * np.nanmean(errors_m, axis=0)
    return {"mean": float(by_marker.mean()), "markers": dict(zip(layout.marker_names, by_marker, strict=True))}


def _summary(calibrated: HandCalibration) -> dict[str, Any]:
    return {
        "keyframes": calibrated.keyframes,
        "noise_mm": 1e3 * calibrated.noise_m,
        "shape": calibrated.profile.shape.to_dict(),
        "not_seen": calibrated.unseen,
    }


def _print_markers(layout: MarkerLayout, figures: Mapping[str, Any]) -> None:
    after, affine = figures["markers"]["by anatomy, after"], figures["peers"]["affine"]
    print("  calibrated from anatomy, by marker: observed RMS, hidden with own prior, affine [mm]")
    for name in layout.marker_names:
        print(
            f"    {name:16} {after['observed_markers_mm'][name]:6.2f} "
            f"{after['hidden_own_mm']['markers'][name]:8.2f} {affine['markers'][name]:8.2f}"
        )
