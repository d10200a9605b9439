"""MODELDEF: what a NatNet server tracks, by name; bytes to records and back."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import FormatError
from devices.natnet.wire import F32, I16, I32, Reader, Version, pack_text

_OFFSET = struct.Struct("<3f")
_QUATERNION = struct.Struct("<4f")
_IDS = struct.Struct("<2i")
_PLATE = struct.Struct("<2f3f144f12f2i")
_TYPES = struct.Struct("<2i")
_CAMERA = struct.Struct("<3f4f")
_LABELS = np.dtype("<i4")
_IDENTITY = (0.0, 0.0, 0.0, 1.0)

Floats = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class MarkerSetModel:
    """Type 0: the names of a set's markers."""

    name: str
    marker_names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class RigidBodyModel:
    """Type 1. offset: from its parent. orientation_xyzw: 4.2. Marker fields: 3.0, marker names: 4.0.

    marker_positions: (n, 3) float32 in the body; marker_labels: (n,) int32, active labels.
    """

    name: str
    id: int
    parent_id: int = -1
    offset: Floats = (0.0, 0.0, 0.0)
    orientation_xyzw: Floats = _IDENTITY
    marker_positions: NDArray[np.float32] | None = None
    marker_labels: NDArray[np.int32] | None = None
    marker_names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SkeletonModel:
    """Type 2. Some servers leave the marker fields out of the bones: bone_markers is then False."""

    name: str
    id: int
    bones: tuple[RigidBodyModel, ...]
    bone_markers: bool = True


@dataclass(frozen=True, slots=True)
class ForcePlateModel:
    """Type 3. values: width, length, origin 3, 12 x 12 matrix, 4 x 3 corners."""

    id: int
    serial: str
    values: Floats
    plate_type: int
    data_type: int
    channels: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class DeviceModel:
    """Type 4: an analog device."""

    id: int
    name: str
    serial: str
    device_type: int
    data_type: int
    channels: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CameraModel:
    """Type 5. pose: position 3, quaternion x y z w."""

    name: str
    pose: Floats


@dataclass(frozen=True, slots=True)
class AssetMarker:
    """A marker of a trained marker set."""

    name: str
    id: int
    position: Floats
    size: float
    params: int


@dataclass(frozen=True, slots=True)
class AssetModel:
    """Type 6, 4.1."""

    name: str
    asset_type: int
    id: int
    bodies: tuple[RigidBodyModel, ...]
    markers: tuple[AssetMarker, ...]


@dataclass(frozen=True, slots=True)
class UnknownModel:
    """A type of a later version."""

    type: int
    body: bytes


Model = (
    MarkerSetModel
    | RigidBodyModel
    | SkeletonModel
    | ForcePlateModel
    | DeviceModel
    | CameraModel
    | AssetModel
    | UnknownModel
)

_TYPE_OF: dict[type[Any], int] = {
    MarkerSetModel: 0,
    RigidBodyModel: 1,
    SkeletonModel: 2,
    ForcePlateModel: 3,
    DeviceModel: 4,
    CameraModel: 5,
    AssetModel: 6,
}


def decode_models(payload: bytes, version: Version) -> tuple[Model, ...]:
    """The descriptions in a MODELDEF payload. Raises FormatError unless every byte is accounted for.

    Before 4.1 a type that is not known ends the list: its length is told nowhere.
    """
    try:
        return _decode(payload, version, bone_markers=True)
    except FormatError as error:
        try:
            models = _decode(payload, version, bone_markers=False)
        except FormatError:
            raise error from None
        if not any(isinstance(model, SkeletonModel) for model in models):
            raise
        return models


def _decode(payload: bytes, version: Version, *, bone_markers: bool) -> tuple[Model, ...]:
    reader = Reader(payload, f"NatNet {version[0]}.{version[1]} model definitions")
    sized = version >= (4, 1)
    models: list[Model] = []
    for _ in range(reader.count(8 if sized else 5, "descriptions")):
        kind = reader.i32("the type of a description")
        if sized:
            reader.open_section_of(reader.i32("the size of a description"), "a description")
        if 0 <= kind <= 6:
            models.append(_read_model(reader, kind, version, bone_markers))
        elif not bone_markers:
            raise reader.error(f"description type {kind} is not known")
        elif sized:
            models.append(UnknownModel(kind, reader.raw(reader.left, "a description")))
        else:
            return tuple(models)
        reader.close_section(sized, version > (4, 2), "a description")
    reader.finish()
    return tuple(models)


def _read_model(reader: Reader, kind: int, version: Version, bone_markers: bool) -> Model:
    if kind == 0:
        return MarkerSetModel(reader.text("the name of a marker set"), _read_names(reader, "marker names"))
    if kind == 1:
        return _read_body(reader, version, True)
    if kind == 2:
        name = reader.text("the name of a skeleton")
        identity = reader.i32("the id of a skeleton")
        n = reader.count(_IDS.size + _OFFSET.size + 1, "bones")
        bones = tuple(_read_body(reader, version, bone_markers) for _ in range(n))
        return SkeletonModel(name, identity, bones, bone_markers)
    if kind == 3:
        identity = reader.i32("the id of a force plate")
        serial = reader.text("the serial number of a force plate")
        *values, plate_type, data_type = reader.values(_PLATE, "a force plate")
        return ForcePlateModel(
            identity, serial, tuple(values), plate_type, data_type, _read_names(reader, "channels of a force plate")
        )
    if kind == 4:
        identity = reader.i32("the id of a device")
        name = reader.text("the name of a device")
        serial = reader.text("the serial number of a device")
        device_type, data_type = reader.values(_TYPES, "the type of a device")
        return DeviceModel(identity, name, serial, device_type, data_type, _read_names(reader, "channels of a device"))
    if kind == 5:
        return CameraModel(reader.text("the name of a camera"), reader.values(_CAMERA, "the pose of a camera"))
    name = reader.text("the name of an asset")
    asset_type, identity = reader.values(_IDS, "the type and id of an asset")
    n = reader.count(_IDS.size + _OFFSET.size + 1, "rigid bodies of an asset")
    bodies = tuple(_read_body(reader, version, True) for _ in range(n))
    n = reader.count(23, "markers of an asset")
    return AssetModel(name, asset_type, identity, bodies, tuple(_read_asset_marker(reader) for _ in range(n)))


