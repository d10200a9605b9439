"""Records to bytes and back, bit for bit: one function each way per kind of record. Standard deviations and the
confidence of labels alone are kept in single precision: seven digits of how sure something is are enough, and half the
bytes.

Every message ends in field 15, the CRC-32 of the bytes before it, so that a damaged record is never taken for a
good one, in whatever way it reached the reader.
"""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
from google.protobuf.message import DecodeError

from core.errors import FormatError
from core.frames import (
    BoolArray,
    FloatArray,
    HandFrame,
    HandState,
    IntArray,
    MarkerFrame,
    PropFrame,
    RigidBody,
    Side,
    Times,
    TrackedFrame,
)
from core.hand.skeleton import DOF_NAMES, JOINT_NAMES
from core.printable import printable
from core.takes.schemas import CRC_FIELD, message_class
from core.takes.take import Mark, utf8

_RawFrame = message_class("RawFrame")
_SolvedFrame = message_class("SolvedFrame")
_Mark = message_class("Mark")

_SIDES: tuple[Side, ...] = ("left", "right")
_STATES = (HandState.SEARCHING, HandState.TRACKED, HandState.LOST)
_MOST_THINGS = 4096
"""Hands, props, rigid bodies or stages of one frame; what claims more is no frame."""

_MEND = "Recover the take."
_FIXED32_WIRE = 5
_CRC = struct.Struct("<BI")
_CRC_TAG = CRC_FIELD << 3 | _FIXED32_WIRE


def encode_raw(frame: MarkerFrame) -> bytes:
    """A RawFrame message."""
    message = _RawFrame()
    _put_stamp(message, frame.sequence, frame.times)
    _put_floats(message.points_m, frame.points_m)
    message.ids.extend(np.asarray(frame.ids, dtype=np.int64).tolist())
    _put_floats(message.residuals_m, frame.residuals_m)
    for body in frame.rigid_bodies:
        entry = message.rigid_bodies.add(
            id=int(body.id), name=utf8(body.name), tracked=bool(body.tracked), mean_error_m=float(body.mean_error_m)
        )
        _put_floats(entry.position_m, body.position_m)
        _put_floats(entry.quaternion_wxyz, body.quaternion_wxyz)
    return _sign(message)


def decode_raw(data: bytes) -> MarkerFrame:
    """A frame from a RawFrame message. Raises FormatError."""
    message = raw_record(data)
    return MarkerFrame(
        sequence=message.sequence,
        times=_stamp(message),
        points_m=_floats(message.points_m, -1, 3),
        ids=_ints(message.ids),
        residuals_m=_floats(message.residuals_m),
        rigid_bodies=tuple(
            RigidBody(
                body.id,
                printable(body.name),
                _floats(body.position_m),
                _floats(body.quaternion_wxyz),
                body.tracked,
                body.mean_error_m,
            )
            for body in message.rigid_bodies
        ),
    )


def raw_record(data: bytes) -> Any:
    """A RawFrame message of the right shapes, its arrays not copied. Raises FormatError."""
    message = _parse(_RawFrame, data)
    n = len(message.ids)
    _expect(message.points_m, 3 * n, "points_m")
    _expect(message.residuals_m, n, "residuals_m")
    _at_most(message.rigid_bodies, "rigid bodies")
    for body in message.rigid_bodies:
        _expect(body.position_m, 3, "position_m")
        _expect(body.quaternion_wxyz, 4, "quaternion_wxyz")
    return message


