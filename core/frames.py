"""The records that flow from a device through the engine to the screen, the take and the exports.

Every record is immutable by convention: whoever receives one may keep it, nobody writes into it.
Lengths are metres, angles radians, times seconds, the world right-handed with Y up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
CodeArray = NDArray[np.int8]
"""Each an index into a tuple of words."""

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")

NO_ID = -1
"""Id of a point to which its device gives none."""

NO_POINT = -1
"""Source point of a marker that no point of the frame explains."""


@dataclass(frozen=True, slots=True)
class Times:
    """When a sample was taken, by three clocks.

    device_s: the device's own clock at exposure [s], NaN if it has none.
    host_s: the same instant mapped to this machine's monotonic clock [s].
    arrival_s: this machine's monotonic clock when the packet arrived [s].
    """

    device_s: float
    host_s: float
    arrival_s: float

    @property
    def latency_s(self) -> float:
        """From exposure to arrival on this machine [s]."""
        return self.arrival_s - self.host_s

    @property
    def known(self) -> bool:
        """Whether anything tells when the sample was taken."""
        return math.isfinite(self.host_s)

    @property
    def begins_s(self) -> float:
        """When the sample was taken or, where nothing tells that, when it arrived [s]: where a take begins."""
        return self.host_s if self.known else self.arrival_s


_BESIDE_S = 0.25


@dataclass(frozen=True, slots=True)
class Standstill:
    """A time in which this program did not run: what a device sent then waited, or is lost because nobody read it.

    from_s, to_s: by this machine's monotonic clock, in a take from its first frame [s]. seconds: how long it was [s]:
    more than to_s - from_s where the machine slept, and that clock with it. lost: frames that were sent then, and lost.
    """

    from_s: float
    to_s: float
    seconds: float
    lost: int = 0

    @property
    def reach_s(self) -> tuple[float, float]:
        """From when to when frames are missing because of it: what waited meanwhile is not read in an instant [s]."""
        return self.from_s - _BESIDE_S, self.to_s + _BESIDE_S


def stood_still(standstills: Sequence[Standstill]) -> str:
    """'Phalanx stood still for 12.0 s (the computer slept, or the program was halted)'."""
    often = f" {len(standstills):,} times," if len(standstills) > 1 else ""
    in_all = " in all" if often else ""
    seconds = sum(one.seconds for one in standstills)
    return f"Phalanx stood still{often} for {seconds:.1f} s{in_all} (the computer slept, or the program was halted)"


@dataclass(frozen=True, slots=True)
class RigidBody:
    """One rigid body as a device reports it.

    position_m: (3,) float64 [m], world. quaternion_wxyz: (4,) float64, unit, body to world.
    tracked: False if the device holds the last pose. mean_error_m: mean marker error [m], NaN if unknown.
    """

    id: int
    name: str
    position_m: FloatArray
    quaternion_wxyz: FloatArray
    tracked: bool = True
    mean_error_m: float = float("nan")


@dataclass(frozen=True, slots=True)
class MarkerFrame:
    """One sample of an optical device.

    sequence: the device's own frame number; a step greater than one is a loss before this machine.
    points_m: (n, 3) float64 [m], world.
    ids: (n,) int64, the device's own ids, stable only while a marker is seen without a break; NO_ID for none.
    residuals_m: (n,) float64 [m], triangulation residual, NaN where unknown.
    timecode: SMPTE, "hh:mm:ss:ff", as the device says it; "" for none.
    """

    sequence: int
    times: Times
    points_m: FloatArray
    ids: IntArray
    residuals_m: FloatArray
    rigid_bodies: tuple[RigidBody, ...] = ()
    timecode: str = ""


BONE_STATES = ("", "measured", "inferred", "held", "disturbed")
"""How a bone's rotation came about: `InertialFrame.state`.

"": the device does not say. "measured": by the bone's own sensor. "inferred": by the device, from other sensors.
"held": its sensor is silent, and this is the last one. "disturbed": measured in a magnetic field that turns it.
"""


@dataclass(frozen=True, slots=True)
class InertialFrame:
    """One sample of an inertial glove, or of a suit.

    bone_names: as the device names them.
    rotations_wxyz: (n, 4) float64, unit, in the frame that the stream's StreamInfo.rotations says.
    side: the hand that it is worn on, None if on both, or if nobody knows.
    positions_m: (n, 3) float64 [m], in the parent's frame where rotations are, else in the world.
    angular_radps: (n, 3) float64 [rad/s]. acceleration_mps2: (n, 3) float64 [m/s^2].
        Of all three NaN where there is none; not given, all of it.
    state: (n,) int8, index into BONE_STATES; not given, all 0.
    """

    sequence: int
    times: Times
    bone_names: tuple[str, ...]
    rotations_wxyz: FloatArray
    side: Side | None = None
    positions_m: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    angular_radps: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    acceleration_mps2: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    state: CodeArray = field(default_factory=lambda: np.zeros(0, dtype=np.int8))

    def __post_init__(self) -> None:
        """What is not given is unknown, of every bone."""
        n = len(self.rotations_wxyz)
        for name in ("positions_m", "angular_radps", "acceleration_mps2"):
            if not len(getattr(self, name)):
                object.__setattr__(self, name, np.full((n, 3), np.nan))
        if not len(self.state):
            object.__setattr__(self, "state", np.zeros(n, dtype=np.int8))


WHY_LOST = (
    "",
    "no points",
    "too few markers",
    "out of shape",
    "two hands alike",
    "searching",
    "left the volume",
)
"""Why a hand is not tracked: `HandFrame.why`.

