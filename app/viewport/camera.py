"""The orbit camera of the viewport: where it stands, what it looks at, and where a point lands on the screen."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from core.frames import FloatArray

FIELD_OF_VIEW_RAD = math.radians(32.0)
DISTANCE_RANGE_M = (0.08, 60.0)
_ELEVATION_LIMIT_RAD = math.pi / 2


@dataclass
class OrbitCamera:
    """Turns about a target, with the world's Y axis always up on the screen.

    target_m: (3,) float64 [m], world. distance_m: eye to target [m]. azimuth_rad: 0 looks along -Z, a quarter
    turn looks along -X. elevation_rad: 0 is level, a quarter turn looks straight down.
    """

    target_m: FloatArray = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))
    distance_m: float = 1.6
    azimuth_rad: float = math.radians(35.0)
    elevation_rad: float = math.radians(22.0)

    def orbit(self, right_rad: float, up_rad: float) -> None:
        """Turn about the target; the elevation stops at straight up and straight down."""
        self.azimuth_rad = math.remainder(self.azimuth_rad + right_rad, math.tau)
        self.elevation_rad = float(np.clip(self.elevation_rad + up_rad, -_ELEVATION_LIMIT_RAD, _ELEVATION_LIMIT_RAD))

    def pan(self, right: float, up: float) -> None:
        """Move the target across the screen, in units of the screen's height at the target's distance."""
        rotation = self._rotation()
        height_m = 2.0 * self.distance_m * math.tan(FIELD_OF_VIEW_RAD / 2)
        self.target_m = self.target_m + (rotation[0] * right + rotation[1] * up) * height_m

    def zoom(self, factor: float) -> None:
        """Multiply the distance to the target, within DISTANCE_RANGE_M."""
        low, high = DISTANCE_RANGE_M
        self.distance_m = min(max(self.distance_m * factor, low), high)

    def look_from(self, azimuth_rad: float, elevation_rad: float) -> None:
        """Look at the same target from another direction."""
        self.azimuth_rad, self.elevation_rad = azimuth_rad, elevation_rad

    def fit(self, points_m: FloatArray, aspect: float) -> None:
        """Bring all points into view, whatever the direction. points_m: (n, 3) float64 [m], n >= 1."""
        low, high = points_m.min(axis=0), points_m.max(axis=0)
        self.target_m = (low + high) / 2
        radius_m = max(float(np.linalg.norm(points_m - self.target_m, axis=1).max()), 0.06)
        half_angle = math.atan(math.tan(FIELD_OF_VIEW_RAD / 2) * min(1.0, aspect))
        self.distance_m = min(max(1.08 * radius_m / math.sin(half_angle), DISTANCE_RANGE_M[0]), DISTANCE_RANGE_M[1])

    def eye_m(self) -> FloatArray:
        """(3,) float64 [m], where the camera stands."""
        return self.target_m + self._rotation()[2] * self.distance_m

    def view(self) -> FloatArray:
        """(4, 4) float64, world to camera (looking along -Z, Y up)."""
        matrix = np.eye(4)
        matrix[:3, :3] = self._rotation()
        matrix[:3, 3] = -matrix[:3, :3] @ self.eye_m()
        return matrix

    def projection(self, aspect: float) -> FloatArray:
        """(4, 4) float64, camera to clip space. aspect: width over height."""
        f = 1.0 / math.tan(FIELD_OF_VIEW_RAD / 2)
        near, far = self.distance_m * 0.03, self.distance_m * 12.0 + 30.0
        matrix = np.zeros((4, 4))
        matrix[0, 0], matrix[1, 1] = f / aspect, f
        matrix[2, 2], matrix[2, 3] = (far + near) / (near - far), 2.0 * far * near / (near - far)
        matrix[3, 2] = -1.0
        return matrix

    def project(self, points_m: FloatArray, size: tuple[float, float]) -> FloatArray:
        """Where points land on a screen of `size` (width, height) pixels.

        points_m: (n, 3) float64 [m]. Returns (n, 3) float64: x to the right and y down in pixels, then the
        depth in front of the eye [m]; a depth of 0 or less is behind the camera, its x and y mean nothing.
        """
        width, height = size
        homogeneous = np.concatenate([points_m, np.ones((len(points_m), 1))], axis=1)
        clip = homogeneous @ (self.projection(width / height) @ self.view()).T
        depth_m = clip[:, 3]
        w = np.where(np.abs(depth_m) < 1e-9, 1e-9, depth_m)
        x = (clip[:, 0] / w + 1.0) * width / 2
        y = (1.0 - clip[:, 1] / w) * height / 2
        return np.stack([x, y, depth_m], axis=1)

    def pixels_per_metre(self, depth_m: float, height_px: float) -> float:
        """On a screen of this height, of things this far in front of the eye."""
        return 0.5 * height_px / (math.tan(FIELD_OF_VIEW_RAD / 2) * depth_m)

    def _rotation(self) -> FloatArray:
        """(3, 3) float64, rows: right, up and backward of the camera in the world."""
        sa, ca = math.sin(self.azimuth_rad), math.cos(self.azimuth_rad)
        se, ce = math.sin(self.elevation_rad), math.cos(self.elevation_rad)
        return np.array([[ca, 0.0, -sa], [-sa * se, ce, -ca * se], [sa * ce, se, ca * ce]])