def encode_solved(frame: TrackedFrame) -> bytes:
    """A SolvedFrame message."""
    message = _SolvedFrame()
    _put_stamp(message, frame.sequence, frame.times)
    for hand in frame.hands:
        entry = message.hands.add(
            side=_SIDES.index(hand.side),
            state=_STATES.index(hand.state),
            rms_m=float(hand.rms_m),
            scale=float(hand.scale),
            performer=int(hand.performer),
            why=utf8(hand.why),
        )
        _put_floats(entry.theta_rad, hand.theta_rad)
        _put_floats(entry.joints_world, hand.joints_world)
        _put_floats(entry.markers_world_m, hand.markers_world_m)
        entry.point.extend(np.asarray(hand.point, dtype=np.int64).tolist())
        _put_floats(entry.confidence, hand.confidence)
        _put_single(entry.theta_std, hand.theta_std)
        _put_single(entry.marker_std_m, hand.marker_std_m)
        _put_single(entry.label_confidence, hand.label_confidence)
        entry.filled.extend(np.flatnonzero(hand.filled).tolist())
    for prop in frame.props:
        entry = message.props.add(name=utf8(prop.name), tracked=bool(prop.tracked))
        _put_floats(entry.transform_world, prop.transform_world)
        entry.point.extend(np.asarray(prop.point, dtype=np.int64).tolist())
        if len(prop.point):
            entry.rms_m = float(prop.rms_m)
            _put_floats(entry.markers_world_m, prop.markers_world_m)
    for name, seconds in frame.stage_s.items():
        message.stages.add(name=utf8(name), seconds=float(seconds))
    return _sign(message)


def decode_solved(data: bytes) -> TrackedFrame:
    """A frame from a SolvedFrame message. Raises FormatError."""
    message = solved_record(data)
    return TrackedFrame(
        sequence=message.sequence,
        times=_stamp(message),
        hands=tuple(_hand(entry) for entry in message.hands),
        props=tuple(_prop(entry) for entry in message.props),
        stage_s={printable(stage.name): stage.seconds for stage in message.stages},
    )


def solved_record(data: bytes) -> Any:
    """A SolvedFrame message of the right shapes, its arrays not copied. Raises FormatError."""
    message = _parse(_SolvedFrame, data)
    _at_most(message.hands, "hands")
    _at_most(message.props, "props")
    _at_most(message.stages, "stages")
    for hand in message.hands:
        _check_hand(hand)
    for prop in message.props:
        _expect(prop.transform_world, 16, "transform_world")
        if m := len(prop.point):
            _expect(prop.markers_world_m, 3 * m, "markers_world_m")
    return message


def raw_stamp(data: bytes) -> tuple[int, Times]:
    """The sequence number and the times of a RawFrame message, without the rest. Raises FormatError."""
    message = _parse(_RawFrame, data)
    return int(message.sequence), _stamp(message)


def encode_mark(mark: Mark) -> bytes:
    """A Mark message."""
    return _sign(_Mark(time_s=float(mark.time_s), text=utf8(mark.text)))


def decode_mark(data: bytes) -> Mark:
    """A mark from a Mark message. Raises FormatError."""
    message = _parse(_Mark, data)
    return Mark(message.time_s, message.text)


def intact(data: bytes | memoryview) -> bool:
    """Whether a message carries the CRC of its own bytes."""
    if len(data) < _CRC.size:
        return False
    tag, crc = _CRC.unpack_from(data, len(data) - _CRC.size)
    return bool(tag == _CRC_TAG and crc == zlib.crc32(data[: -_CRC.size]))


def _sign(message: Any) -> bytes:
    body: bytes = message.SerializeToString()
    return body + _CRC.pack(_CRC_TAG, zlib.crc32(body))


def _parse(kind: Any, data: bytes) -> Any:
    if not intact(data):
        raise FormatError(f"A record of {len(data)} bytes is damaged: its checksum does not match.", _MEND)
    try:
        return kind.FromString(data)
    except DecodeError as error:
        raise FormatError(f"A record of {len(data)} bytes is not a {kind.DESCRIPTOR.name}.", _MEND) from error


def _put_stamp(message: Any, sequence: int, times: Times) -> None:
    message.sequence = int(sequence)
    message.device_s = float(times.device_s)
    message.host_s = float(times.host_s)
    message.arrival_s = float(times.arrival_s)


