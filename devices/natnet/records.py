"""The records of a NatNet frame, as they are on the wire."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntFlag
from typing import Any

import numpy as np
from numpy.typing import NDArray

RIGID_BODY = np.dtype(
    [("id", "<i4"), ("position", "<f4", 3), ("orientation_xyzw", "<f4", 4), ("error", "<f4"), ("params", "<i2")]
)
"""A rigid body or bone from 3.0 on. error: mean marker error. params: bit 0, tracked in this frame."""

LABELLED = np.dtype([("id", "<i4"), ("position", "<f4", 3), ("size", "<f4"), ("params", "<i2"), ("residual", "<f4")])
"""A labelled marker from 3.0 on. id: model in the high, marker in the low 16 bits. size: diameter."""


class MarkerFlag(IntFlag):
    """Bits of a labelled marker's params. Servers set further ones."""

    OCCLUDED = 1
    POINT_CLOUD_SOLVED = 2
    MODEL_SOLVED = 4
    HAS_MODEL = 8
    UNLABELLED = 16
    ACTIVE = 32
    ESTABLISHED = 64
    MEASUREMENT = 128


class FrameFlag(IntFlag):
    """Bits of a frame's params."""

    RECORDING = 1
    MODELS_CHANGED = 2
    EDIT_MODE = 4
    BITSTREAM_CHANGED = 8


@dataclass(frozen=True, slots=True)
class MarkerSet:
    """name; positions: (m, 3) float32."""

    name: str
    positions: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class BodyMarkers:
    """Markers of one rigid body, in the frame before 3.0 only: (m, 3) float32, (m,) int32, (m,) float32."""

    positions: NDArray[np.float32]
    ids: NDArray[np.int32]
    sizes: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Bodies:
    """Rigid bodies: (n,) RIGID_BODY and, before 3.0, the markers of each (else empty)."""

    poses: NDArray[Any]
    markers: tuple[BodyMarkers, ...] = ()


@dataclass(frozen=True, slots=True)
class Skeleton:
    """A skeleton and its bones."""

    id: int
    bones: Bodies


@dataclass(frozen=True, slots=True)
class Asset:
    """A trained marker set: bodies (n,) RIGID_BODY, markers (m,) LABELLED."""

    id: int
    bodies: NDArray[Any]
    markers: NDArray[Any]


@dataclass(frozen=True, slots=True)
class Analog:
    """A force plate or analog device: per channel its samples of this frame, float32."""

    id: int
    channels: tuple[NDArray[np.float32], ...]


def _no_bodies() -> Bodies:
    return Bodies(np.zeros(0, RIGID_BODY))


def _no_labelled() -> NDArray[Any]:
    return np.zeros(0, LABELLED)


def _no_points() -> NDArray[np.float32]:
    return np.zeros((0, 3), np.float32)


@dataclass(frozen=True, slots=True)
class FrameOfData:
    """One frame as it is on the wire: units and axes are the server's, absent fields have their default.

    unlabelled: (n, 3) float32, the legacy list without ids. labelled: (m,) LABELLED.
    timestamp_s: frame / rate in live mode, NaN before 2.6.
    The three stamps are ticks of the server's clock (3.0 and later):
    mid exposure of the cameras, their data received by the server, this frame transmitted.
    """

    number: int
    marker_sets: tuple[MarkerSet, ...] = ()
    unlabelled: NDArray[np.float32] = field(default_factory=_no_points)
    rigid_bodies: Bodies = field(default_factory=_no_bodies)
    skeletons: tuple[Skeleton, ...] = ()
    assets: tuple[Asset, ...] = ()
    labelled: NDArray[Any] = field(default_factory=_no_labelled)
    force_plates: tuple[Analog, ...] = ()
    devices: tuple[Analog, ...] = ()
    software_latency_s: float = 0.0
    timecode: int = 0
    timecode_subframe: int = 0
    timestamp_s: float = 0.0
    mid_exposure_ticks: int = 0
    data_received_ticks: int = 0
    transmit_ticks: int = 0
    precision_s: int = 0
    precision_fraction: int = 0
    params: int = 0

    def system_latency_s(self, clock_hz: int) -> float:
        """From the exposure to the sending of this frame [s], NaN if unknown."""
        return self._since(self.mid_exposure_ticks, clock_hz)

    def software_delay_s(self, clock_hz: int) -> float:
        """From the cameras' data in the server to the sending of this frame [s], NaN if unknown."""
        return self._since(self.data_received_ticks, clock_hz)

    def _since(self, ticks: int, clock_hz: int) -> float:
        return (self.transmit_ticks - ticks) / clock_hz if clock_hz and ticks else float("nan")
