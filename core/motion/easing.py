"""Taking what passes through each other apart, smoothly in time.

Digits, hands and props that are deeper in each other than flesh gives are pushed out along the shortest way, by damped
least squares over the angles (and, where the hand is free, the wrist); the pushes are spread over neighbouring samples,
so that a finger goes around what is in its way as a minimum-jerk movement would. Repeated until nothing is too deep.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import convolve1d

from core.frames import BoolArray, FloatArray, IntArray
from core.motion.capsules import (
    N_BONES,
    PAIRS,
    Flesh,
    Posed,
    Touch,
    cross_touches,
    own_touches,
    prop_touches,
    pushed,
)
from core.motion.library import Prop
from core.motion.stage import LEFT, RIGHT

GIVE_M = 0.0025
"""How deep flesh gives in flesh."""

PROP_GIVE_M = 0.004
ROUNDS = 40
_NEAR_M = 0.42  # wrists further apart than this keep their hands apart
_SPREAD_S = 0.07
_GAIN = 1.6
_WRIST_WEIGHT = 0.03**2  # [m2] against angles [rad2]: an arm gives before a finger twists


@dataclass(frozen=True)
class PropPath:
    """A prop at n samples. holder (n,): 0 left, 1 right, -1 none. transforms: (n, 4, 4), in the holder's right-handed
    terms relative to its wrist, or in the world."""

    prop: Prop
    holder: IntArray
    transforms: FloatArray


def eased(
    flesh: Flesh, theta: FloatArray, free: FloatArray, props: Sequence[PropPath], step_s: float,
    low: FloatArray, high: FloatArray, active: BoolArray | None = None,
) -> FloatArray:  # fmt: skip
    """What to add to theta (2, n, 26) of both hands, in right-handed terms, a loop in time with step step_s [s].

    free: (2, n) in 0..1, how far each wrist may give way. low, high: (20,) [rad], bounds. active: (n,), where to look;
    None: everywhere. Returns (2, n, 26).
    """
    n = theta.shape[1]
    added = np.zeros_like(theta)
    reach = max(int(np.ceil(3.0 * _SPREAD_S / step_s)), 1)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) * step_s / _SPREAD_S) ** 2)
    kernel /= kernel.sum()
    active = np.ones(n, dtype=np.bool_) if active is None else active
    for _ in range(ROUNDS):
        rows = np.flatnonzero(active)
        now = theta[:, rows] + added[:, rows]
        push, deep = _pushes(flesh, now, free[:, rows], [_at(path, rows) for path in props])
        if not deep.any():
            break
        whole = np.zeros_like(theta)
        whole[:, rows] = push
        spread = convolve1d(_GAIN * whole, kernel, axis=1, mode="wrap")
        before = added[..., 6:].copy()
        added += spread
        bounded = np.clip(theta[..., 6:] + added[..., 6:], low, high)
        outside = (theta[..., 6:] < low) | (theta[..., 6:] > high)
        added[..., 6:] = np.where(outside, before, bounded - theta[..., 6:])
        active = np.zeros(n, dtype=np.bool_)
        active[rows[deep]] = True
        active = convolve1d(active.astype(np.float64), np.ones(2 * reach + 1), mode="wrap") > 0.0
    return added


def deepest_m(flesh: Flesh, theta: FloatArray, props: Sequence[PropPath]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(n,) [m] each, the smallest gap at n samples of theta (2, n, 26): within a hand, between the hands, and between
    hands and props; negative inside."""
    hands = [flesh.posed(theta[LEFT]), flesh.posed(theta[RIGHT])]
    own = np.minimum(*(own_touches(posed, flesh.radii_m).gap_m.min(axis=1) for posed in hands))
    world = _world(hands)
    cross = np.full(theta.shape[1], np.inf)
    near = np.flatnonzero(_near(world))
    cross[near] = cross_touches(world[RIGHT][near], world[LEFT][near], flesh.radii_m).gap_m.min(axis=1)
    thing = np.full(theta.shape[1], np.inf)
    for path in props:
        placed = _placed(path, world)
        for posed in world:
            close = np.flatnonzero(np.linalg.norm(posed.joints_m[:, 7] - placed[:, :3, 3], axis=1) < _NEAR_M)
            gaps = prop_touches(posed[close], flesh.radii_m, path.prop, placed[close]).gap_m.min(axis=1)
            thing[close] = np.minimum(thing[close], gaps)
    return own, cross, thing


