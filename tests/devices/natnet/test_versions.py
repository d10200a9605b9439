"""Every bitstream layout, 2.5 to 4.4: round trips of full frames, recognition, prefixes, hostile counts."""

from __future__ import annotations

import contextlib
import math
import random
import struct
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from core.errors import FormatError
from devices.natnet.frames import LAYOUTS, decode_frame, detect_version, encode_frame
from devices.natnet.models import (
    AssetMarker,
    AssetModel,
    CameraModel,
    DeviceModel,
    ForcePlateModel,
    MarkerSetModel,
    Model,
    RigidBodyModel,
    SkeletonModel,
    UnknownModel,
    decode_models,
    encode_models,
)
from devices.natnet.records import (
    LABELLED,
    RIGID_BODY,
    Analog,
    Asset,
    Bodies,
    BodyMarkers,
    FrameOfData,
    MarkerSet,
    Skeleton,
)
from devices.natnet.wire import Version
from tests.some import some

VERSIONS: list[Version] = [
    *((2, minor) for minor in range(5, 11)),
    *((3, minor) for minor in range(2)),
    *((4, minor) for minor in range(5)),
]


def version_id(version: Version) -> str:
    return f"{version[0]}.{version[1]}"


every_version = pytest.mark.parametrize("version", VERSIONS, ids=version_id)

every_layout = pytest.mark.parametrize("version", [*LAYOUTS, (4, 2), (4, 4)], ids=version_id)


def random_points(rng: np.random.Generator, n: int) -> np.ndarray:
    return rng.normal(size=(n, 3)).astype(np.float32)


def random_records(rng: np.random.Generator, dtype: np.dtype, n: int) -> np.ndarray:
    records = np.zeros(n, dtype)
    for name in dtype.names or ():
        field = records[name]
        records[name] = rng.normal(size=field.shape) if field.dtype.kind == "f" else rng.integers(0, 999, field.shape)
    return records


def random_bodies(rng: np.random.Generator, n: int, version: Version) -> Bodies:
    markers = ()
    if version < (3, 0):
        sizes = rng.integers(0, 4, n)
        markers = tuple(
            BodyMarkers(
                random_points(rng, m), rng.integers(0, 99, m).astype(np.int32), rng.normal(size=m).astype(np.float32)
            )
            for m in sizes
        )
    return Bodies(random_records(rng, RIGID_BODY, n), markers)


def random_analog(rng: np.random.Generator) -> tuple[Analog, ...]:
    return tuple(
        Analog(i, tuple(rng.normal(size=k).astype(np.float32) for k in rng.integers(0, 5, 3))) for i in range(2)
    )


def random_frame(version: Version, seed: int = 0) -> FrameOfData:
    """A frame with every section filled, hostile text included."""
    rng = np.random.default_rng(seed)
    return FrameOfData(
        number=int(rng.integers(1 << 30)),
        marker_sets=(
            MarkerSet("Händschuh", random_points(rng, 3)),
            MarkerSet("", random_points(rng, 0)),
            MarkerSet(b"\xff\xfe".decode("utf-8", "surrogateescape"), random_points(rng, 2)),
        ),
        unlabelled=random_points(rng, 5),
        rigid_bodies=random_bodies(rng, 3, version),
        skeletons=tuple(Skeleton(i, random_bodies(rng, 4, version)) for i in range(2)),
        assets=(Asset(3, random_records(rng, RIGID_BODY, 2), random_records(rng, LABELLED, 4)),),
        labelled=random_records(rng, LABELLED, 7),
        force_plates=random_analog(rng),
        devices=random_analog(rng),
        software_latency_s=0.5,
        timecode=0x01020304,
        timecode_subframe=7,
        timestamp_s=1.5,
        mid_exposure_ticks=1 << 40,
        data_received_ticks=(1 << 40) + 1,
        transmit_ticks=(1 << 40) + 2,
        precision_s=99,
        precision_fraction=1 << 31,
        params=5,
    )


