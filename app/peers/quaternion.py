"""A rotation vector as the quaternion that other libraries hold, and back."""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

from core.frames import FloatArray


def quaternion(vector: FloatArray) -> tuple[float, float, float, float]:
    """w, x, y, z of a rotation vector (3,) [rad]."""
    x, y, z = map(float, vector)
    angle = sqrt(x * x + y * y + z * z)
    factor = sin(0.5 * angle) / angle if angle > 1e-12 else 0.5
    return cos(0.5 * angle), factor * x, factor * y, factor * z


def rotation_vector(w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """The rotation vector [rad] of a unit quaternion, no longer than pi."""
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    length = sqrt(x * x + y * y + z * z)
    factor = 2.0 * atan2(length, w) / length if length > 1e-12 else 2.0
    return factor * x, factor * y, factor * z