def _pushes(
    flesh: Flesh, theta: FloatArray, free: FloatArray, props: Sequence[PropPath]
) -> tuple[FloatArray, BoolArray]:
    """(2, n, 26) to add at n samples, and (n,) whether anything is too deep there."""
    n = theta.shape[1]
    push, deep = np.zeros_like(theta), np.zeros(n, dtype=np.bool_)
    hands = [flesh.posed(theta[LEFT]), flesh.posed(theta[RIGHT])]
    for hand, posed in enumerate(hands):
        touch = own_touches(posed, flesh.radii_m)
        rows, pairs = np.nonzero(touch.gap_m < -GIVE_M)
        depth = -touch.gap_m[rows, pairs] - GIVE_M
        deep[rows[depth > 5e-4]] = True
        normal = touch.normal[rows, pairs]
        lever = pushed(posed, rows, PAIRS[0][pairs], touch.first_m[rows, pairs], normal)
        lever -= pushed(posed, rows, PAIRS[1][pairs], touch.second_m[rows, pairs], normal)
        lever[:, :3] = 0.0
        _give(push[hand], rows, lever, depth, np.zeros(len(rows)))
    world = _world(hands)
    near = np.flatnonzero(_near(world))
    if len(near):
        touch = cross_touches(world[RIGHT][near], world[LEFT][near], flesh.radii_m)
        k, pairs = np.nonzero(touch.gap_m < -GIVE_M)
        rows = near[k]
        depth = -touch.gap_m[k, pairs] - GIVE_M
        deep[rows[depth > 5e-4]] = True
        _push_hand(push, world, RIGHT, rows, pairs // N_BONES, touch, (k, pairs), 1.0, depth / 2.0, free)
        _push_hand(push, world, LEFT, rows, pairs % N_BONES, touch, (k, pairs), -1.0, depth / 2.0, free)
    for path in props:
        placed = _placed(path, world)
        for hand, posed in enumerate(world):
            close = np.flatnonzero(np.linalg.norm(posed.joints_m[:, 7] - placed[:, :3, 3], axis=1) < _NEAR_M)
            if len(close) == 0:
                continue
            touch = prop_touches(posed[close], flesh.radii_m, path.prop, placed[close])
            k, bones = np.nonzero(touch.gap_m < -PROP_GIVE_M)
            fingers = bones < 15
            k, bones = k[fingers], bones[fingers]
            rows = close[k]
            depth = -touch.gap_m[k, bones] - PROP_GIVE_M
            deep[rows[depth > 5e-4]] = True
            _push_hand(push, world, hand, rows, bones, touch, (k, bones), 1.0, depth, np.zeros_like(free))
    return push, deep


def _push_hand(
    push: FloatArray, world: Sequence[Posed], hand: int, rows: IntArray, bones: IntArray, touch: Touch,
    at: tuple[IntArray, IntArray], sign: float, depth: FloatArray, free: FloatArray,
) -> None:  # fmt: skip
    """Adds to push[hand] what moves bones out by depth (k,) along the touch's normal, times sign."""
    points = touch.first_m[at] if sign > 0.0 else touch.second_m[at]
    lever = pushed(world[hand], rows, bones, points, sign * touch.normal[at])
    if hand == LEFT:
        lever[:, 0] *= -1.0  # the left hand's parameters are those of its mirror image
    _give(push[hand], rows, lever, depth, free[hand][rows])


def _give(push: FloatArray, rows: IntArray, lever: FloatArray, depth: FloatArray, free: FloatArray) -> None:
    """Damped least squares, contact by contact: push (n, 26) += W J^T (J W J^T + damping)^-1 depth."""
    weight = np.ones((len(rows), 23))
    weight[:, :3] = (_WRIST_WEIGHT * free)[:, None]
    weighted = lever * weight
    strength = depth / ((weighted * lever).sum(axis=1) + 1e-5)
    step = np.clip(weighted * strength[:, None], -0.15, 0.15)
    np.add.at(push[:, :3], rows, step[:, :3])
    np.add.at(push[:, 6:], rows, step[:, 3:])


def _world(hands: Sequence[Posed]) -> list[Posed]:
    return [hands[LEFT].mirrored(), hands[RIGHT]]


def _near(world: Sequence[Posed]) -> BoolArray:
    near: BoolArray = np.linalg.norm(world[LEFT].joints_m[:, 7] - world[RIGHT].joints_m[:, 7], axis=1) < 0.25
    return near


def _at(path: PropPath, rows: IntArray) -> PropPath:
    return PropPath(path.prop, path.holder[rows], path.transforms[rows])


def _placed(path: PropPath, world: Sequence[Posed]) -> FloatArray:
    """(n, 4, 4): the prop in the world."""
    placed = path.transforms.copy()
    for hand, posed in enumerate(world):
        rows = np.flatnonzero(path.holder == hand)
        wrist = np.zeros((len(rows), 4, 4))
        wrist[:, :3, :3], wrist[:, :3, 3], wrist[:, 3, 3] = posed.rotations[rows, 0], posed.joints_m[rows, 0], 1.0
        grip = path.transforms[rows]
        if hand == LEFT:
            flip = np.diag([-1.0, 1.0, 1.0, 1.0])
            grip = flip @ grip @ flip
        placed[rows] = wrist @ grip
    return placed