"": it is tracked and its labels stand. "no points": no point is free where it could be. "too few markers": there are
points, too few for a hand. "out of shape": there are enough, but no hand of this performer fits them. "two hands
alike": what is there fits two hands that are missing equally well. "searching": points are being tried; or, of a
tracked hand, its labels are doubted and others are being looked for. "left the volume": it was moving when its markers
vanished, all together, and nothing has appeared since.
"""


SAID_BY = ("", "points", "motion", "postures", "network", "glove", "gap")
"""Who says a number of a hand: `HandFrame.angle_source`, `marker_source` and `held_by`.

"": nobody noted it. "points": those of the frame. "motion": the motion before, carried on. "postures": what hands
usually do. "network": one that was trained. "glove": an inertial one. "gap": the curve that fills a gap.
"""


class HandState(Enum):
    """What the engine knows of a hand."""

    SEARCHING = "searching"  # never found since the start or the last reset
    TRACKED = "tracked"
    LOST = "lost"  # was tracked; the pose held is the last one


class HandKey(NamedTuple):
    """One hand among those of all performers: the index of its profile, and its side. Sorted as the engine has them."""

    performer: int
    side: Side


@dataclass(frozen=True, slots=True)
class HandFrame:
    """One hand in one solved frame. Poses of a hand that is not tracked are the last ones known.

    theta_rad: (26,) float64; 0:3 wrist position [m], 3:6 global rotation as a rotation vector [rad],
        6: four joint angles per digit, thumb to pinky [rad] (core.hand.skeleton.DOF_NAMES).
    joints_world: (16, 4, 4) float64, joint frames in the world (translation [m]).
    markers_world_m: (m, 3) float64 [m], in the order of the profile's layout: the observed point where there
        is one, else the model's prediction.
    point: (m,) int64, index of the source point in the MarkerFrame, NO_POINT if predicted.
    confidence: (m,) float64 in 0..1.
    theta_std: (26,) float64, one standard deviation of each parameter of theta_rad [m for 0:3, rad for the others],
        NaN where unknown.
    marker_std_m: (m,) float64 [m], expected error of each position of markers_world_m: root of the variance summed
        over the three axes, NaN where unknown.
    rms_m: root mean square distance of observed points to the model's markers [m], NaN if none.
    scale: uniform hand scale, 1 = the template.
    performer: index of the hand's profile among those of the engine or the take, 0 where there is one.
    label_confidence: (m,) float64 in 0..1, probability that a marker's point is its own; of a hidden marker, that it is
        hidden. NaN where unknown, as in older takes and while the hand is not tracked.
    why: one of WHY_LOST, while the hand is not tracked or its labels are doubted.
    filled: (26,) bool, which of theta_rad are a gap's curve, not the engine's (core.gap_filling); (0,): none.
    angle_source: (20,) int8, who says each joint angle, index into SAID_BY; (0,): nobody noted it.
    marker_source: (m,) int8, who says each position of markers_world_m, likewise.
    held_by: one of SAID_BY, who holds the hand as a whole.
    """

    side: Side
    state: HandState
    theta_rad: FloatArray
    joints_world: FloatArray
    markers_world_m: FloatArray
    point: IntArray
    confidence: FloatArray
    theta_std: FloatArray
    marker_std_m: FloatArray
    rms_m: float
    scale: float = 1.0
    performer: int = 0
    label_confidence: FloatArray = field(default_factory=lambda: np.empty(0))
    why: str = ""
    filled: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    angle_source: CodeArray = field(default_factory=lambda: np.zeros(0, dtype=np.int8))
    marker_source: CodeArray = field(default_factory=lambda: np.zeros(0, dtype=np.int8))
    held_by: str = ""

    def __post_init__(self) -> None:
        """No probabilities given: unknown for every marker."""
        if len(self.label_confidence) != len(self.point):
            object.__setattr__(self, "label_confidence", np.full(len(self.point), np.nan))

    @property
    def key(self) -> HandKey:
        """Which hand this is, among those of all performers."""
        return HandKey(self.performer, self.side)

    @property
    def observed(self) -> BoolArray:
        """(m,) bool, which markers a point of the frame explains."""
        observed: BoolArray = self.point != NO_POINT
        return observed


@dataclass(frozen=True, slots=True)
class PropFrame:
    """A prop of the profile. One that is not tracked holds its last pose.

    transform_world: (4, 4) float64, translation [m].
    point: (m,) int64, index in the MarkerFrame of the point of each of its markers, NO_POINT if not seen; (0,) where
        unknown. A prop that was just lost may still have some.
    rms_m: root mean square distance of those points to the markers [m], NaN if not tracked or unknown.
    markers_world_m: (m, 3) float64 [m], the observed point where there is one, else where the pose puts the marker.
    """

    name: str
    transform_world: FloatArray
    tracked: bool
    point: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    rms_m: float = float("nan")
    markers_world_m: FloatArray = field(default_factory=lambda: np.empty((0, 3)))


@dataclass(frozen=True, slots=True)
class TrackedFrame:
    """What the engine says of one instant.

    sequence, times: of the MarkerFrame that it was made of.
    stage_s: seconds spent per stage, by name, in order.
    at_host_s: the instant that it is of, by this machine's monotonic clock [s]; NaN: that of `times`.
    of: what it was made of, stream and sequence of each frame; (): the MarkerFrame of this sequence alone.
    """

    sequence: int
    times: Times
    hands: tuple[HandFrame, ...]
    props: tuple[PropFrame, ...] = ()
    stage_s: dict[str, float] = field(default_factory=dict)
    at_host_s: float = float("nan")
    of: tuple[tuple[str, int], ...] = ()
