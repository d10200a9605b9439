"""Clouds of points with their truth, as a motion capture system would see them, in any number, from a seed.

A cloud holds one hand, or both of one performer, in a posture of the pool and a shape of the human range, and perhaps a
thing in the hand. Of half of the performers it is known where on their hands their markers sit, as after a calibration;
of the others the layout, of some their size. Markers sit a little beside that, move with the skin, and are hidden
where fewer than two or three of the cameras around see them past both hands and the thing, or at random; reflections
are added. How large all this is was measured on real recordings (noise, skin, gaps, ghosts).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from core.frames import BoolArray, FloatArray, IntArray
from core.hand.anthropometry import shape_prior
from core.hand.shape import LARGEST, SMALLEST
from core.hand.skeleton import N_ROOT_DOFS
from core.markers.layout import MarkerLayout
from core.motion.library import Prop
from core.training import kernels
from core.training.bodies import Bodies, at_rest, posed
from core.training.poses import Pool

NONE = -1
"""Label of a point that is no marker of a hand; side of the same."""
LEFT, RIGHT = 0, 1

SIZES = (0.7, 1.3)
"""Of hands against the template, every size as often: 130 to 240 mm long, a child's of six to a very large man's. How
people's sizes are spread is another question (core.hand.anthropometry): a network that saw few small hands would name
them badly."""

MOST_HIDDEN = 5
"""Markers hidden at random (Han 2018, 3.3)."""

HELD, BESIDE = 0.14, 0.06
"""Shares of the clouds with a thing in the hand, and with one near it."""
CALIBRATED, SIZED = 0.5, 0.15
"""Shares of the performers of whom shape and markers are known, and of whom the size of their hand is."""
OWN_M, FOUND_M = 0.003, 0.0008
"""Standard deviations per axis, the second a mean over hands: how far a calibrated performer's markers sit beside the
layout, and beside where the calibration found them."""
CAREFUL, CAREFUL_M, CARELESS_M = 0.5, 0.0008, 0.0025
"""Of performers who are not calibrated: the share whose markers sit about where the layout says, and how far beside
it theirs and the others' sit, a mean over hands of the standard deviation per axis."""
SKIN_M = 0.0007
NOISE_M = (2e-5, 1e-3)
JITTER_M = 0.004
"""Of a quarter of the clouds, per axis and uniform: what a depth camera or few, distant cameras leave."""
JITTERED = 0.4

_MARKER_M = 0.007  # centre of a marker above what it is fixed to
_PROP_CAPSULES, _PROP_MARKERS = 4, 6
_GHOSTS = (0.4, 0.22, 0.22, 0.08, 0.05, 0.03)
_LEAST_SEEN = 0.45
_APART_M, _ANYHOW = (0.06, 0.22), 0.35  # of two hands: between wrists, and the share that did not meet
_CLOSEST_M = 0.004  # nearer than this a camera system sees one point


@dataclass(frozen=True)
class Clouds:
    """b clouds of up to n points, in no order.

    points_m: (b, n, 3) float32 [m]. valid: (b, n) bool, False where a cloud has fewer. label: (b, n) int64, index into
    the markers of its layout, or NONE. side: (b, n) int64, LEFT, RIGHT or NONE. layout: (b,) int64, index into layouts.
    told_m: (b, m, 3) float32 [m], where the markers of its layout are known to be, at rest; zeros beyond them.
    """

    points_m: NDArray[np.float32]
    valid: BoolArray
    label: IntArray
    side: IntArray
    layout: IntArray
    layouts: tuple[MarkerLayout, ...]
    told_m: NDArray[np.float32]

    def mirrored(self, rows: BoolArray) -> Clouds:
        """The clouds of `rows` (b,) in the mirror: lefts become rights."""
        points = np.where(
            rows[:, None, None], self.points_m * np.array([-1.0, 1.0, 1.0], dtype=np.float32), self.points_m
        )
        side = np.where(rows[:, None] & (self.side != NONE), 1 - self.side, self.side)
        return replace(self, points_m=points, side=side)


