"""A prop from what was seen of it: points that moved together, or a body that the device itself tracks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from core.errors import PhalanxError
from core.frames import FloatArray, MarkerFrame, RigidBody
from core.gaps import present
from core.props.prop import MOST_MARKERS, N_LENGTHS, Prop, PropModel, Shape, check_markers
from core.props.rigid import aligned, mean_shape

RIGID_M = 0.002
"""Markers that stray further from the mean shape (root mean square) are not on one rigid thing."""

THINNEST_M = 0.005
"""No model is thinner, though its markers lie in a plane."""

ON_BODY_M = 0.003
"""A point that stays as near to one place of a body is a marker of it."""

NEAR_BODY_M = 0.5
LEAST_SEEN = 0.5
"""Share of a body's frames in which each of its markers must be seen."""

LEAST_TURN_RAD, LEAST_WAY_M = np.radians(15.0), 0.05


@dataclass(frozen=True)
class Definition:
    """A prop and how rigid it was. frames: how many it rests on. rms_m, worst_m: distance of its markers from the mean
    shape, root mean square and largest [m]; marker_rms_m: (m,) of each."""

    prop: Prop
    frames: int
    rms_m: float
    worst_m: float
    marker_rms_m: FloatArray


def define(name: str, samples_m: FloatArray, shape: Shape, size_m: tuple[float, ...] = ()) -> Definition:
    """A prop from its markers (t, m, 3) float64 [m] over time, NaN where not seen.

    Frames that miss one are passed over. size_m: of the model, () to take it from the markers. Raises PhalanxError
    where the markers are never seen together, are not rigid, or do not show a pose.
    """
    together = samples_m[np.isfinite(samples_m).all(axis=(1, 2))]
    if len(together) == 0:
        raise PhalanxError(
            f"The {samples_m.shape[1]} markers of {name} are in no frame all seen together.",
            "Choose markers of one moment, or a recording in which nothing hides them.",
        )
    mean_m, errors_m = mean_shape(together)
    check_markers(mean_m, name)
    marker_rms_m = np.sqrt(np.square(errors_m).mean(axis=0))
    rms_m = float(np.sqrt(np.square(errors_m).mean()))
    if rms_m > RIGID_M:
        worst = int(marker_rms_m.argmax())
        raise PhalanxError(
            f"The markers of {name} are not rigid: they stray {rms_m * 1e3:.1f} mm from their mean shape, the "
            f"{worst + 1}. of them {marker_rms_m[worst] * 1e3:.1f} mm.",
            f"Choose markers that sit on one rigid thing; up to {RIGID_M * 1e3:g} mm is taken.",
        )
    markers_m, model = modelled(mean_m, shape, size_m)
    home = aligned(markers_m, mean_m)[:3, :3]  # the mean shape lies where the first sample lay
    return Definition(Prop(name, markers_m, model, home), len(together), rms_m, float(errors_m.max()), marker_rms_m)


def modelled(markers_m: FloatArray, shape: Shape, size_m: tuple[float, ...] = ()) -> tuple[FloatArray, PropModel]:
    """Markers (m, 3) [m] in the frame of the smallest model that holds them all, and that model.

    The axes are the markers' principal ones, the longest along z. A sphere is laid through its markers where five or
    more lie on one.
    """
    if size_m and len(size_m) != N_LENGTHS[shape]:
        raise PhalanxError(f"{len(size_m)} lengths for a {shape}.", f"It takes {N_LENGTHS[shape]}.")
    centre = markers_m.mean(axis=0)
    axes = np.linalg.svd(markers_m - centre)[2][::-1].copy()  # rows: the shortest first
    # Which way an axis points is the decomposition's whim: let it follow the file's own axes.
    axes[2] *= np.sign(axes[2][np.abs(axes[2]).argmax()])
    axes[1] *= np.sign(axes[1][np.abs(axes[1]).argmax()])
    axes[0] = np.cross(axes[1], axes[2])
    local = (markers_m - centre) @ axes.T
    low, high = local.min(axis=0), local.max(axis=0)
    middle, extent = 0.5 * (low + high), high - low
    match shape:
        case "box":
            fitted: tuple[float, ...] = tuple(extent)
        case "cylinder":
            middle[:2], radius = smallest_ball(local[:, :2])
            fitted = (2.0 * radius, extent[2])
        case "sphere":
            middle, radius = sphere_through(local) or smallest_ball(local)
            fitted = (2.0 * radius,)
        case _:
            middle, fitted = np.zeros(3), ()
    return local - middle, PropModel(shape, size_m or tuple(max(float(length), THINNEST_M) for length in fitted))


def smallest_ball(points_m: FloatArray, rounds: int = 2000) -> tuple[FloatArray, float]:
    """Centre (d,) and radius [m] of the smallest ball about points (m, d), to a thousandth of it or so (Badoiu and
    Clarkson 2003)."""
    centre = points_m.mean(axis=0)
    for i in range(1, rounds):
        farthest = points_m[np.square(points_m - centre).sum(axis=1).argmax()]
        centre = centre + (farthest - centre) / (i + 1)
    return centre, float(np.sqrt(np.square(points_m - centre).sum(axis=1).max()))


