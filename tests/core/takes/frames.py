"""Random frames of every kind, and equality to the last bit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.frames import (
    HandFrame,
    HandState,
    MarkerFrame,
    PropFrame,
    RigidBody,
    Side,
    Times,
    TrackedFrame,
)

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
    )


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
    )


def plain_frame(i: int, n: int = 5, rate_hz: float = 120.0) -> MarkerFrame:
    """Frame i of a recording without surprises."""
    t = i / rate_hz
    return MarkerFrame(
        i, Times(t, 1000 + t, 1000.002 + t), np.full((n, 3), float(i)), np.arange(n, dtype=np.int64), np.full(n, np.nan)
    )


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