@dataclass(frozen=True)
class Scenes:
    """b scenes before a camera has looked: markers_m (b, k, 3) [m] that exist where there (b, k), with their label and
    side (b, k), what is known of their places on the hand, told_m (b, m, 3), and what hides them, capsules (b, c, 3),
    (b, c, 3), (b, c) of radius 0 where there is none."""

    markers_m: FloatArray
    there: BoolArray
    label: IntArray
    side: IntArray
    starts_m: FloatArray
    ends_m: FloatArray
    radii_m: FloatArray
    told_m: FloatArray


def made(random: np.random.Generator, pool: Pool, layouts: Sequence[MarkerLayout], each: int, both: bool) -> Clouds:
    """`each` clouds of every layout; both: of two hands near each other. Half of the clouds are mirrored."""
    parts = []
    for layout in layouts:
        scene = scenes(random, pool, layout, each, both)
        parts.append((scene, scene.there & ~hidden_of(random, scene, len(layout.marker_names))))
    clouds = gathered(random, layouts, parts)
    return clouds.mirrored(random.random(len(clouds.layout)) < 0.5)


def scenes(random: np.random.Generator, pool: Pool, layout: MarkerLayout, b: int, both: bool) -> Scenes:
    """b scenes of right hands, or with a left one beside each, that wear this layout."""
    prior = shape_prior(size_std=0.0)
    ratios = np.exp(random.multivariate_normal(prior.mean_log, prior.covariance_log, b, method="cholesky"))
    ratios = np.clip(ratios * random.uniform(*SIZES, (b, 1)), SMALLEST, LARGEST)
    angles = pool.angles_rad[random.integers(len(pool.angles_rad), size=b)] + random.normal(0.0, 0.03, (b, 20))
    turns, wrists = Rotation.random(b, rng=random).as_matrix(), np.zeros((b, 3))
    props = [None] * b if both else _held(random, pool, angles)
    bodies = []
    if both:
        angles, turns, wrists, left = _pairs(random, pool, angles, turns, ratios)
        bodies.append((left, LEFT))
    right = posed(angles, turns, wrists, ratios)
    bodies.append((right, RIGHT))

    m = len(layout.marker_names)
    chance = random.random((b, 1, 1))
    known, sized = chance < CALIBRATED, chance > 1.0 - SIZED
    meant = layout.positions_m + known * random.normal(0.0, OWN_M, (b, m, 3))
    size = np.where(sized[..., 0], ratios.mean(axis=1, keepdims=True), 1.0)
    told = at_rest(np.where(known[..., 0], ratios, size)).carried(layout.joints, meant)
    careful = random.random((b, 1, 1)) < CAREFUL
    off_m = np.where(known, FOUND_M, np.where(careful, CAREFUL_M, CARELESS_M)) * random.exponential(1.0, (b, 1, 1))
    markers, capsules = [], []
    for body, side in bodies:
        flip = np.array([-1.0 if side == LEFT else 1.0, 1.0, 1.0])
        own = meant + random.normal(0.0, 1.0, (b, m, 3)) * off_m
        own += random.normal(0.0, SKIN_M, (b, m, 3)) * random.gamma(2.0, 0.5, (b, m, 1))
        markers.append(body.carried(layout.joints, own) * flip)
        capsules.append((body.starts_m * flip, body.ends_m * flip, body.radii_m))
    things = _things(random, props, right, ratios)
    capsules.append(things)
    markers.append(_upon(random, *things, _PROP_MARKERS))
    marked = np.where(things[2].any(axis=1), random.integers(0, _PROP_MARKERS + 1, b), 0)
    hands = np.ones((b, m * len(bodies)), dtype=np.bool_)
    none = [NONE] * _PROP_MARKERS
    return Scenes(
        np.concatenate(markers, axis=1),
        np.concatenate([hands, np.arange(_PROP_MARKERS) < marked[:, None]], axis=1),
        np.tile([*np.tile(np.arange(m), len(bodies)), *none], (b, 1)),
        np.tile([*np.repeat([side for _, side in bodies], m), *none], (b, 1)),
        np.concatenate([starts for starts, _, _ in capsules], axis=1),
        np.concatenate([ends for _, ends, _ in capsules], axis=1),
        np.concatenate([radii for _, _, radii in capsules], axis=1),
        told,
    )


