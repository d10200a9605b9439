"""The messages of a take, as protobuf descriptors: the file carries them, so any MCAP tool can read a take.

docs/take-format.md shows the same messages in protobuf's own notation.
"""

from __future__ import annotations

from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

PACKAGE = "phalanx.take"
CRC_FIELD = 15
"""Number of the last field of every recorded message: CRC-32 of the bytes before it."""

_Field = descriptor_pb2.FieldDescriptorProto
_DOUBLE, _FLOAT = _Field.TYPE_DOUBLE, _Field.TYPE_FLOAT
_BOOL, _STRING = _Field.TYPE_BOOL, _Field.TYPE_STRING
_SINT64, _UINT32, _FIXED32 = _Field.TYPE_SINT64, _Field.TYPE_UINT32, _Field.TYPE_FIXED32
_ONE, _MANY = _Field.LABEL_OPTIONAL, _Field.LABEL_REPEATED
_MAYBE = "maybe"
"""As _ONE, but nothing differs from zero."""


_CRC = ("crc32", CRC_FIELD, _ONE, _FIXED32)
_FRAME = (
    ("sequence", 1, _ONE, _SINT64),
    ("device_s", 2, _ONE, _DOUBLE),
    ("host_s", 3, _ONE, _DOUBLE),
    ("arrival_s", 4, _ONE, _DOUBLE),
)
_ENUMS = {
    "Side": ("SIDE_LEFT", "SIDE_RIGHT"),
    "State": ("STATE_SEARCHING", "STATE_TRACKED", "STATE_LOST"),
}
_MESSAGES: dict[str, tuple[tuple[str, int, Any, Any], ...]] = {
    "RigidBody": (
        ("id", 1, _ONE, _SINT64),
        ("name", 2, _ONE, _STRING),
        ("position_m", 3, _MANY, _DOUBLE),
        ("quaternion_wxyz", 4, _MANY, _DOUBLE),
        ("tracked", 5, _ONE, _BOOL),
        ("mean_error_m", 6, _ONE, _DOUBLE),
    ),
    "RawFrame": (
        *_FRAME,
        ("points_m", 5, _MANY, _DOUBLE),
        ("ids", 6, _MANY, _SINT64),
        ("residuals_m", 7, _MANY, _DOUBLE),
        ("rigid_bodies", 8, _MANY, "RigidBody"),
        ("timecode", 9, _ONE, _STRING),
        _CRC,
    ),
    "InertialFrame": (
        *_FRAME,
        ("bone_names", 5, _MANY, _STRING),
        ("side", 6, _ONE, _STRING),
        ("rotations_wxyz", 7, _MANY, _DOUBLE),
        ("positions_m", 8, _MANY, _DOUBLE),
        ("angular_radps", 9, _MANY, _DOUBLE),
        ("acceleration_mps2", 10, _MANY, _DOUBLE),
        ("state", 11, _MANY, _UINT32),
        _CRC,
    ),
    "ClockSample": (
        ("device_s", 1, _ONE, _DOUBLE),
        ("host_s", 2, _ONE, _DOUBLE),
        ("round_trip_s", 3, _ONE, _DOUBLE),
        _CRC,
    ),
    "Hand": (
        ("side", 1, _ONE, "Side"),
        ("state", 2, _ONE, "State"),
        ("theta_rad", 3, _MANY, _DOUBLE),
        ("joints_world", 4, _MANY, _DOUBLE),
        ("markers_world_m", 5, _MANY, _DOUBLE),
        ("point", 6, _MANY, _SINT64),
        ("confidence", 7, _MANY, _DOUBLE),
        ("rms_m", 8, _ONE, _DOUBLE),
        ("scale", 9, _ONE, _DOUBLE),
        ("theta_std", 10, _MANY, _FLOAT),
        ("marker_std_m", 11, _MANY, _FLOAT),
        ("performer", 12, _ONE, _UINT32),
        ("label_confidence", 13, _MANY, _FLOAT),
        ("why", 14, _ONE, _STRING),
        ("filled", 16, _MANY, _UINT32),
        ("angle_source", 17, _MANY, _UINT32),
        ("marker_source", 18, _MANY, _UINT32),
        ("held_by", 19, _ONE, _STRING),
    ),
    "Prop": (
        ("name", 1, _ONE, _STRING),
        ("transform_world", 2, _MANY, _DOUBLE),
        ("tracked", 3, _ONE, _BOOL),
        ("point", 4, _MANY, _SINT64),
        ("rms_m", 5, _ONE, _DOUBLE),
        ("markers_world_m", 6, _MANY, _DOUBLE),
    ),
    "Stage": (
        ("name", 1, _ONE, _STRING),
        ("seconds", 2, _ONE, _DOUBLE),
    ),
    "Source": (
        ("stream", 1, _ONE, _STRING),
        ("sequence", 2, _ONE, _SINT64),
    ),
    "SolvedFrame": (
        *_FRAME,
        ("hands", 5, _MANY, "Hand"),
        ("props", 6, _MANY, "Prop"),
        ("stages", 7, _MANY, "Stage"),
        ("at_host_s", 8, _MAYBE, _DOUBLE),
        ("of", 9, _MANY, "Source"),
        _CRC,
    ),
    "Mark": (
        ("time_s", 1, _ONE, _DOUBLE),
        ("text", 2, _ONE, _STRING),
        _CRC,
    ),
}


def _file() -> descriptor_pb2.FileDescriptorProto:
    file = descriptor_pb2.FileDescriptorProto(name="phalanx_take.proto", package=PACKAGE, syntax="proto3")
    for enum_name, values in _ENUMS.items():
        enum = file.enum_type.add(name=enum_name)
        for number, value in enumerate(values):
            enum.value.add(name=value, number=number)
    for message_name, fields in _MESSAGES.items():
        message = file.message_type.add(name=message_name)
        for name, number, label, kind in fields:
            entry = message.field.add(name=name, number=number, label=_ONE if label == _MAYBE else label)
            if label == _MAYBE:  # protobuf keeps its presence as a oneof of this one field
                message.oneof_decl.add(name=f"_{name}")
                entry.oneof_index, entry.proto3_optional = len(message.oneof_decl) - 1, True
            if isinstance(kind, str):
                entry.type = _Field.TYPE_ENUM if kind in _ENUMS else _Field.TYPE_MESSAGE
                entry.type_name = f".{PACKAGE}.{kind}"
            else:
                entry.type = kind
    return file


_POOL = descriptor_pool.DescriptorPool()
_POOL.Add(_file())


def message_class(name: str) -> Any:
    """The protobuf class of one of the messages above."""
    return message_factory.GetMessageClass(_POOL.FindMessageTypeByName(f"{PACKAGE}.{name}"))


def descriptor_set() -> bytes:
    """The serialised FileDescriptorSet that a take carries as its schema."""
    data: bytes = descriptor_pb2.FileDescriptorSet(file=[_file()]).SerializeToString(deterministic=True)
    return data
