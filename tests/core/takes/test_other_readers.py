"""A take as other MCAP tools see it: read with the plain mcap library and the schema in the file, nothing of ours."""

from __future__ import annotations

import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import NonSeekingReader, make_reader
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from core.hand.skeleton import DOF_NAMES
from core.profile import load_profile
from core.takes.reader import open_take
from core.takes.schemas import descriptor_set
from core.takes.take import Mark, TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.core.takes.frames import bits, marker_frame, tracked_frame
from tests.data import ROOT

N = 120


@pytest.fixture(params=[False, True], ids=["unsealed", "sealed"])
def take_path(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    rng = np.random.default_rng(3)
    writer = TakeWriter(tmp_path / "take.mcap", TakeInfo("take", rate_hz=120), load_profile("han19"))
    for _ in range(N):
        writer.raw("", marker_frame(rng))
        writer.solved(tracked_frame(rng, performers=1))
    writer.mark(Mark(0.5, "clap"))
    if request.param:
        writer.seal(TakeCounts(N, N, solved=N))
    else:
        writer.close()
    return writer.path


def decoder(schema: Any) -> Any:
    assert schema.encoding == "protobuf"
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name)).FromString


def messages(path: Path) -> dict[str, list[Any]]:
    """Decoded messages by topic, of a file of any state, by StreamReader as a tool would use it."""
    schemas, channels, found = {}, {}, {"/raw": [], "/solved": [], "/mark": []}
    with path.open("rb") as file:
        try:
            for record in StreamReader(file).records:
                match type(record).__name__:
                    case "Schema":
                        schemas[record.id] = decoder(record)
                    case "Channel":
                        channels[record.id] = record
                    case "Message":
                        channel = channels[record.channel_id]
                        assert channel.message_encoding == "protobuf"
                        found[channel.topic].append(schemas[channel.schema_id](record.data))
        except Exception as error:  # the library's own way to say that there is no footer
            assert type(error).__name__ == "EndOfFile"
    return found


def test_every_number_is_read_by_others(take_path: Path) -> None:
    found = messages(take_path)
    with open_take(take_path) as take:
        for message, frame in zip(found["/raw"], take.raw, strict=True):
            assert message.sequence == frame.sequence
            assert bits(np.array(message.points_m).reshape(-1, 3)) == bits(frame.points_m)
            assert list(message.ids) == frame.ids.tolist()
            assert bits(message.host_s) == bits(frame.times.host_s)
            assert [body.name for body in message.rigid_bodies] == [body.name for body in frame.rigid_bodies]
        for message, frame in zip(found["/solved"], take.solved, strict=True):
            assert len(message.hands) == len(frame.hands)
            for hand, ours in zip(message.hands, frame.hands, strict=True):
                side = hand.DESCRIPTOR.fields_by_name["side"].enum_type.values_by_number[hand.side].name
                assert side == f"SIDE_{ours.side.upper()}"
                state = hand.DESCRIPTOR.fields_by_name["state"].enum_type.values_by_number[hand.state].name
                assert state == f"STATE_{ours.state.name}"
                assert bits(np.array(hand.theta_rad)) == bits(ours.theta_rad)
                assert bits(np.array(hand.joints_world).reshape(16, 4, 4)) == bits(ours.joints_world)
            assert {stage.name: bits(stage.seconds) for stage in message.stages} == {
                name: bits(seconds) for name, seconds in frame.stage_s.items()
            }
    assert [(mark.time_s, mark.text) for mark in found["/mark"]] == [(0.5, "clap")]


def test_the_checksum_is_a_field_like_any_other(take_path: Path) -> None:
    raw = messages(take_path)["/raw"]
    assert len(raw) == N
    for message in raw:
        data = message.SerializeToString()
        assert data[-5] == 0x7D
        assert message.crc32 == int.from_bytes(data[-4:], "little") == zlib.crc32(data[:-5])


