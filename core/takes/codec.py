"""Records to bytes and back, bit for bit: one function each way per kind of record. Standard deviations and the
confidence of labels alone are kept in single precision: seven digits of how sure something is are enough, and half the
bytes.
"""

from __future__ import annotations

from functools import lru_cache
from math import isnan
from typing import Any

import numpy as np

from core.errors import FormatError, TakeError
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
from core.hand.skeleton import DIGIT_DOF_NAMES, DOF_NAMES, JOINT_NAMES
from core.printable import printable
from core.streams import ClockSample
from core.takes.message import (
    MEND,
    at_most,
    codes,
    expect,
    flags,
    floats,
    ints,
    known,
    parse,
    put_codes,
    put_floats,
    put_known,
    put_single,
    put_stamp,
    sign,
    stamp,
)
from core.takes.schemas import message_class
from core.takes.stream_text import MOST_BONES
from core.takes.take import Mark, utf8

_RawFrame = message_class("RawFrame")
_InertialFrame = message_class("InertialFrame")
_ClockSample = message_class("ClockSample")
_SolvedFrame = message_class("SolvedFrame")
_Mark = message_class("Mark")

_SIDES: tuple[Side, ...] = ("left", "right")
_WORN: dict[str, Side | None] = {"": None, "left": "left", "right": "right"}
_STATES = (HandState.SEARCHING, HandState.TRACKED, HandState.LOST)
_stage_name = lru_cache(256)(printable)  # the same few in every frame


def encode_raw(frame: MarkerFrame) -> bytes:
    """A RawFrame message."""
    message = _RawFrame()
    if frame.timecode:
        message.timecode = utf8(frame.timecode)
    put_stamp(message, frame.sequence, frame.times)
    put_floats(message.points_m, frame.points_m)
    message.ids.extend(np.asarray(frame.ids, dtype=np.int64).tolist())
    put_floats(message.residuals_m, frame.residuals_m)
    for body in frame.rigid_bodies:
        entry = message.rigid_bodies.add(
            id=int(body.id), name=utf8(body.name), tracked=bool(body.tracked), mean_error_m=float(body.mean_error_m)
        )
        put_floats(entry.position_m, body.position_m)
        put_floats(entry.quaternion_wxyz, body.quaternion_wxyz)
    return sign(message)


def decode_raw(data: bytes) -> MarkerFrame:
    """A frame from a RawFrame message. Raises FormatError."""
    message = raw_record(data)
    return MarkerFrame(
        sequence=message.sequence,
        times=stamp(message),
        points_m=floats(message.points_m, -1, 3),
        ids=ints(message.ids),
        residuals_m=floats(message.residuals_m),
        rigid_bodies=tuple(
            RigidBody(
                body.id,
                printable(body.name),
                floats(body.position_m),
                floats(body.quaternion_wxyz),
                body.tracked,
                body.mean_error_m,
            )
            for body in message.rigid_bodies
        ),
        timecode=printable(message.timecode) if message.timecode else "",
    )


def raw_record(data: bytes) -> Any:
    """A RawFrame message of the right shapes, its arrays not copied. Raises FormatError."""
    message = parse(_RawFrame, data)
    n = len(message.ids)
    expect(message.points_m, 3 * n, "points_m")
    expect(message.residuals_m, n, "residuals_m")
    at_most(message.rigid_bodies, "rigid bodies")
    for body in message.rigid_bodies:
        expect(body.position_m, 3, "position_m")
        expect(body.quaternion_wxyz, 4, "quaternion_wxyz")
    return message


def encode_inertial(frame: InertialFrame) -> bytes:
    """An InertialFrame message. Raises TakeError for bones that could not be read again."""
    if len(frame.bone_names) > MOST_BONES or len(frame.bone_names) != len(frame.rotations_wxyz):
        raise TakeError(
            f"A frame of {len(frame.bone_names)} bones with {len(frame.rotations_wxyz)} rotations cannot be in a take, "
            f"which takes {MOST_BONES} at most, each with one.",
            "Check what the device sends.",
        )
    message = _InertialFrame(side=frame.side or "")
    put_stamp(message, frame.sequence, frame.times)
    message.bone_names.extend(map(utf8, frame.bone_names))
    put_floats(message.rotations_wxyz, frame.rotations_wxyz)
    put_known(message.positions_m, frame.positions_m)
    put_known(message.angular_radps, frame.angular_radps)
    put_known(message.acceleration_mps2, frame.acceleration_mps2)
    put_codes(message.state, frame.state)
    return sign(message)


