"""The names and order of joints and degrees of freedom, and the skeleton they move.

16 joints and 26 parameters as in Schröder 2017 ("Motion reconstruction") and Han 2018 (4.1): six for the
wrist in the world, four for each digit.

The hand frame is that of a right hand lying flat, palm down: +Y dorsal, -Z distal (to the fingertips),
+X ulnar (to the little finger), origin at the wrist. At rest every joint frame has the orientation of the
hand frame, so a rest transform is a translation. A left hand is the mirror image in x (core.hand.mirror).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import FloatArray

DIGITS = ("thumb", "index", "middle", "ring", "pinky")

JOINT_NAMES = (
    "wrist",
    "thumb_cmc", "thumb_mcp", "thumb_ip",
    "index_mcp", "index_pip", "index_dip",
    "middle_mcp", "middle_pip", "middle_dip",
    "ring_mcp", "ring_pip", "ring_dip",
    "pinky_mcp", "pinky_pip", "pinky_dip",
)  # fmt: skip
JOINT_PARENTS = (-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 0, 10, 11, 0, 13, 14)
N_JOINTS = 16
TIP_NAMES = tuple(f"{digit}_tip" for digit in DIGITS)
TIP_JOINTS = (3, 6, 9, 12, 15)
"""The last joint of each digit, which carries its tip."""

ROOT_DOF_NAMES = ("wrist_x_m", "wrist_y_m", "wrist_z_m", "wrist_rx", "wrist_ry", "wrist_rz")
DIGIT_DOF_NAMES = (
    "thumb_cmc_flexion", "thumb_cmc_abduction", "thumb_mcp_flexion", "thumb_ip_flexion",
    "index_mcp_abduction", "index_mcp_flexion", "index_pip_flexion", "index_dip_flexion",
    "middle_mcp_abduction", "middle_mcp_flexion", "middle_pip_flexion", "middle_dip_flexion",
    "ring_mcp_abduction", "ring_mcp_flexion", "ring_pip_flexion", "ring_dip_flexion",
    "pinky_mcp_abduction", "pinky_mcp_flexion", "pinky_pip_flexion", "pinky_dip_flexion",
)  # fmt: skip
DOF_NAMES = ROOT_DOF_NAMES + DIGIT_DOF_NAMES
N_ROOT_DOFS = 6
N_DOFS = 26

DOF_JOINTS = (1, 1, 2, 3, 4, 4, 5, 6, 7, 7, 8, 9, 10, 10, 11, 12, 13, 13, 14, 15)
"""Joint turned by each of the 20 digit angles. Where a joint has two, the first listed is applied first
(outermost): its axis is fixed in the parent, the second turns with it."""


@dataclass(frozen=True)
class Skeleton:
    """A right hand's joints and axes.

    joint_positions_m: (16, 3) float64 [m], joint centres at rest in the hand frame; the wrist is the origin.
    tip_positions_m: (5, 3) float64 [m], the fleshy end of each digit at rest, in the hand frame.
    axes: (20, 3) float64, unit, axis of each digit angle at rest in the hand frame; positive flexion closes
        the hand, positive abduction leads away from the middle finger (the middle finger: towards the thumb; the
        thumb: away from the palm).
    limits_rad: (20, 2) float64 [rad], lower and upper bound of each digit angle.
    """

    joint_positions_m: FloatArray
    tip_positions_m: FloatArray
    axes: FloatArray
    limits_rad: FloatArray

    def scaled(self, scale: float) -> Skeleton:
        """The same hand, uniformly larger by `scale`."""
        return Skeleton(self.joint_positions_m * scale, self.tip_positions_m * scale, self.axes, self.limits_rad)

    @property
    def length_m(self) -> float:
        """From the wrist to the tip of the middle finger at rest, along the hand [m]."""
        return -float(self.tip_positions_m[2, 2])

    @property
    def bone_lengths_m(self) -> FloatArray:
        """(16,) float64 [m], distance of each joint to its parent; 0 for the wrist."""
        parents = np.maximum(np.asarray(JOINT_PARENTS), 0)
        lengths: FloatArray = np.linalg.norm(self.joint_positions_m - self.joint_positions_m[parents], axis=1)
        return lengths
