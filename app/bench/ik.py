"""Time of inverse kinematics: full, in subspaces, layered, for 1 to 4 hands, and other libraries beside it."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from app.peers.lm import Hand, LevenbergMarquardt
from app.peers.mujoco_hand import MujocoHand
from app.peers.pinocchio_hand import PinocchioHand
from app.peers.scipy_hand import ScipyHand
from core.frames import FloatArray
from core.hand.skeleton import Skeleton
from core.kinematics.forward import joints_world, markers_world
from core.kinematics.prior import REST_PRIOR, posture_prior
from core.kinematics.solver import HandPose, HandSolver, solve_hands
from core.markers.layout import MarkerLayout
from core.motion.library import LIBRARY
from core.motion.performer import Performer
from core.motion.subspace import subspace_of
from core.profile import load_profile

NOISE_M = 0.0005
DIMENSIONS = (5, 8, 12)
LAYERED_DIMENSIONS = 8
HANDS = (2, 4)
BLOCK = 25
SHARES = {"scipy, finite differences": 20}
"""Part of the frames for whom all would take minutes: one in so many."""

ALL_THE_WAY = 200
"""Iterations after which everybody has arrived."""

ALWAYS = -1.0
"""A tolerance that no step meets: every iteration asked for is made."""


@dataclass(frozen=True)
class Motion:
    """A hand's true poses (t, 26), and its markers with noise (t, m, 3) [m]."""

    skeleton: Skeleton
    layout: MarkerLayout
    theta: FloatArray
    points_m: FloatArray


Step = Callable[[int], FloatArray | None]
"""Solves a frame of the motion from the pose of the frame before; returns the pose, if it found one."""

Solve = Callable[[FloatArray, FloatArray, int], FloatArray]
"""Of a peer: from a pose and points, so many iterations, to the pose."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("--layout", metavar="NAME", default="han19", help="default %(default)s")
    parser.add_argument("--frames", metavar="N", type=int, default=1000, help="default %(default)s")
    parser.add_argument("--rate", metavar="HZ", type=float, default=120.0, help="default %(default)s")
    parser.add_argument("--iterations", metavar="N", type=int, default=5, help="default %(default)s")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="default %(default)s")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """One frame after the other along a performance, each from the pose of the last; all in turns of BLOCK frames, so
    that whatever else the machine does falls on everyone alike."""
    motion = _motion(arguments)
    n = arguments.iterations
    print(
        f"{n} iterations, {len(motion.layout.joints)} markers of {1e3 * NOISE_M:g} mm noise, "
        f"{len(motion.theta):,} frames at {arguments.rate:g} Hz, each from the pose of the last"
    )
    runs = {name: _Run(step, motion) for name, step in _ours(motion, n).items()}
    for count in HANDS:
        runs[f"full, {count} hands in one call"] = _Run(_together(motion, count, n), motion)
    apart: dict[str, float] = {}
    missing = []
    for name, make in _peers(motion).items():
        try:
            solve, hand = make()
        except ImportError:
            missing.append(name)
            continue
        apart[name] = _apart(motion, solve)
        runs[name] = _Run(_alone(motion, solve, n), motion, SHARES.get(name, 1))
        if hand is not None:
            runs[f"{name.partition(',')[0]} alone"] = _Run(_jacobians(hand, n), motion)
    for begin in range(1, len(motion.theta), BLOCK):
        for one in runs.values():
            one.advance(begin, begin + BLOCK)

    figures: dict[str, Any] = {name: one.figures() for name, one in runs.items()}
    full = figures["full"]["median_us"]
    print(f"{'':36}{'median':>11} {'99 % below':>14} {'ratio':>8} {'joints off':>11}")
    for name, of in figures.items():
        print(
            f"  {name:34}{of['median_us']:8.1f} us {of['p99_us']:11.1f} us {of['median_us'] / full:8.2f}"
            + (f"{1e3 * of['joints_off_m']:9.2f} mm" if "joints_off_m" in of else "")
        )
        if name in apart:
            of["apart_rad"] = apart[name]
            print(f"  {'':34}the same pose as ours when both have converged, to {apart[name]:.1e} rad")
    for name in missing:
        print(f"  {name:34}not installed: pip install 'phalanx[bench]'")
    return {"iterations": n, "layout": motion.layout.name, "seed": arguments.seed, **figures}


def _motion(arguments: argparse.Namespace) -> Motion:
    profile = load_profile(arguments.layout).with_sides(("right",))
    performer = Performer(profile, seed=arguments.seed)
    skeleton, layout = profile.hand.skeleton, profile.worn
    theta = np.stack([performer.theta("right", 2.0 + i / arguments.rate) for i in range(arguments.frames)])
    points = np.stack([markers_world(skeleton, one, layout.joints, layout.positions_m) for one in theta])
    points += np.random.default_rng(arguments.seed).normal(0.0, NOISE_M, points.shape)
    return Motion(skeleton, layout, theta, points)


def _ours(motion: Motion, iterations: int) -> dict[str, Step]:
    postures = np.stack([pose.angles_rad for pose in LIBRARY.values()])
    whole = subspace_of(postures, "library", dimensions=max(DIMENSIONS))
    options: dict[str, Any] = {"iterations": iterations, "tolerance": ALWAYS}
    weights = np.ones(len(motion.layout.joints))
    solver = HandSolver(motion.skeleton, motion.layout)
    probable = HandSolver(motion.skeleton, motion.layout, posture_prior(whole))

    def step(solve: Callable[[HandPose, FloatArray], object]) -> Step:
        pose = HandPose.at_rest(len(weights))
        pose.theta_rad[:] = motion.theta[0]

        def one(i: int) -> FloatArray:
            solve(pose, motion.points_m[i])
            return pose.theta_rad

        return one

    steps = {
        "full": step(lambda pose, x: solver.solve(pose, x, weights, **options)),
        "full, with a posture prior": step(lambda pose, x: probable.solve(pose, x, weights, **options)),
    }
    for count in DIMENSIONS:
        part = whole.truncated(count)
        steps[f"subspace 6 + {count}"] = step(
            lambda pose, x, part=part: solver.solve_subspace(pose, x, weights, part, **options)
        )
    part = whole.truncated(LAYERED_DIMENSIONS)
    name = f"layered, 6 + {LAYERED_DIMENSIONS} then full"
    steps[name] = step(lambda pose, x: solver.solve_layered(pose, x, weights, part, **options))
    steps["full and its uncertainty"] = step(
        lambda pose, x: (solver.solve(pose, x, weights, **options), solver.uncertainty(pose, weights, NOISE_M))
    )
    return steps


def _peers(motion: Motion) -> dict[str, Callable[[], tuple[Solve, Hand | None]]]:
    skeleton, layout = motion.skeleton, motion.layout
    weights = np.ones(len(layout.joints))

    def around(hand: Hand) -> tuple[Solve, Hand]:
        method = LevenbergMarquardt(hand, skeleton.limits_rad, REST_PRIOR)
        return lambda theta, x, n: method.solve(theta, x, weights, n), hand

    def trust_region() -> tuple[Solve, None]:
        method = ScipyHand(skeleton, layout, REST_PRIOR)
        return lambda theta, x, n: method.solve(theta, x, weights, n), None

    return {
        "MuJoCo's Jacobian, the same LM": lambda: around(MujocoHand(skeleton, layout)),
        "Pinocchio's Jacobian, the same LM": lambda: around(PinocchioHand(skeleton, layout)),
        "scipy, finite differences": trust_region,
    }


def _together(motion: Motion, count: int, iterations: int) -> Step:
    """`count` hands in one call, each with a motion of its own: the same one, each so many frames behind the other."""
    frames = len(motion.theta)
    lags = [k * frames // count for k in range(count)]
    solvers = [HandSolver(motion.skeleton, motion.layout) for _ in lags]
    poses = [HandPose.at_rest(len(motion.layout.joints)) for _ in lags]
    weights = [np.ones(len(motion.layout.joints))] * count
    for pose, lag in zip(poses, lags, strict=True):
        pose.theta_rad[:] = motion.theta[lag]

    def one(i: int) -> FloatArray:
        points = [motion.points_m[(i + lag) % frames] for lag in lags]
        solve_hands(solvers, poses, points, weights, iterations=iterations, tolerance=ALWAYS)
        return poses[0].theta_rad

    return one


def _alone(motion: Motion, solve: Solve, iterations: int) -> Step:
    theta = motion.theta[0]

    def one(i: int) -> FloatArray:
        nonlocal theta
        theta = solve(theta, motion.points_m[i], iterations)
        return theta

    return one


def _jacobians(hand: Hand, iterations: int) -> Step:
    """What of a peer's time is its own: markers and their Jacobian, once per iteration, without any method around."""
    still = np.zeros(26)

    def one(_: int) -> None:
        for _ in range(iterations):
            hand.moved(still)
            hand.jacobian()

    return one