def sphere_through(points_m: FloatArray) -> tuple[FloatArray, float] | None:
    """Centre (3,) and radius [m] of the sphere on which points (m, 3) lie, if five or more do."""
    if len(points_m) < 5:
        return None
    design = np.column_stack([2.0 * points_m, np.ones(len(points_m))])
    solution, _, rank, _ = np.linalg.lstsq(design, np.square(points_m).sum(axis=1), rcond=1e-6)
    if rank < 4:
        return None
    centre = solution[:3]
    distances = np.linalg.norm(points_m - centre, axis=1)
    radius = float(distances.mean())
    on_it = np.abs(distances - radius).max() < RIGID_M and radius < np.ptp(points_m, axis=0).max()
    return (centre, radius) if on_it else None


def samples_of_ids(frames: Iterable[MarkerFrame], ids: Sequence[int], at_s: float | None = None) -> FloatArray:
    """(t, m, 3) float64 [m]: points by their ids, in every frame that holds them all.

    at_s: only the unbroken stretch of such frames about this time from the first frame on [s]: a device may give an id
    again later. Raises PhalanxError where there is none.
    """
    samples: list[FloatArray] = []
    start_s, before = None, False
    for frame in frames:
        start_s = frame.times.host_s if start_s is None else start_s
        row_of = {id_: row for row, id_ in enumerate(frame.ids.tolist())}
        rows = [row_of.get(id_, -1) for id_ in ids]
        together = min(rows) >= 0 and bool(present(frame.points_m[rows]).all())
        past = at_s is not None and frame.times.host_s - start_s > at_s
        if past and not (together and before):
            break
        if not together and at_s is not None:
            samples.clear()
        if together:
            samples.append(frame.points_m[rows])
        before = together
    if not samples:
        when = "" if at_s is None else f" at {at_s:g} s"
        raise PhalanxError(
            f"The points {', '.join(map(str, ids))} are in no frame all seen together{when}.",
            "Choose points of one moment; an id lasts only while its point is seen without a break.",
        )
    return np.stack(samples)


def samples_of_body(frames: Iterable[MarkerFrame], name: str) -> FloatArray:
    """(t, m, 3) float64 [m], NaN where not seen: the markers of a body that the device tracks, in the body's frame.

    They are the points that stay where they are in it while it moves. Raises PhalanxError.
    """
    poses: list[RigidBody] = []
    clouds: list[FloatArray] = []
    known: dict[str, None] = {}
    for frame in frames:
        known.update(dict.fromkeys(body.name for body in frame.rigid_bodies))
        body = next((body for body in frame.rigid_bodies if body.name == name and body.tracked), None)
        if body is not None and np.isfinite(body.position_m).all():
            turn = Rotation.from_quat(body.quaternion_wxyz, scalar_first=True).as_matrix()
            local = (frame.points_m[present(frame.points_m)] - body.position_m) @ turn
            poses.append(body)
            clouds.append(local[np.square(local).sum(axis=1) < NEAR_BODY_M**2])
    if not poses:
        raise PhalanxError(
            f"No rigid body {name!r} is tracked in this recording.",
            f"It holds: {', '.join(known)}." if known else "It holds none; name points with --points instead.",
        )
    _check_moved(poses, name)
    candidates, trees = max(clouds, key=len), [cKDTree(cloud) if len(cloud) else None for cloud in clouds]
    samples = np.full((len(clouds), len(candidates), 3), np.nan)
    for row, (cloud, tree) in enumerate(zip(clouds, trees, strict=True)):
        if tree is not None:
            distance_m, nearest = (np.asarray(found) for found in tree.query(candidates))
            samples[row] = np.where(distance_m[:, None] < ON_BODY_M, cloud[nearest.astype(np.int64)], np.nan)
    seen = np.isfinite(samples[:, :, 0]).mean(axis=0)
    kept = np.flatnonzero(seen >= LEAST_SEEN)
    if not 3 <= len(kept) <= MOST_MARKERS:
        raise PhalanxError(
            f"{len(kept)} points stay with the rigid body {name!r}.",
            "A prop has 3 to 16 markers; use --points instead.",
        )
    return samples[:, kept]


def _check_moved(poses: Sequence[RigidBody], name: str) -> None:
    """What stands still beside a body that stands still cannot be told from its markers."""
    positions = np.array([body.position_m for body in poses])
    turns = Rotation.from_quat(np.array([body.quaternion_wxyz for body in poses]), scalar_first=True)
    way_m = np.linalg.norm(positions - positions[0], axis=1).max()
    turn_rad = np.max((turns[0].inv() * turns).magnitude())
    if way_m < LEAST_WAY_M and turn_rad < LEAST_TURN_RAD:
        raise PhalanxError(
            f"The rigid body {name!r} moved only {way_m * 1e3:.0f} mm and {np.degrees(turn_rad):.0f} degrees.",
            "Record it while it is moved about, so that its markers can be told from other points.",
        )