def decode_inertial(data: bytes) -> InertialFrame:
    """A frame from an InertialFrame message. Raises FormatError."""
    message = parse(_InertialFrame, data)
    at_most(message.bone_names, "bones", MOST_BONES)
    n = len(message.bone_names)
    expect(message.rotations_wxyz, 4 * n, "rotations_wxyz")
    for field, size, name in (
        (message.positions_m, 3 * n, "positions_m"),
        (message.angular_radps, 3 * n, "angular_radps"),
        (message.acceleration_mps2, 3 * n, "acceleration_mps2"),
        (message.state, n, "state"),
    ):
        if len(field):
            expect(field, size, name)
    if message.side not in _WORN:
        raise FormatError(f"A record holds bones of unknown side {message.side!r}.", MEND)
    return InertialFrame(
        sequence=message.sequence,
        times=stamp(message),
        bone_names=tuple(map(printable, message.bone_names)),
        rotations_wxyz=floats(message.rotations_wxyz, n, 4),
        side=_WORN[message.side],
        positions_m=known(message.positions_m, n, 3),
        angular_radps=known(message.angular_radps, n, 3),
        acceleration_mps2=known(message.acceleration_mps2, n, 3),
        state=codes(message.state, BONE_STATES, n),
    )


def encode_clock(sample: ClockSample) -> bytes:
    """A ClockSample message."""
    return sign(
        _ClockSample(
            device_s=float(sample.device_s), host_s=float(sample.host_s), round_trip_s=float(sample.round_trip_s)
        )
    )


def decode_clock(data: bytes) -> ClockSample:
    """A clock sample from a ClockSample message. Raises FormatError."""
    message = parse(_ClockSample, data)
    return ClockSample(message.device_s, message.host_s, message.round_trip_s)


def encode_solved(frame: TrackedFrame) -> bytes:
    """A SolvedFrame message."""
    message = _SolvedFrame()
    put_stamp(message, frame.sequence, frame.times)
    for hand in frame.hands:
        entry = message.hands.add(
            side=_SIDES.index(hand.side),
            state=_STATES.index(hand.state),
            rms_m=float(hand.rms_m),
            scale=float(hand.scale),
            performer=int(hand.performer),
            why=utf8(hand.why),
        )
        if hand.held_by:
            entry.held_by = utf8(hand.held_by)
        put_floats(entry.theta_rad, hand.theta_rad)
        put_floats(entry.joints_world, hand.joints_world)
        put_floats(entry.markers_world_m, hand.markers_world_m)
        entry.point.extend(np.asarray(hand.point, dtype=np.int64).tolist())
        put_floats(entry.confidence, hand.confidence)
        put_single(entry.theta_std, hand.theta_std)
        put_single(entry.marker_std_m, hand.marker_std_m)
        put_single(entry.label_confidence, hand.label_confidence)
        entry.filled.extend(np.flatnonzero(hand.filled).tolist())
        put_codes(entry.angle_source, hand.angle_source)
        put_codes(entry.marker_source, hand.marker_source)
    for prop in frame.props:
        entry = message.props.add(name=utf8(prop.name), tracked=bool(prop.tracked))
        put_floats(entry.transform_world, prop.transform_world)
        entry.point.extend(np.asarray(prop.point, dtype=np.int64).tolist())
        if len(prop.point):
            entry.rms_m = float(prop.rms_m)
            put_floats(entry.markers_world_m, prop.markers_world_m)
    for name, seconds in frame.stage_s.items():
        message.stages.add(name=utf8(name), seconds=float(seconds))
    if not isnan(frame.at_host_s):
        message.at_host_s = float(frame.at_host_s)
    for stream, sequence in frame.of:
        message.of.add(stream=utf8(stream), sequence=int(sequence))
    return sign(message)