class _Run:
    """One way to solve, along the motion; over its first 1/share."""

    def __init__(self, step: Step, motion: Motion, share: int = 1) -> None:
        self._step, self._motion = step, motion
        self._end = max(len(motion.theta) // share, 2)
        self._times: list[float] = []
        self._off: list[float] = []
        step(0)  # compiles, too

    def advance(self, begin: int, end: int) -> None:
        """Solve these frames."""
        motion = self._motion
        for i in range(begin, min(end, self._end)):
            started = perf_counter()
            theta = self._step(i)
            self._times.append(perf_counter() - started)
            if theta is not None:
                found, true = joints_world(motion.skeleton, theta), joints_world(motion.skeleton, motion.theta[i])
                self._off.append(float(np.linalg.norm((found - true)[1:, :3, 3], axis=1).mean()))

    def figures(self) -> dict[str, float]:
        """Times of a call, and how far the joints of the digits were from the truth."""
        times_us = 1e6 * np.asarray(self._times)
        figures = {"median_us": float(np.median(times_us)), "p99_us": float(np.percentile(times_us, 99))}
        return figures | {"joints_off_m": float(np.mean(self._off))} if self._off else figures


def _apart(motion: Motion, solve: Solve) -> float:
    """Largest difference [rad] of an angle between a peer's pose and ours, when both have arrived."""
    solver, weights = HandSolver(motion.skeleton, motion.layout), np.ones(len(motion.layout.joints))
    most = 0.0
    for i in np.linspace(0, len(motion.theta) - 1, 5).astype(int):
        pose = HandPose.at_rest(len(weights))
        pose.theta_rad[:] = motion.theta[i]
        solver.solve(pose, motion.points_m[i], weights, iterations=ALL_THE_WAY, tolerance=0.0)
        theirs = solve(motion.theta[i], motion.points_m[i], ALL_THE_WAY)
        most = max(most, float(np.abs(theirs[6:] - pose.theta_rad[6:]).max()))
    return most
