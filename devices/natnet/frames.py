"""FRAMEOFDATA: one frame of a NatNet stream, bytes to record and back, bitstreams 2.5 to 4.4."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import FormatError
from devices.natnet.records import (
    LABELLED,
    RIGID_BODY,
    Analog,
    Asset,
    Bodies,
    BodyMarkers,
    FrameOfData,
    MarkerFlag,
    MarkerSet,
    Skeleton,
)
from devices.natnet.wire import F32, F64, I16, I32, Reader, Version, pack_section, pack_text

_LABELLED_26 = np.dtype([("id", "<i4"), ("position", "<f4", 3), ("size", "<f4"), ("params", "<i2")])
_LABELLED_25 = np.dtype([("id", "<i4"), ("position", "<f4", 3), ("size", "<f4")])
_I32 = np.dtype("<i4")
_F32 = np.dtype("<f4")

_POSE = struct.Struct("<i3f4f")
_TIMECODE = struct.Struct("<II")
_STAMPS = struct.Struct("<3Q")
_PRECISION = struct.Struct("<II")


@dataclass(frozen=True, slots=True)
class _Layout:
    """What a bitstream version has."""

    version: Version
    params: bool  # 2.6: params of bodies, markers and frame
    stamp: struct.Struct | None  # 2.6: float32, 2.7: float64
    plates: bool  # 2.9: force plates
    modern: bool  # 3.0: residuals, devices, clock stamps; no markers in bodies, no latency
    sized: bool  # 4.1: size fields, assets, precision stamps
    elastic: bool  # later than known: sections may have grown


@lru_cache
def _layout(version: Version) -> _Layout:
    if version < (2, 5):
        raise FormatError(f"NatNet {version[0]}.{version[1]} is too old.", "Bitstreams 2.5 to 4.4 are understood.")
    return _Layout(
        version=version,
        params=version >= (2, 6),
        stamp=None if version < (2, 6) else F32 if version < (2, 7) else F64,
        plates=version >= (2, 9),
        modern=version >= (3, 0),
        sized=version >= (4, 1),
        elastic=version > (4, 2),
    )


LAYOUTS: tuple[Version, ...] = ((4, 1), (3, 0), (2, 9), (2, 7), (2, 6), (2, 5))
"""One version of each layout; those between share the one before."""


def decode_frame(payload: bytes, version: Version) -> FrameOfData:
    """The frame in a FRAMEOFDATA payload. Raises FormatError unless every byte is accounted for."""
    layout = _layout(version)
    sized, elastic = layout.sized, layout.elastic
    reader = Reader(payload, f"NatNet {version[0]}.{version[1]} frame")
    number = reader.i32("the frame number")

    n = reader.open_section(sized, 5, "marker sets")
    marker_sets = tuple(_read_marker_set(reader) for _ in range(n))
    reader.close_section(sized, elastic, "marker sets")

    n = reader.open_section(sized, 12, "unlabelled markers")
    unlabelled = reader.points(n, "unlabelled markers")
    reader.close_section(sized, elastic, "unlabelled markers")

    if layout.modern:
        rigid_bodies = Bodies(reader.section_array(RIGID_BODY, sized, elastic, "rigid bodies"))
    else:
        rigid_bodies = _read_old_bodies(reader, layout)

    n = reader.open_section(sized, 8, "skeletons")
    skeletons = tuple(_read_skeleton(reader, layout) for _ in range(n))
    reader.close_section(sized, elastic, "skeletons")

    assets: tuple[Asset, ...] = ()
    if sized:
        n = reader.open_section(sized, 12, "assets")
        assets = tuple(_read_asset(reader) for _ in range(n))
        reader.close_section(sized, elastic, "assets")

    labelled = _read_labelled(reader, layout)
    force_plates = _read_analog(reader, layout, "force plates") if layout.plates else ()
    devices = _read_analog(reader, layout, "devices") if layout.modern else ()
    latency = 0.0 if layout.modern else reader.values(F32, "the latency")[0]
    timecode, subframe = reader.values(_TIMECODE, "the timecode")
    timestamp = reader.values(layout.stamp, "the timestamp")[0] if layout.stamp else math.nan
    exposed, received, sent = reader.values(_STAMPS, "the clock stamps") if layout.modern else (0, 0, 0)
    precision = reader.values(_PRECISION, "the precision timestamp") if sized else (0, 0)
    params = reader.values(I16, "the frame parameters")[0] if layout.params else 0
    end = reader.i32("the end of data")
    if end != 0:
        raise reader.error(f"the end of data is {end}, not 0")
    reader.finish()
    return FrameOfData(
        number,
        marker_sets,
        unlabelled,
        rigid_bodies,
        skeletons,
        assets,
        labelled,
        force_plates,
        devices,
        latency,
        timecode,
        subframe,
        timestamp,
        exposed,
        received,
        sent,
        precision[0],
        precision[1],
        params,
    )


def detect_version(payload: bytes) -> Version | None:
    """The one layout that accounts for every byte of this frame; None if none does, or several.

    A client that merely listens to a multicast stream is told its version by nobody.
    """
    fits = [version for version in LAYOUTS if _fits(payload, version)]
    return fits[0] if len(fits) == 1 else None


def _fits(payload: bytes, version: Version) -> bool:
    try:
        decode_frame(payload, version)
    except FormatError:
        return False
    return True


def _read_marker_set(reader: Reader) -> MarkerSet:
    name = reader.text("the name of a marker set")
    n = reader.count(12, "markers of a set")
    return MarkerSet(name, reader.points(n, "markers of a set"))


def _read_old_bodies(reader: Reader, layout: _Layout) -> Bodies:
    """Rigid bodies or bones before 3.0: a count, then each with its markers."""
    n = reader.count(_POSE.size + 8, "rigid bodies")
    poses = np.zeros(n, RIGID_BODY)
    markers = []
    for i in range(n):
        values = reader.values(_POSE, "a rigid body")
        m = reader.count(20, "markers of a rigid body")
        markers.append(
            BodyMarkers(
                reader.points(m, "markers of a rigid body"),
                reader.array(_I32, m, "marker ids of a rigid body"),
                reader.array(_F32, m, "marker sizes of a rigid body"),
            )
        )
        error = reader.values(F32, "the mean marker error")[0]
        # Before 2.6 nothing says whether the body is tracked.
        params = reader.values(I16, "the parameters of a rigid body")[0] if layout.params else 1
        poses[i] = (values[0], values[1:4], values[4:8], error, params)
    return Bodies(poses, tuple(markers))


def _read_skeleton(reader: Reader, layout: _Layout) -> Skeleton:
    identity = reader.i32("the id of a skeleton")
    if not layout.modern:
        return Skeleton(identity, _read_old_bodies(reader, layout))
    n = reader.count(RIGID_BODY.itemsize, "bones")
    return Skeleton(identity, Bodies(reader.array(RIGID_BODY, n, "bones")))


def _read_asset(reader: Reader) -> Asset:
    identity = reader.i32("the id of an asset")
    n = reader.count(RIGID_BODY.itemsize, "rigid bodies of an asset")
    bodies = reader.array(RIGID_BODY, n, "rigid bodies of an asset")
    m = reader.count(LABELLED.itemsize, "markers of an asset")
    return Asset(identity, bodies, reader.array(LABELLED, m, "markers of an asset"))


def _read_labelled(reader: Reader, layout: _Layout) -> NDArray[Any]:
    if layout.modern:
        return reader.section_array(LABELLED, layout.sized, layout.elastic, "labelled markers")
    dtype = _LABELLED_26 if layout.params else _LABELLED_25
    old = reader.array(dtype, reader.count(dtype.itemsize, "labelled markers"), "labelled markers")
    labelled = np.zeros(len(old), LABELLED)
    labelled["params"] = int(MarkerFlag.POINT_CLOUD_SOLVED)
    labelled["residual"] = np.nan
    for name in dtype.names or ():
        labelled[name] = old[name]
    return labelled


def _read_analog(reader: Reader, layout: _Layout, of: str) -> tuple[Analog, ...]:
    found = []
    for _ in range(reader.open_section(layout.sized, 8, of)):
        identity = reader.i32(f"the id of {of}")
        channels = []
        for _ in range(reader.count(4, f"channels of {of}")):
            n = reader.count(4, f"samples of {of}")
            channels.append(reader.array(_F32, n, f"samples of {of}"))
        found.append(Analog(identity, tuple(channels)))
    reader.close_section(layout.sized, layout.elastic, of)
    return tuple(found)


def encode_frame(frame: FrameOfData, version: Version) -> bytes:
    """Payload of FRAMEOFDATA; fields the version does not have are left out."""
    layout = _layout(version)
    sized = layout.sized
    sets = b"".join(pack_text(s.name) + I32.pack(len(s.positions)) + _f32_bytes(s.positions) for s in frame.marker_sets)
    skeletons = b"".join(I32.pack(s.id) + _pack_bodies(s.bones, layout, False) for s in frame.skeletons)
    parts = [
        I32.pack(frame.number),
        pack_section(len(frame.marker_sets), sets, sized),
        pack_section(len(frame.unlabelled), _f32_bytes(frame.unlabelled), sized),
        _pack_bodies(frame.rigid_bodies, layout, sized),
        pack_section(len(frame.skeletons), skeletons, sized),
    ]
    if sized:
        parts.append(pack_section(len(frame.assets), b"".join(_pack_asset(a) for a in frame.assets), sized))
    parts.append(pack_section(len(frame.labelled), _labelled_bytes(frame.labelled, layout), sized))
    if layout.plates:
        parts.append(_pack_analog(frame.force_plates, sized))
    if layout.modern:
        parts.append(_pack_analog(frame.devices, sized))
    else:
        parts.append(F32.pack(frame.software_latency_s))
    parts.append(_TIMECODE.pack(frame.timecode, frame.timecode_subframe))
    if layout.stamp:
        parts.append(layout.stamp.pack(frame.timestamp_s))
    if layout.modern:
        parts.append(_STAMPS.pack(frame.mid_exposure_ticks, frame.data_received_ticks, frame.transmit_ticks))
    if sized:
        parts.append(_PRECISION.pack(frame.precision_s, frame.precision_fraction))
    if layout.params:
        parts.append(I16.pack(frame.params))
    parts.append(I32.pack(0))
    return b"".join(parts)


def _f32_bytes(values: NDArray[Any]) -> bytes:
    return np.ascontiguousarray(values, "<f4").tobytes()


def _pack_bodies(bodies: Bodies, layout: _Layout, sized: bool) -> bytes:
    if layout.modern:
        return pack_section(len(bodies.poses), bodies.poses.tobytes(), sized)
    none = BodyMarkers(np.zeros((0, 3), np.float32), np.zeros(0, np.int32), np.zeros(0, np.float32))
    parts = [I32.pack(len(bodies.poses))]
    for i, pose in enumerate(bodies.poses):
        markers = bodies.markers[i] if bodies.markers else none
        parts += [
            _POSE.pack(int(pose["id"]), *pose["position"].tolist(), *pose["orientation_xyzw"].tolist()),
            I32.pack(len(markers.positions)),
            _f32_bytes(markers.positions),
            np.ascontiguousarray(markers.ids, "<i4").tobytes(),
            _f32_bytes(markers.sizes),
            F32.pack(float(pose["error"])),
        ]
        if layout.params:
            parts.append(I16.pack(int(pose["params"])))
    return b"".join(parts)


def _pack_asset(asset: Asset) -> bytes:
    return (
        I32.pack(asset.id)
        + I32.pack(len(asset.bodies))
        + asset.bodies.tobytes()
        + I32.pack(len(asset.markers))
        + asset.markers.tobytes()
    )


def _labelled_bytes(labelled: NDArray[Any], layout: _Layout) -> bytes:
    if layout.modern:
        return labelled.tobytes()
    dtype = _LABELLED_26 if layout.params else _LABELLED_25
    old = np.zeros(len(labelled), dtype)
    for name in dtype.names or ():
        old[name] = labelled[name]
    return old.tobytes()


def _pack_analog(devices: tuple[Analog, ...], sized: bool) -> bytes:
    parts = []
    for device in devices:
        parts += [I32.pack(device.id), I32.pack(len(device.channels))]
        parts += [I32.pack(len(channel)) + _f32_bytes(channel) for channel in device.channels]
    return pack_section(len(devices), b"".join(parts), sized)