def _stamp(message: Any) -> Times:
    return Times(message.device_s, message.host_s, message.arrival_s)


def _put_floats(field: Any, values: FloatArray) -> None:
    field.extend(np.asarray(values, dtype=np.float64).ravel().tolist())


def _put_single(field: Any, values: FloatArray) -> None:
    """Nothing at all where nothing is known, as in every take that was made before these fields."""
    if not np.isnan(values).all():
        with np.errstate(over="ignore"):  # beyond single precision is infinite
            field.extend(np.asarray(values, dtype=np.float32).tolist())


def _single(field: Any, n: int) -> FloatArray:
    return _floats(field) if len(field) else np.full(n, np.nan)


def _floats(field: Any, *shape: int) -> FloatArray:
    values = np.array(field, dtype=np.float64)
    return values.reshape(shape) if shape else values


def _ints(field: Any) -> IntArray:
    return np.array(field, dtype=np.int64)


def _expect(field: Any, n: int, name: str) -> None:
    if len(field) != n:
        raise FormatError(f"A record holds {len(field)} numbers as {name}, not {n}.", _MEND)


def _at_most(field: Any, name: str) -> None:
    if len(field) > _MOST_THINGS:
        raise FormatError(f"A record holds {len(field)} {name}; a frame has {_MOST_THINGS} at most.", _MEND)


def _check_hand(entry: Any) -> None:
    if entry.side >= len(_SIDES) or entry.state >= len(_STATES):
        raise FormatError(f"A record holds a hand of unknown side {entry.side} or state {entry.state}.", _MEND)
    m, n = len(entry.point), len(DOF_NAMES)
    _expect(entry.theta_rad, n, "theta_rad")
    _expect(entry.joints_world, 16 * len(JOINT_NAMES), "joints_world")
    _expect(entry.markers_world_m, 3 * m, "markers_world_m")
    _expect(entry.confidence, m, "confidence")
    for field, size, name in (
        (entry.theta_std, n, "theta_std"),
        (entry.marker_std_m, m, "marker_std_m"),
        (entry.label_confidence, m, "label_confidence"),
    ):
        if len(field):
            _expect(field, size, name)
    if len(entry.filled) and max(entry.filled) >= n:
        raise FormatError(f"A record holds {max(entry.filled)} as filled, of numbers below {n}.", _MEND)


def _hand(entry: Any) -> HandFrame:
    m = len(entry.point)
    return HandFrame(
        side=_SIDES[entry.side],
        state=_STATES[entry.state],
        theta_rad=_floats(entry.theta_rad),
        joints_world=_floats(entry.joints_world, len(JOINT_NAMES), 4, 4),
        markers_world_m=_floats(entry.markers_world_m, m, 3),
        point=_ints(entry.point),
        confidence=_floats(entry.confidence),
        theta_std=_single(entry.theta_std, len(DOF_NAMES)),
        marker_std_m=_single(entry.marker_std_m, m),
        rms_m=entry.rms_m,
        scale=entry.scale,
        performer=entry.performer,
        label_confidence=_single(entry.label_confidence, m),
        why=printable(entry.why),
        filled=_flags(entry.filled, len(DOF_NAMES)),
    )


def _flags(field: Any, n: int) -> BoolArray:
    """(n,) bool from the indices of those that are set; (0,) where none is."""
    if not len(field):
        return np.zeros(0, dtype=np.bool_)
    flags = np.zeros(n, dtype=np.bool_)
    flags[list(field)] = True
    return flags


def _prop(entry: Any) -> PropFrame:
    name = printable(entry.name)
    transform_world = _floats(entry.transform_world, 4, 4)
    if not entry.point:
        return PropFrame(name, transform_world, entry.tracked)
    markers_world_m = _floats(entry.markers_world_m, -1, 3)
    return PropFrame(name, transform_world, entry.tracked, _ints(entry.point), entry.rms_m, markers_world_m)
