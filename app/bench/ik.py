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


Step = Callable[[FloatArray, FloatArray], FloatArray]
"""From the pose before and the points of a frame to the pose."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("--layout", metavar="NAME", default="han19", help="default %(default)s")
    parser.add_argument("--frames", metavar="N", type=int, default=1000, help="default %(default)s")
    parser.add_argument("--rate", metavar="HZ", type=float, default=120.0, help="default %(default)s")
    parser.add_argument("--iterations", metavar="N", type=int, default=5, help="default %(default)s")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="default %(default)s")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """One frame after the other along a performance, each from the pose of the last."""
    motion = _motion(arguments)
    n = arguments.iterations
    print(
        f"{n} iterations, {len(motion.layout.joints)} markers of {1e3 * NOISE_M:g} mm noise, "
        f"{len(motion.theta):,} frames at {arguments.rate:g} Hz, each from the pose of the last"
    )
    print(f"{'':34}{'median':>9} {'99 % below':>11} {'ratio':>7} {'joints off':>11}")
    ours = {name: _measure(step, motion) for name, step in _ours(motion, n).items()}
    full = ours["full"]["median_us"]
    for name, figures in ours.items():
        _print(name, figures, full)
    hands = {f"{count} hands": _measure_hands(motion, count, n) for count in HANDS}
    for name, figures in hands.items():
        _print(f"full, {name} in one call", figures, full)

    peers: dict[str, Any] = {}
    for name, make in _peers(motion).items():
        try:
            solve = make()
        except ImportError:
            print(f"  {name:32}not installed: pip install 'phalanx[bench]'")
            continue
        share = 1 if name.startswith(("MuJoCo", "Pinocchio")) else 20
        peers[name] = _measure(lambda theta, x, solve=solve: solve(theta, x, n), motion, share)
        peers[name]["apart_rad"] = _apart(motion, solve)
        _print(name, peers[name], full)
        print(f"  {'':32}same pose when both have converged, to {peers[name]['apart_rad']:.1e} rad")
    return {"iterations": n, "layout": motion.layout.name, "seed": arguments.seed, **ours, **hands, **peers}


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
    pose = HandPose.at_rest(len(weights))
    solver = HandSolver(motion.skeleton, motion.layout)
    probable = HandSolver(motion.skeleton, motion.layout, posture_prior(whole))

    def step(solve: Callable[[FloatArray], None]) -> Step:
        def one(theta: FloatArray, points_m: FloatArray) -> FloatArray:
            if theta is not pose.theta_rad:
                pose.theta_rad[:] = theta
            solve(points_m)
            return pose.theta_rad

        return one

    steps = {
        "full": step(lambda x: solver.solve(pose, x, weights, **options)),
        "full, with a posture prior": step(lambda x: probable.solve(pose, x, weights, **options)),
    }
    for count in DIMENSIONS:
        part = whole.truncated(count)
        steps[f"subspace 6 + {count}"] = step(
            lambda x, part=part: solver.solve_subspace(pose, x, weights, part, **options)
        )
    part = whole.truncated(LAYERED_DIMENSIONS)
    name = f"layered, 6 + {LAYERED_DIMENSIONS} then full"
    steps[name] = step(lambda x: solver.solve_layered(pose, x, weights, part, **options))
    steps["full and its uncertainty"] = step(
        lambda x: (solver.solve(pose, x, weights, **options), solver.uncertainty(pose, weights, NOISE_M))[0]
    )
    return steps


def _peers(motion: Motion) -> dict[str, Callable[[], Callable[[FloatArray, FloatArray, int], FloatArray]]]:
    skeleton, layout = motion.skeleton, motion.layout
    weights = np.ones(len(layout.joints))

    def around(hand: Hand) -> Callable[[FloatArray, FloatArray, int], FloatArray]:
        method = LevenbergMarquardt(hand, skeleton.limits_rad, REST_PRIOR)
        return lambda theta, x, n: method.solve(theta, x, weights, n)

    def trust_region() -> Callable[[FloatArray, FloatArray, int], FloatArray]:
        method = ScipyHand(skeleton, layout, REST_PRIOR)
        return lambda theta, x, n: method.solve(theta, x, weights, n)

    return {
        "MuJoCo's Jacobian, the same LM": lambda: around(MujocoHand(skeleton, layout)),
        "Pinocchio's Jacobian, the same LM": lambda: around(PinocchioHand(skeleton, layout)),
        "scipy, finite differences": trust_region,
    }


def _measure(step: Step, motion: Motion, share: int = 1) -> dict[str, float]:
    """Over the first 1/share of the frames."""
    count = max(len(motion.theta) // share, 2)
    theta = motion.theta[0].copy()
    for _ in range(3):
        step(theta, motion.points_m[0])  # compiled, and in the processor's cache
    theta = step(motion.theta[0].copy(), motion.points_m[0])
    times, off = [], []
    for true, points in zip(motion.theta[1:count], motion.points_m[1:count], strict=True):
        started = perf_counter()
        theta = step(theta, points)
        times.append(perf_counter() - started)
        apart = joints_world(motion.skeleton, theta)[1:, :3, 3] - joints_world(motion.skeleton, true)[1:, :3, 3]
        off.append(np.linalg.norm(apart, axis=1).mean())
    return _figures(times) | {"joints_off_m": float(np.mean(off))}


def _measure_hands(motion: Motion, count: int, iterations: int) -> dict[str, float]:
    """`count` hands along the same motion, each so many frames behind the other."""
    solvers = [HandSolver(motion.skeleton, motion.layout) for _ in range(count)]
    poses = [HandPose.at_rest(len(motion.layout.joints)) for _ in range(count)]
    weights = [np.ones(len(motion.layout.joints))] * count
    lag = len(motion.theta) // (2 * count)
    for k, pose in enumerate(poses):
        pose.theta_rad[:] = motion.theta[k * lag]
    times = []
    for i in range(len(motion.theta) - count * lag):
        points = [motion.points_m[i + k * lag] for k in range(count)]
        started = perf_counter()
        solve_hands(solvers, poses, points, weights, iterations=iterations, tolerance=ALWAYS)
        times.append(perf_counter() - started)
    return _figures(times[1:])


def _apart(motion: Motion, solve: Callable[[FloatArray, FloatArray, int], FloatArray]) -> float:
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


def _figures(times_s: list[float]) -> dict[str, float]:
    return {"median_us": 1e6 * float(np.median(times_s)), "p99_us": 1e6 * float(np.percentile(times_s, 99))}


def _print(name: str, figures: dict[str, float], full_us: float) -> None:
    off = f"{1e3 * figures['joints_off_m']:8.2f} mm" if "joints_off_m" in figures else ""
    print(
        f"  {name:32}{figures['median_us']:6.1f} us {figures['p99_us']:8.1f} us "
        f"{figures['median_us'] / full_us:7.2f} {off}"
    )