def decode_solved(data: bytes) -> TrackedFrame:
    """A frame from a SolvedFrame message. Raises FormatError."""
    message = solved_record(data)
    return TrackedFrame(
        sequence=message.sequence,
        times=stamp(message),
        hands=tuple(_hand(entry) for entry in message.hands),
        props=tuple(_prop(entry) for entry in message.props),
        stage_s={_stage_name(stage.name): stage.seconds for stage in message.stages},
        at_host_s=message.at_host_s if message.HasField("at_host_s") else float("nan"),
        of=tuple([(printable(source.stream), source.sequence) for source in message.of]),
    )


def solved_record(data: bytes) -> Any:
    """A SolvedFrame message of the right shapes, its arrays not copied. Raises FormatError."""
    message = parse(_SolvedFrame, data)
    at_most(message.hands, "hands")
    at_most(message.props, "props")
    at_most(message.stages, "stages")
    at_most(message.of, "sources")
    for hand in message.hands:
        _check_hand(hand)
    for prop in message.props:
        expect(prop.transform_world, 16, "transform_world")
        if m := len(prop.point):
            expect(prop.markers_world_m, 3 * m, "markers_world_m")
    return message


def raw_stamp(data: bytes) -> tuple[int, Times]:
    """The sequence number and the times of a RawFrame message, without the rest. Raises FormatError."""
    message = parse(_RawFrame, data)
    return int(message.sequence), stamp(message)


def inertial_stamp(data: bytes) -> tuple[int, Times]:
    """The sequence number and the times of an InertialFrame message, without the rest. Raises FormatError."""
    message = parse(_InertialFrame, data)
    return int(message.sequence), stamp(message)


def encode_mark(mark: Mark) -> bytes:
    """A Mark message."""
    return sign(_Mark(time_s=float(mark.time_s), text=utf8(mark.text)))


def decode_mark(data: bytes) -> Mark:
    """A mark from a Mark message. Raises FormatError."""
    message = parse(_Mark, data)
    return Mark(message.time_s, message.text)


def _check_hand(entry: Any) -> None:
    if entry.side >= len(_SIDES) or entry.state >= len(_STATES):
        raise FormatError(f"A record holds a hand of unknown side {entry.side} or state {entry.state}.", MEND)
    m, n = len(entry.point), len(DOF_NAMES)
    expect(entry.theta_rad, n, "theta_rad")
    expect(entry.joints_world, 16 * len(JOINT_NAMES), "joints_world")
    expect(entry.markers_world_m, 3 * m, "markers_world_m")
    expect(entry.confidence, m, "confidence")
    for field, size, name in (
        (entry.theta_std, n, "theta_std"),
        (entry.marker_std_m, m, "marker_std_m"),
        (entry.label_confidence, m, "label_confidence"),
        (entry.angle_source, len(DIGIT_DOF_NAMES), "angle_source"),
        (entry.marker_source, m, "marker_source"),
    ):
        if len(field):
            expect(field, size, name)
    if len(entry.filled) and max(entry.filled) >= n:
        raise FormatError(f"A record holds {max(entry.filled)} as filled, of numbers below {n}.", MEND)


def _hand(entry: Any) -> HandFrame:
    point = ints(entry.point)
    m = len(point)
    return HandFrame(
        side=_SIDES[entry.side],
        state=_STATES[entry.state],
        theta_rad=floats(entry.theta_rad),
        joints_world=floats(entry.joints_world, len(JOINT_NAMES), 4, 4),
        markers_world_m=floats(entry.markers_world_m, m, 3),
        point=point,
        confidence=floats(entry.confidence),
        theta_std=known(entry.theta_std, len(DOF_NAMES)),
        marker_std_m=known(entry.marker_std_m, m),
        rms_m=entry.rms_m,
        scale=entry.scale,
        performer=entry.performer,
        label_confidence=known(entry.label_confidence, m),
        why=printable(entry.why) if entry.why else "",
        filled=flags(entry.filled, len(DOF_NAMES)),
        angle_source=codes(entry.angle_source, SAID_BY),
        marker_source=codes(entry.marker_source, SAID_BY),
        held_by=printable(entry.held_by) if entry.held_by else "",
    )


def _prop(entry: Any) -> PropFrame:
    name = printable(entry.name)
    transform_world = floats(entry.transform_world, 4, 4)
    if not entry.point:
        return PropFrame(name, transform_world, entry.tracked)
    markers_world_m = floats(entry.markers_world_m, -1, 3)
    return PropFrame(name, transform_world, entry.tracked, ints(entry.point), entry.rms_m, markers_world_m)