@pytest.mark.parametrize("take_path", [True], indirect=True)
def test_index_metadata_and_attachments_are_read_by_others(take_path: Path) -> None:
    with take_path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "phalanx"
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        assert metadata["phalanx.take"]["name"] == "take"
        assert metadata["phalanx.counts"]["received"] == str(N)
        (attachment,) = reader.iter_attachments()
        assert attachment.name == "profile.json"
        assert attachment.data.decode() == load_profile("han19").to_json()
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        assert summary.statistics.message_count == 2 * N + 1
        assert {channel.topic for channel in summary.channels.values()} == {"/raw", "/solved", "/mark"}
        assert len(list(reader.iter_messages(topics=["/solved"]))) == N
        file.seek(0)
        assert sum(1 for _ in NonSeekingReader(file).iter_messages()) == 2 * N + 1


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("crcs", [False, True])
def test_a_take_that_another_tool_wrote_anew_is_still_a_take(
    take_path: Path, compression: CompressionType, crcs: bool
) -> None:
    """As `mcap compress` and `mcap recover` do: other chunks, other channel ids, a topic and records of its own."""
    target = take_path.with_name("anew.mcap")
    schemas, channels = {}, {}
    with take_path.open("rb") as file:
        writer = Writer(str(target), chunk_size=5000, compression=compression, enable_crcs=crcs, enable_data_crcs=crcs)
        extra = 0
        try:
            for record in StreamReader(file).records:
                match type(record).__name__:
                    case "Header":
                        writer.start(record.profile, "another tool")
                        extra = writer.register_channel("/notes", "json", 0)
                    case "Metadata":
                        writer.add_metadata(record.name, record.metadata)
                    case "Attachment":
                        writer.add_attachment(0, 0, record.name, record.media_type, record.data)
                    case "Schema":
                        schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
                    case "Channel":
                        if record.id not in channels:  # a sealed file shows each twice
                            schema_id = schemas[record.schema_id]
                            channels[record.id] = writer.register_channel(record.topic, "protobuf", schema_id)
                    case "Message":
                        writer.add_message(
                            channels[record.channel_id],
                            record.log_time,
                            record.data,
                            record.publish_time,
                            record.sequence,
                        )
                        writer.add_message(extra, record.log_time, b"{}", record.publish_time)
        except Exception as error:
            assert type(error).__name__ == "EndOfFile"
        writer.finish()
    with open_take(take_path) as take, open_take(target) as anew:
        assert anew.sealed and anew.complete
        assert bits(tuple(anew.raw)) == bits(tuple(take.raw))
        assert bits(tuple(anew.solved)) == bits(tuple(take.solved))
        assert anew.marks == take.marks and anew.counts == take.counts and anew.info == take.info
    report = verify(target)
    assert report.ok and (report.counts is None) == any("no counts" in one.text for one in report.findings)


def test_the_specification_shows_these_messages() -> None:
    text = (ROOT / "docs" / "take-format.md").read_text(encoding="utf-8")
    (shown,) = re.findall(r"```proto\n(.*?)```", text, re.DOTALL)
    (file,) = descriptor_pb2.FileDescriptorSet.FromString(descriptor_set()).file
    kinds = {1: "double", 2: "float", 8: "bool", 9: "string", 7: "fixed32", 13: "uint32", 18: "sint64"}
    lines = [f'syntax = "{file.syntax}";', f"package {file.package};"]
    for enum in file.enum_type:
        lines += ["", f"enum {enum.name} {{", *(f"  {value.name} = {value.number};" for value in enum.value), "}"]
    for message in file.message_type:
        lines += ["", f"message {message.name} {{"]
        for field in message.field:
            kind = field.type_name.rsplit(".", 1)[-1] if field.type_name else kinds[field.type]
            rule = "repeated " if field.label == field.LABEL_REPEATED else "optional " * field.proto3_optional
            lines.append(f"  {rule}{kind} {field.name} = {field.number};")
        lines.append("}")
    assert shown == "\n".join(lines) + "\n"


def test_the_specification_names_the_numbers_of_a_pose_in_order() -> None:
    text = (ROOT / "docs" / "take-format.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \| `(\w+)` \| (m|rad) \|$", text, re.MULTILINE)
    assert rows == [(str(i), name, "m" if i < 3 else "rad") for i, name in enumerate(DOF_NAMES)]
