"""The command line on takes of several streams."""

from __future__ import annotations

import json
from pathlib import Path

from app.review.take_streams import stream_rows
from core.profile import load_profile
from core.takes.reader import open_take
from core.takes.take import StreamCounts, TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.app.command import phalanx
from tests.core.takes.frames import GLOVE, OPTICAL, OTHER, plain_bones, plain_frame
from tests.core.takes.several import held, record


def test_info_verify_and_recover_tell_of_every_stream(tmp_path: Path) -> None:
    written, _ = record(tmp_path / "take.mcap", 60, sealed=True)
    info = phalanx("info", tmp_path / "take.mcap", "--json")
    assert info.code == 0
    assert "natnet-1/markers was solved, beside it 2 more\n" in info.out
    assert "neuron-1/right (Perception Neuron): 17 bones, 30 frames at 60 Hz, 10 clock samples" in info.out
    assert "natnet-2/markers: received 20 = written 20 + dropped 0; lost before this machine 0" in info.out
    streams = info.figures["streams"]
    assert list(streams) == [OPTICAL.key, GLOVE.key, OTHER.key]
    assert [one["solved"] for one in streams.values()] == [True, False, False]
    assert [one["frames"] for one in streams.values()] == [60, 30, 20]
    assert (streams[GLOVE.key]["sides"], streams[OTHER.key]["ids"]) == (["right"], "marker")
    verified = phalanx("verify", tmp_path / "take.mcap", "--json")
    assert verified.code == 0 and verified.figures["streams"] == streams
    assert (
        "60 raw and 60 solved frames, 1 mark, neuron-1/right: 30 frames, natnet-2/markers: 20 frames." in verified.out
    )
    data = (tmp_path / "take.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[:-50])
    recovered = phalanx("recover", tmp_path / "cut.mcap", "--json")
    assert recovered.code == 0 and "and 50 frames of other streams recovered, nothing lost" in recovered.out
    of = recovered.figures["streams"]
    assert {key: (one["recovered"], one["lost"]) for key, one in of.items()} == {
        OPTICAL.key: (60, 0), GLOVE.key: (30, 0), OTHER.key: (20, 0),
    }  # fmt: skip
    exported = phalanx("export", tmp_path / "take.mcap", "--to", "points", "--out", tmp_path / "out", "--json")
    left_out = (
        "neuron-1/right (30 frames) and natnet-2/markers (20 frames) are not in these files: exports hold the stream "
        "that was solved. They are in the take."
    )
    assert exported.code == 0 and exported.figures["notes"] == [left_out] and left_out in exported.err
    said = json.loads((tmp_path / "out" / "take_export.json").read_text(encoding="utf-8"))
    assert said["recording"]["left_out"] == left_out
    with open_take(recovered.figures["recovered_take"]) as take:
        assert held(take) == written.bits and take.counts == written.counts


def test_every_device_has_a_line_of_its_own_and_its_stream_the_address_of_it(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    about = {"kind": "natnet", "title": "Motive 3.1", "Server": "10.0.0.2"}
    about |= {f"natnet-2: {name}": text for name, text in {**about, "Server": "10.0.0.3"}.items()}
    writer = TakeWriter(path, TakeInfo("take", device=about), load_profile("schroeder6"), (OTHER, OPTICAL), OPTICAL.key)
    for i in range(20):
        for stream in (OTHER, OPTICAL):
            writer.raw(stream.key, plain_frame(i, 2))
    writer.seal(TakeCounts(20, 20, others={OTHER.key: StreamCounts(20, 20)}))
    lines = phalanx("info", path).out.splitlines()
    assert "Device     natnet-1: kind: natnet, title: Motive 3.1, Server: 10.0.0.2" in lines
    assert "           natnet-2: kind: natnet, title: Motive 3.1, Server: 10.0.0.3" in lines
    with open_take(path) as take:
        tips = {row.name: row.tip.splitlines() for row in stream_rows(take)}
    assert "Server: 10.0.0.2" in tips[OPTICAL.key] and "Server: 10.0.0.3" in tips[OTHER.key]
    assert "Server: 10.0.0.3" not in tips[OPTICAL.key]


def test_a_take_of_a_glove_alone_is_told_of_and_no_recording_of_markers(tmp_path: Path) -> None:
    path = tmp_path / "glove.mcap"
    writer = TakeWriter(path, TakeInfo("glove"), load_profile("schroeder6"), (GLOVE,))
    for i in range(60):
        writer.raw(GLOVE.key, plain_bones(i))
    writer.seal(TakeCounts(0, 0, length_s=1.0, first_s=0.0, others={GLOVE.key: StreamCounts(60, 60)}))
    info = phalanx("info", path)
    assert info.code == 0 and "1 stream, none was solved" in info.out and "green: 60 frames, none lost" in info.out
    assert phalanx("verify", path).code == 0
    tracked = phalanx("track", path, "--out", tmp_path / "out")
    exported = phalanx("export", path, "--to", "csv", "--out", tmp_path / "out")
    assert exported.code == 1 and "glove holds no frames of markers" in exported.err and GLOVE.key in exported.err
    assert tracked.code == 1 and "glove.mcap holds no frames of markers" in tracked.err and GLOVE.key in tracked.err


def test_a_take_of_one_stream_is_told_of_as_before(tmp_path: Path) -> None:
    from tests.core.takes.test_streams import of_one

    of_one(tmp_path / "take.mcap", (OPTICAL,), sealed=True)
    info = phalanx("info", tmp_path / "take.mcap", "--json")
    assert info.code == 0 and "Streams" not in info.out and list(info.figures["streams"]) == [OPTICAL.key]


def test_what_is_solved_again_keeps_its_streams(tmp_path: Path) -> None:
    record(tmp_path / "take.mcap", 30, sealed=True)
    ran = phalanx("track", tmp_path / "take.mcap", "--out", tmp_path / "out", "--take", "--json")
    assert ran.code in (0, 3), ran.err  # there is no hand in it
    with open_take(tmp_path / "take.mcap") as take, open_take(tmp_path / "out" / "take" / "take.mcap") as again:
        assert held(again)[0] == held(take)[0] and again.complete  # type: ignore[index]
        assert again.counts is not None and take.counts is not None and again.counts.others == take.counts.others
    assert verify(tmp_path / "out" / "take" / "take.mcap").ok