def _read_names(reader: Reader, of: str) -> tuple[str, ...]:
    return tuple(reader.text(of) for _ in range(reader.count(1, of)))


def _read_body(reader: Reader, version: Version, markers: bool) -> RigidBodyModel:
    name = reader.text("the name of a rigid body")
    identity, parent = reader.values(_IDS, "the ids of a rigid body")
    offset = reader.values(_OFFSET, "the offset of a rigid body")
    orientation = reader.values(_QUATERNION, "the orientation of a rigid body") if version >= (4, 2) else _IDENTITY
    if version < (3, 0) or not markers:
        return RigidBodyModel(name, identity, parent, offset, orientation)
    n = reader.count(16, "markers of a rigid body")
    positions = reader.points(n, "markers of a rigid body")
    labels = reader.array(_LABELS, n, "marker labels of a rigid body")
    names: tuple[str, ...] = ()
    if version >= (4, 0):
        names = tuple(reader.text("a marker's name") for _ in range(n))
    return RigidBodyModel(name, identity, parent, offset, orientation, positions, labels, names)


def _read_asset_marker(reader: Reader) -> AssetMarker:
    name = reader.text("the name of an asset's marker")
    identity = reader.i32("the id of an asset's marker")
    position = reader.values(_OFFSET, "an asset's marker")
    size = reader.values(F32, "the size of an asset's marker")[0]
    return AssetMarker(name, identity, position, size, reader.values(I16, "the parameters of an asset's marker")[0])


def encode_models(models: Sequence[Model], version: Version) -> bytes:
    """Payload of MODELDEF; fields the version does not have are left out."""
    sized = version >= (4, 1)
    parts = [I32.pack(len(models))]
    for model in models:
        kind = model.type if isinstance(model, UnknownModel) else _TYPE_OF[type(model)]
        body = _pack_model(model, version)
        parts += [I32.pack(kind), I32.pack(len(body)) if sized else b"", body]
    return b"".join(parts)


def _pack_model(model: Model, version: Version) -> bytes:
    match model:
        case MarkerSetModel():
            return pack_text(model.name) + _pack_names(model.marker_names)
        case RigidBodyModel():
            return _pack_body(model, version, True)
        case SkeletonModel():
            bones = b"".join(_pack_body(bone, version, model.bone_markers) for bone in model.bones)
            return pack_text(model.name) + I32.pack(model.id) + I32.pack(len(model.bones)) + bones
        case ForcePlateModel():
            values = _PLATE.pack(*model.values, model.plate_type, model.data_type)
            return I32.pack(model.id) + pack_text(model.serial) + values + _pack_names(model.channels)
        case DeviceModel():
            names = pack_text(model.name) + pack_text(model.serial)
            types = _TYPES.pack(model.device_type, model.data_type)
            return I32.pack(model.id) + names + types + _pack_names(model.channels)
        case CameraModel():
            return pack_text(model.name) + _CAMERA.pack(*model.pose)
        case AssetModel():
            bodies = b"".join(_pack_body(body, version, True) for body in model.bodies)
            markers = b"".join(
                pack_text(m.name) + I32.pack(m.id) + _OFFSET.pack(*m.position) + F32.pack(m.size) + I16.pack(m.params)
                for m in model.markers
            )
            return (
                pack_text(model.name)
                + _IDS.pack(model.asset_type, model.id)
                + I32.pack(len(model.bodies))
                + bodies
                + I32.pack(len(model.markers))
                + markers
            )
        case UnknownModel():
            return model.body


def _pack_names(names: Sequence[str]) -> bytes:
    return I32.pack(len(names)) + b"".join(pack_text(name) for name in names)


def _pack_body(body: RigidBodyModel, version: Version, markers: bool) -> bytes:
    parts = [pack_text(body.name), _IDS.pack(body.id, body.parent_id), _OFFSET.pack(*body.offset)]
    if version >= (4, 2):
        parts.append(_QUATERNION.pack(*body.orientation_xyzw))
    if version >= (3, 0) and markers:
        n = 0 if body.marker_positions is None else len(body.marker_positions)
        parts.append(I32.pack(n))
        if body.marker_positions is not None:
            labels = np.zeros(n, _LABELS) if body.marker_labels is None else body.marker_labels
            parts += [np.ascontiguousarray(body.marker_positions, "<f4").tobytes()]
            parts += [np.ascontiguousarray(labels, _LABELS).tobytes()]
        if version >= (4, 0):
            names = body.marker_names or ("",) * n
            parts += [pack_text(name) for name in names]
    return b"".join(parts)