@every_version
def test_full_frames_round_trip(version: Version) -> None:
    for seed in range(20):
        sent = random_frame(version, seed)
        payload = encode_frame(sent, version)
        got = decode_frame(payload, version)
        assert encode_frame(got, version) == payload
        assert got.number == sent.number
        assert [s.name for s in got.marker_sets] == [s.name for s in sent.marker_sets]
        assert np.array_equal(got.unlabelled, sent.unlabelled)
        for name in ("id", "position", "orientation_xyzw", "error"):
            assert np.array_equal(got.rigid_bodies.poses[name], sent.rigid_bodies.poses[name])
        assert [len(s.bones.poses) for s in got.skeletons] == [4, 4]
        for name in ("id", "position", "size"):
            assert np.array_equal(got.labelled[name], sent.labelled[name])
        assert (got.timecode, got.timecode_subframe) == (sent.timecode, sent.timecode_subframe)


@every_version
def test_each_version_has_its_fields(version: Version) -> None:
    sent = random_frame(version)
    got = decode_frame(encode_frame(sent, version), version)
    assert got.params == (sent.params if version >= (2, 6) else 0)
    assert got.timestamp_s == 1.5 if version >= (2, 6) else math.isnan(got.timestamp_s)
    assert np.isnan(got.labelled["residual"]).all() == (version < (3, 0))
    assert len(got.force_plates) == (2 if version >= (2, 9) else 0)
    assert len(got.devices) == (2 if version >= (3, 0) else 0)
    assert got.software_latency_s == (0.5 if version < (3, 0) else 0.0)
    assert bool(got.rigid_bodies.markers) == (version < (3, 0))
    assert got.mid_exposure_ticks == (sent.mid_exposure_ticks if version >= (3, 0) else 0)
    assert len(got.assets) == (1 if version >= (4, 1) else 0)
    assert got.precision_fraction == (sent.precision_fraction if version >= (4, 1) else 0)


@every_version
def test_the_layout_is_recognised(version: Version) -> None:
    layout = next(known for known in LAYOUTS if version >= known)
    assert detect_version(encode_frame(random_frame(version), version)) == layout
    assert detect_version(encode_frame(FrameOfData(number=1, timestamp_s=0.0), version)) == layout
    assert detect_version(b"") is None


@every_version
def test_every_prefix_and_every_extra_byte_is_refused(version: Version) -> None:
    payload = encode_frame(random_frame(version), version)
    for n in range(len(payload)):
        with pytest.raises(FormatError):
            decode_frame(payload[:n], version)
    with pytest.raises(FormatError, match="left over"):
        decode_frame(payload + b"\0", version)


@every_layout
def test_corrupted_frames_decode_or_raise_the_one_error(version: Version) -> None:
    chance = random.Random(5)
    payload = encode_frame(random_frame(version), version)
    models = encode_models(random_models(version), version)
    for _ in range(800):
        for whole, decode in ((payload, decode_frame), (models, decode_models)):
            broken = bytearray(whole)
            for _ in range(chance.choice((1, 2, 10))):
                broken[chance.randrange(len(broken))] = chance.choice((0, 1, 0x7F, 0x80, 0xFF, chance.randrange(256)))
            with contextlib.suppress(FormatError):
                decode(bytes(broken), version)
            detect_version(bytes(broken))


@every_layout
def test_hostile_counts_take_no_memory(version: Version) -> None:
    """A count of two thousand million in any place of four bytes: an error, before anything of that size is made."""
    payload = encode_frame(random_frame(version), version)
    models = encode_models(random_models(version), version)
    tracemalloc.start()
    for whole, decode in ((payload, decode_frame), (models, decode_models)):
        for at in range(0, len(whole) - 3, 2):
            for count in (0x7FFFFFFF, 0x00FFFFFF):
                broken = whole[:at] + struct.pack("<i", count) + whole[at + 4 :]
                with contextlib.suppress(FormatError):
                    decode(broken, version)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4 << 20


