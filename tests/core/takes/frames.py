"""Random frames of every kind, and equality to the last bit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.frames import (
    BONE_STATES,
    SAID_BY,
    HandFrame,
    HandState,
    InertialFrame,
    MarkerFrame,
    PropFrame,
    RigidBody,
    Side,
    Times,
    TrackedFrame,
)
from core.streams import ClockSample, StreamInfo

BONES = ("RightHand", *(f"RightHand{digit}{i}" for digit in ("Thumb", "Index", "Middle", "Ring") for i in range(4)))
OPTICAL = StreamInfo("natnet-1/markers", "natnet", "Motive 3.1", "markers", 120.0, "sight", "residual", clock_hz=1e7)
GLOVE = StreamInfo(
    "neuron-1/right", "neuron", "Perception Neuron", "inertial", 60.0, rotations="parent", bone_names=BONES,
    sides=("right",), axes="right-handed, Y up",
)  # fmt: skip
OTHER = StreamInfo("natnet-2/markers", "natnet", "Motive 2.3", "markers", 100.0, "marker", "condition")

SPECIAL = np.array([0.0, -0.0, np.nan, -np.nan, np.inf, -np.inf, 5e-324, 1.7976931348623157e308, 0.1])


def floats(rng: np.random.Generator, *shape: int) -> NDArray[np.float64]:
    """Any float64 at all: ordinary ones, special ones, and random bit patterns (with NaNs of every payload)."""
    kind = rng.integers(3, size=shape)
    patterns = rng.integers(0, 2**64, size=shape, dtype=np.uint64).view(np.float64)
    # A signalling NaN may become quiet in any register on its way: that bit alone is not kept by arithmetic units.
    patterns = np.where(np.isnan(patterns), np.nan, patterns)
    return np.choose(kind, [rng.normal(size=shape), rng.choice(SPECIAL, size=shape), patterns])


def deviations(rng: np.random.Generator, n: int) -> NDArray[np.float64]:
    """What single precision holds, some of it or all of it unknown."""
    values = np.abs(rng.normal(size=n)).astype(np.float32).astype(np.float64)
    return np.where(rng.random(n) < rng.choice([0.0, 0.3, 1.0]), np.nan, values)


def scalar(rng: np.random.Generator) -> float:
    return float(floats(rng, 1)[0])


def times(rng: np.random.Generator) -> Times:
    return Times(scalar(rng), scalar(rng), scalar(rng))


def marker_frame(rng: np.random.Generator) -> MarkerFrame:
    n = int(rng.integers(0, 40))
    return MarkerFrame(
        sequence=int(rng.integers(-(2**63), 2**63)),
        times=times(rng),
        points_m=floats(rng, n, 3),
        ids=rng.integers(-(2**63), 2**63, n, dtype=np.int64),
        residuals_m=floats(rng, n),
        rigid_bodies=tuple(
            RigidBody(
                int(rng.integers(-5, 99)), name, floats(rng, 3), floats(rng, 4), bool(rng.integers(2)), scalar(rng)
            )
            for name in ("", "Schläger", "手")[: rng.integers(4)]
        ),
        timecode=("", "01:02:03:04", "手")[rng.integers(3)],
    )


def unknown(rng: np.random.Generator, n: int) -> NDArray[np.float64]:
    """(n, 3), in half of the cases with nothing known at all."""
    values = floats(rng, n, 3)
    values[:1, :1] = 0.5
    return values if rng.random() < 0.5 else np.full((n, 3), np.nan)


def codes(rng: np.random.Generator, n: int, words: tuple[str, ...]) -> NDArray[np.int8]:
    """Indices into words, of which one at least is known."""
    found = rng.integers(0, len(words), n).astype(np.int8)
    found[:1] = len(words) - 1
    return found


def inertial_frame(rng: np.random.Generator) -> InertialFrame:
    n = int(rng.integers(0, 60))
    return InertialFrame(
        sequence=int(rng.integers(-(2**63), 2**63)),
        times=times(rng),
        bone_names=tuple(("RightHandThumb", "", "手")[i % 3] + str(i) for i in range(n)),
        rotations_wxyz=floats(rng, n, 4),
        side=(None, "left", "right")[rng.integers(3)],
        positions_m=unknown(rng, n),
        angular_radps=unknown(rng, n),
        acceleration_mps2=unknown(rng, n),
        state=(np.zeros(n, np.int8), codes(rng, n, BONE_STATES))[rng.integers(2)],
    )


def clock_sample(rng: np.random.Generator) -> ClockSample:
    return ClockSample(scalar(rng), scalar(rng), scalar(rng))


def hand_frame(rng: np.random.Generator, side: Side, performers: int = 3) -> HandFrame:
    m = int(rng.integers(0, 20))
    return HandFrame(
        side=side,
        state=list(HandState)[rng.integers(3)],
        theta_rad=floats(rng, 26),
        joints_world=floats(rng, 16, 4, 4),
        markers_world_m=floats(rng, m, 3),
        point=rng.integers(-1, 40, m, dtype=np.int64),
        confidence=floats(rng, m),
        theta_std=deviations(rng, 26),
        marker_std_m=deviations(rng, m),
        rms_m=scalar(rng),
        scale=scalar(rng),
        performer=int(rng.integers(0, performers)),
        label_confidence=deviations(rng, m),
        why=("", "out of shape", "手")[rng.integers(3)],
        filled=(np.zeros(0, dtype=np.bool_), np.arange(26) < 3, np.arange(26) == rng.integers(26))[rng.integers(3)],
        angle_source=(np.zeros(0, dtype=np.int8), codes(rng, 20, SAID_BY))[rng.integers(2)],
        marker_source=(np.zeros(0, dtype=np.int8), codes(rng, m, SAID_BY))[rng.integers(2)],
        held_by=SAID_BY[rng.integers(len(SAID_BY))],
    )


def prop_frame(rng: np.random.Generator, name: str) -> PropFrame:
    m = int(rng.integers(0, 6))
    point = rng.integers(-1, 40, m, dtype=np.int64)
    transform, tracked = floats(rng, 4, 4), bool(rng.integers(2))
    if m == 0:
        return PropFrame(name, transform, tracked)
    return PropFrame(name, transform, tracked, point, scalar(rng), floats(rng, m, 3))


def tracked_frame(rng: np.random.Generator, performers: int = 3) -> TrackedFrame:
    sides: tuple[Side, ...] = ("right", "left")
    return TrackedFrame(
        sequence=int(rng.integers(-(2**63), 2**63)),
        times=times(rng),
        hands=tuple(hand_frame(rng, side, performers) for side in sides[: rng.integers(3)]),
        props=tuple(prop_frame(rng, name) for name in ("box", "")[: rng.integers(3)]),
        stage_s={name: scalar(rng) for name in ("solve", "cluster", "label")[: rng.integers(4)]},
        at_host_s=np.nan if np.isnan(at_host_s := scalar(rng)) else at_host_s,
        of=tuple((key, int(rng.integers(-(2**63), 2**63))) for key in ("a/markers", "手")[: rng.integers(3)]),
    )


def plain_frame(i: int, n: int = 5, rate_hz: float = 120.0) -> MarkerFrame:
    """Frame i of a recording without surprises."""
    t = i / rate_hz
    return MarkerFrame(
        i, Times(t, 1000 + t, 1000.002 + t), np.full((n, 3), float(i)), np.arange(n, dtype=np.int64), np.full(n, np.nan)
    )


def plain_bones(i: int, n: int = 17, rate_hz: float = 60.0) -> InertialFrame:
    """Frame i of a glove of n bones, without surprises."""
    t = i / rate_hz
    return InertialFrame(
        i, Times(t, 1000 + t, 1000.01 + t), BONES[:n], np.full((n, 4), i / 7), "right", np.full((n, 3), float(i))
    )


def plain_sample(i: int) -> ClockSample:
    """A clock sample every second."""
    return ClockSample(float(i), 1000.5 + i, 1e-4 * i)


def plain_solved(i: int, rate_hz: float = 120.0) -> TrackedFrame:
    t = i / rate_hz
    return TrackedFrame(i, Times(t, 1000 + t, 1000.002 + t), (), (), {"solve": 1e-4})


def bits(value: object) -> object:
    """A value in which every float is its bit pattern, to compare by ==."""
    if isinstance(value, float):
        return np.float64(value).tobytes()
    if isinstance(value, np.ndarray):
        return (value.dtype.str, value.shape, value.tobytes())
    if isinstance(value, dict):
        return [(key, bits(item)) for key, item in value.items()]
    if isinstance(value, tuple):
        return tuple(bits(item) for item in value)
    if hasattr(value, "__dataclass_fields__"):
        return type(value).__name__, {name: bits(getattr(value, name)) for name in value.__dataclass_fields__}
    return value