def _pairs(
    random: np.random.Generator, pool: Pool, angles: FloatArray, turns: FloatArray, ratios: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, Bodies]:
    """Right hands' angles, turns and wrists, and the left hands beside them, in their mirror.

    Pairs of the performer stand as they met, seen from anywhere; others anyhow, some centimetres apart.
    """
    b = len(angles)
    theta = pool.pairs[random.integers(len(pool.pairs), size=b)]
    flip = np.array([-1.0, 1.0, 1.0])
    turn = Rotation.random(b, rng=random).as_matrix()
    between = np.einsum("nab,nb->na", turn, theta[:, 0, :3] * flip - theta[:, 1, :3]) * flip
    met_left = turn * flip[:, None] * flip @ Rotation.from_rotvec(theta[:, 0, 3:6]).as_matrix()
    met_right = turn @ Rotation.from_rotvec(theta[:, 1, 3:6]).as_matrix()
    away = random.normal(0.0, 1.0, (b, 3))
    away *= random.uniform(*_APART_M, (b, 1)) / np.linalg.norm(away, axis=1, keepdims=True)
    apart = (random.random(b) < _ANYHOW)[:, None]
    own = pool.angles_rad[random.integers(len(pool.angles_rad), size=b)]
    left = posed(
        np.where(apart, own, theta[:, 0, N_ROOT_DOFS:]),
        np.where(apart[..., None], Rotation.random(b, rng=random).as_matrix(), met_left),
        np.where(apart, away, between),
        ratios,
    )
    return (
        np.where(apart, angles, theta[:, 1, N_ROOT_DOFS:]),
        np.where(apart[..., None], turns, met_right),
        np.zeros((b, 3)),
        left,
    )


def _held(random: np.random.Generator, pool: Pool, angles: FloatArray) -> list[Prop | None]:
    """What every hand holds; writes how it grasps into angles (b, 20)."""
    props: list[Prop | None] = [None] * len(angles)
    for row in np.flatnonzero(random.random(len(angles)) < HELD):
        grasp, props[row] = pool.held[int(random.integers(len(pool.held)))]
        angles[row] = grasp + random.normal(0.0, np.radians(4.0), 20)
    return props