@pytest.mark.parametrize("version", [(4, 3), (4, 4)], ids=version_id)
def test_later_servers_may_append_to_sections_and_records(version: Version) -> None:
    """From 4.1 on each section tells its size; what a later version adds is skipped."""
    frame = replace(
        FrameOfData(number=9, timestamp_s=2.0),
        labelled=random_records(np.random.default_rng(1), LABELLED, 3),
    )
    payload = encode_frame(frame, version)
    body = frame.labelled.tobytes()
    grown = b"".join(body[i * 26 : (i + 1) * 26] + b"more" for i in range(3))
    head = struct.pack("<ii", 3, len(body))
    assert payload.count(head + body) == 1
    later = payload.replace(head + body, struct.pack("<ii", 3, len(grown)) + grown)
    assert np.array_equal(decode_frame(later, version).labelled, frame.labelled)
    with pytest.raises(FormatError):
        decode_frame(later, (4, 2))


def test_versions_before_2_5_are_named() -> None:
    with pytest.raises(FormatError, match=r"NatNet 2\.4 is too old"):
        decode_frame(b"", (2, 4))


def test_end_of_data_is_mandatory() -> None:
    payload = encode_frame(FrameOfData(number=1, timestamp_s=0.0), (3, 0))
    with pytest.raises(FormatError, match="end of data is 1, not 0"):
        decode_frame(payload[:-4] + b"\1\0\0\0", (3, 0))


# ---- model definitions


def random_body(version: Version, seed: int) -> RigidBodyModel:
    rng = np.random.default_rng(seed)
    body = RigidBodyModel(f"Body {seed}", seed, -1, (1.0, 2.0, 3.0))
    if version >= (4, 2):
        body = replace(body, orientation_xyzw=(0.5, 0.5, 0.5, -0.5))
    if version >= (3, 0):
        body = replace(
            body,
            marker_positions=random_points(rng, 3),
            marker_labels=np.arange(3, dtype=np.int32),
            marker_names=("a", "b", "c") if version >= (4, 0) else (),
        )
    return body


def random_models(version: Version) -> list[Model]:
    models: list[Model] = [
        MarkerSetModel("all", ("one", "two")),
        random_body(version, 5),
        SkeletonModel("Anna", 2, (random_body(version, 1), random_body(version, 2))),
        CameraModel("Prime 13 #1", (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)),
    ]
    if version >= (3, 0):
        plate = tuple(float(i) for i in range(2 + 3 + 144 + 12))
        models.append(ForcePlateModel(1, "S123", plate, 2, 1, ("Fx", "Fy")))
        models.append(DeviceModel(4, "NIDAQ", "N1", 1, 2, ("ch1", "ch2", "ch3")))
    if version >= (4, 1):
        marker = AssetMarker("m", 1, (0.5, 0.25, 0.125), 0.5, 3)
        models.append(AssetModel("Glove", 1, 9, (random_body(version, 3),), (marker, marker)))
        models.append(UnknownModel(42, b"of a later version"))
    return models


@every_version
def test_model_definitions_round_trip(version: Version) -> None:
    models = random_models(version)
    payload = encode_models(models, version)
    got = decode_models(payload, version)
    assert encode_models(got, version) == payload
    assert [type(model) for model in got] == [type(model) for model in models]
    for model, sent in zip(got, models, strict=True):
        if not isinstance(sent, RigidBodyModel | SkeletonModel | AssetModel):
            assert model == sent
        else:
            assert (model.name, model.id) == (sent.name, sent.id)


@every_version
def test_truncated_model_definitions_are_refused(version: Version) -> None:
    payload = encode_models(random_models(version), version)
    for n in some(range(len(payload))):
        with pytest.raises(FormatError):
            decode_models(payload[:n], version)


def test_bones_without_markers_are_understood() -> None:
    """Some servers leave the marker fields of bones out; only the total length tells."""
    bones = tuple(replace(random_body((2, 9), i)) for i in range(3))
    payload = encode_models([SkeletonModel("Anna", 2, bones, bone_markers=False)], (3, 1))
    (got,) = decode_models(payload, (3, 1))
    assert isinstance(got, SkeletonModel)
    assert [bone.name for bone in got.bones] == ["Body 0", "Body 1", "Body 2"]
    assert not got.bone_markers


def test_unknown_types_end_the_list_of_an_old_server() -> None:
    payload = encode_models([MarkerSetModel("all", ()), UnknownModel(42, b"what?")], (3, 0))
    assert decode_models(payload, (3, 0)) == (MarkerSetModel("all", ()),)
