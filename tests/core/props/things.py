"""Props and clouds of points with known truth."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import FloatArray, IntArray, MarkerFrame, RigidBody, Times
from core.props.prop import Prop, PropModel

PEN = Prop(
    "pen",
    1e-3 * np.array([[0.0, 4, -70], [15, -12, -20], [-16, 4, 22], [22, 6, 55], [0, 0, 70]]),
    PropModel("cylinder", (0.010, 0.15)),
)
BALL = Prop("ball", 0.04 * np.eye(3)[[0, 1, 2]] @ np.diag([1.0, -1.0, 1.0]), PropModel("sphere", (0.08,)))
SQUARE = Prop("square", 0.03 * np.array([[1.0, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]), PropModel("none"))


def pose(random: np.random.Generator, reach_m: float = 0.5) -> FloatArray:
    transform = np.eye(4)
    transform[:3, :3] = Rotation.random(rng=random).as_matrix()
    transform[:3, 3] = random.uniform(-reach_m, reach_m, 3)
    return transform


def path(time_s: float, speed: float = 1.0) -> FloatArray:
    """Somewhere on a swinging, turning way: up to some 0.5 m/s and 3 rad/s at speed 1."""
    t = speed * time_s
    transform = np.eye(4)
    transform[:3, :3] = Rotation.from_rotvec(
        [1.2 * np.sin(1.7 * t), 0.8 * np.cos(2.1 * t), 2.0 * np.sin(0.9 * t)]
    ).as_matrix()
    transform[:3, 3] = [0.2 * np.sin(1.3 * t), 1.0 + 0.1 * np.sin(2.3 * t), -0.4 + 0.15 * np.cos(1.1 * t)]
    return transform


def apart(one: FloatArray, other: FloatArray) -> tuple[float, float]:
    """Distance of two poses' origins [m] and angle between them [rad]."""
    turn = Rotation.from_matrix(one[:3, :3].T @ other[:3, :3]).magnitude()
    return float(np.linalg.norm(one[:3, 3] - other[:3, 3])), float(turn)


def frame(
    i: int, points_m: FloatArray, ids: IntArray, bodies: tuple[RigidBody, ...] = (), rate_hz: float = 120.0
) -> MarkerFrame:
    t = i / rate_hz
    return MarkerFrame(i, Times(t, t, t), points_m, ids, np.zeros(len(ids)), bodies)