def _things(
    random: np.random.Generator, props: Sequence[Prop | None], hands: Bodies, ratios: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Capsules (b, 4, 3), (b, 4, 3), (b, 4) in place of what is held, or lies beside some hands; radius 0 for none."""
    b = len(props)
    starts, ends = np.zeros((b, _PROP_CAPSULES, 3)), np.zeros((b, _PROP_CAPSULES, 3))
    radii = np.zeros((b, _PROP_CAPSULES))
    beside = random.random(b) < BESIDE
    for row, prop in enumerate(props):
        if prop is not None:
            own_starts, own_ends, own_radii = prop_capsules(prop)
            size, turn = float(np.mean(ratios[row])), hands.rotations[row, 0]
            k = len(own_radii)
            to_world = turn @ prop.transform_hand[:3, :3]
            origin = hands.joints_m[row, 0] + turn @ (size * prop.transform_hand[:3, 3])
            starts[row, :k] = size * own_starts @ to_world.T + origin
            ends[row, :k] = size * own_ends @ to_world.T + origin
            radii[row, :k] = size * own_radii
        elif beside[row]:
            near = hands.ends_m[row, int(random.integers(15))] + random.normal(0.0, 0.03, 3)
            along = random.normal(0.0, 1.0, 3)
            along *= random.uniform(0.01, 0.10) / np.linalg.norm(along)
            starts[row, 0], ends[row, 0], radii[row, 0] = near - along, near + along, random.uniform(0.003, 0.03)
    return starts, ends, radii


def prop_capsules(prop: Prop) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A prop as capsules in its own frame: a sphere and a cylinder as one, a box along its longest edge, a disk as a
    star of four."""
    size = np.asarray(prop.size_m)
    if prop.shape == "sphere":
        return np.zeros((1, 3)), np.zeros((1, 3)), size / 2.0
    if prop.shape == "disk":
        turn = np.pi * np.arange(_PROP_CAPSULES) / _PROP_CAPSULES
        spokes = np.stack([np.cos(turn), np.sin(turn), np.zeros(_PROP_CAPSULES)], axis=1)
        radius = size[1] / 2.0
        spokes *= max(size[0] / 2.0 - radius, 0.0)
        return -spokes, spokes, np.full(_PROP_CAPSULES, radius)
    axis = 2 if prop.shape == "cylinder" else int(size.argmax())
    length = size[1] if prop.shape == "cylinder" else size[axis]
    radius = size[0] / 2.0 if prop.shape == "cylinder" else float(np.delete(size, axis).mean()) / 2.0
    end = np.eye(3)[axis] * max(length / 2.0 - radius, 0.0)
    return -end[None], end[None], np.array([radius])


def _upon(
    random: np.random.Generator, starts: FloatArray, ends: FloatArray, radii: FloatArray, count: int
) -> FloatArray:
    """(b, count, 3) [m]: markers anywhere on the capsules (b, k, 3), (b, k, 3), (b, k) that have a radius."""
    b = len(starts)
    chosen = np.where(radii[:, None] > 0.0, random.random((b, count, radii.shape[1])), -1.0).argmax(axis=2)
    rows = np.arange(b)[:, None]
    along = random.random((b, count, 1))
    axis = starts[rows, chosen] + along * (ends - starts)[rows, chosen]
    outward = random.normal(0.0, 1.0, (b, count, 3))
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    placed: FloatArray = axis + outward * (radii[rows, chosen] + _MARKER_M)[..., None]
    return placed


def hidden_from(random: np.random.Generator, scenes: Scenes) -> BoolArray:
    """(b, k): which markers too few cameras see. 4 to 16 stand around each scene, sometimes on one side only."""
    b = len(scenes.markers_m)
    counts = random.integers(4, 17, b)
    span = np.where(random.random(b) < 0.2, np.pi, 2.0 * np.pi)
    turn = random.uniform(0.0, 2.0 * np.pi, (b, 1)) + span[:, None] * np.arange(16) / counts[:, None]
    turn += random.normal(0.0, 0.1, (b, 16))
    distance, height = random.uniform(1.5, 3.5, (b, 16)), random.uniform(-0.5, 1.8, (b, 16))
    cameras = np.stack([distance * np.cos(turn), height, distance * np.sin(turn)], axis=2)
    least = np.where(random.random(b) < 0.3, 3, 2)
    seen = np.empty(scenes.there.shape, dtype=np.bool_)
    kernels.seen(
        scenes.markers_m, cameras, counts, scenes.starts_m, scenes.ends_m, scenes.radii_m, least, seen
    )  # fmt: skip
    return ~seen


def hidden_of(random: np.random.Generator, scenes: Scenes, m: int) -> BoolArray:
    """(b, k): from some clouds nothing is hidden, from some what cameras do not see, from some any markers."""
    b, hands = len(scenes.markers_m), scenes.label != NONE
    kind = random.random(b)
    by_view, by_chance = (kind > 0.15) & (kind < 0.65), kind > 0.5
    hidden = hidden_from(random, scenes) & by_view[:, None]
    # So few left that nobody could name them: as if the cameras stood better.
    few = np.zeros(b, dtype=np.bool_)
    for side in (LEFT, RIGHT):
        own = hands & (scenes.side == side)
        few |= own.any(axis=1) & ((~hidden & own).sum(axis=1) < max(4, _LEAST_SEEN * m))
    hidden[few] = False
    for side in (LEFT, RIGHT):
        own = hands & (scenes.side == side)
        order = np.where(own, random.random(own.shape), 2.0).argsort(axis=1).argsort(axis=1)
        most = min(MOST_HIDDEN, m // 3)
        hidden |= own & (order < random.integers(0, most + 1, b)[:, None]) & (by_chance | few)[:, None]
    return hidden


def gathered(
    random: np.random.Generator, layouts: Sequence[MarkerLayout], parts: Sequence[tuple[Scenes, BoolArray]]
) -> Clouds:
    """Clouds of scenes and of what is seen of them (b, k), with noise and reflections, in any order."""
    clouds = [_noisy(random, scenes, shown) for scenes, shown in parts]
    most = max(int(valid.sum(axis=1).max()) for _, valid, _, _ in clouds)
    points, valid, label, side = (np.concatenate([_padded(columns[i], most) for columns in clouds]) for i in range(4))
    layout = np.repeat(np.arange(len(layouts)), [len(part[1]) for part in clouds])
    markers = max(scene.told_m.shape[1] for scene, _ in parts)
    told = np.concatenate([_padded(scene.told_m, markers) for scene, _ in parts]).astype(np.float32)
    return Clouds(points.astype(np.float32), valid, label, side, layout, tuple(layouts), told)


def _noisy(
    random: np.random.Generator, scenes: Scenes, shown: BoolArray
) -> tuple[FloatArray, BoolArray, IntArray, IntArray]:
    """Points, valid, label, side of one layout's clouds, the valid ones first, in any order."""
    b = len(shown)
    noise_m = np.exp(random.uniform(np.log(NOISE_M[0]), np.log(NOISE_M[1]), (b, 1, 1)))
    markers = scenes.markers_m + noise_m * random.normal(0.0, 1.0, scenes.markers_m.shape)
    jitter = JITTER_M * random.random((b, 1, 1)) * (random.random((b, 1, 1)) < JITTERED)
    markers += random.uniform(-1.0, 1.0, markers.shape) * jitter
    ghosts, there = _ghosts(random, scenes, markers, shown)
    points = np.concatenate([markers, ghosts], axis=1)
    valid = np.concatenate([shown, there], axis=1)
    none = np.full(there.shape, NONE)
    label, side = np.concatenate([scenes.label, none], axis=1), np.concatenate([scenes.side, none], axis=1)
    order = np.where(valid, random.random(valid.shape), 2.0).argsort(axis=1)
    valid, label, side = (np.take_along_axis(array, order, axis=1) for array in (valid, label, side))
    points = np.take_along_axis(points, order[..., None], axis=1)
    return (
        np.where(valid[..., None], points, 0.0), valid, np.where(valid, label, NONE), np.where(valid, side, NONE),
    )  # fmt: skip


def _ghosts(
    random: np.random.Generator, scenes: Scenes, markers: FloatArray, shown: BoolArray
) -> tuple[FloatArray, BoolArray]:
    """(b, g, 3) [m] and which exist (b, g): reflections near markers, on skin and things, and in the room around."""
    b, most = len(shown), len(_GHOSTS) - 1
    rows = np.arange(b)[:, None]
    chosen = np.where(shown[:, None], random.random((b, most, shown.shape[1])), -1.0).argmax(axis=2)
    near = markers[rows, chosen] + random.normal(0.0, 0.02, (b, most, 3))
    on = _upon(random, scenes.starts_m, scenes.ends_m, scenes.radii_m, most)
    low = np.where(shown[..., None], markers, np.inf).min(axis=1, keepdims=True)
    high = np.where(shown[..., None], markers, -np.inf).max(axis=1, keepdims=True)
    around = low - 0.03 + random.random((b, most, 3)) * (high - low + 0.06)
    kind = random.random((b, most, 1))
    ghosts = np.where(kind < 0.3, near, np.where(kind < 0.55, on, around))
    there = np.arange(most) < random.choice(len(_GHOSTS), b, p=_GHOSTS)[:, None]
    gap = np.linalg.norm(ghosts[:, :, None] - markers[:, None], axis=3)
    there &= np.where(shown[:, None], gap, np.inf).min(axis=2) > _CLOSEST_M
    return ghosts, there


def _padded(array: NDArray[np.generic], most: int) -> NDArray[np.generic]:
    """The first `most` columns, made up with zeros (NONE for whole numbers)."""
    missing = most - array.shape[1]
    if missing <= 0:
        return array[:, :most]
    fill = NONE if array.dtype.kind == "i" else 0
    widths = [(0, 0), (0, missing)] + [(0, 0)] * (array.ndim - 2)
    return np.pad(array, widths, constant_values=fill)
