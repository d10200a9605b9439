"""Takes of several streams: bit for bit, in every state, and what is refused; takes of one stay what they were."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader

from core.errors import TakeError
from core.frames import InertialFrame, MarkerFrame, Standstill
from core.level import Level
from core.profile import load_profile
from core.streams import ClockSample, StreamInfo
from core.takes import writer as writer_module
from core.takes.container import MARK, RAW, SOLVED, TOPICS, clock_topic, frames_topic
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.recover import recover
from core.takes.seal import seal_take, update_info
from core.takes.take import FORMAT_VERSION, MOST_STREAMS, Mark, StreamCounts, TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.whole import write_take
from core.takes.writer import TakeWriter
from tests.core.takes import test_golden
from tests.core.takes.frames import (
    BONES,
    GLOVE,
    OPTICAL,
    OTHER,
    bits,
    clock_sample,
    inertial_frame,
    marker_frame,
    plain_bones,
    plain_frame,
    plain_sample,
    plain_solved,
    tracked_frame,
)
from tests.core.takes.plain_records import records
from tests.core.takes.several import STREAMS, Written, begin, events, held, record
from tests.some import some

PROFILE = load_profile("schroeder6")


def told(path: Path) -> dict[str, dict[str, str]]:
    with path.open("rb") as file:
        return {one.name: one.metadata for one in make_reader(file).iter_metadata()}


@pytest.mark.parametrize("sealed", [False, True])
def test_every_stream_gives_back_what_was_recorded(tmp_path: Path, sealed: bool) -> None:
    """Any numbers at all, in any order."""
    rng = np.random.default_rng(5)
    writer, written = TakeWriter(tmp_path / "take.mcap", TakeInfo("take"), PROFILE, STREAMS, OPTICAL.key), Written()
    make = {
        (GLOVE.key, False): inertial_frame, (OPTICAL.key, False): marker_frame, (OTHER.key, False): marker_frame,
        **{(info.key, True): clock_sample for info in STREAMS},
    }  # fmt: skip
    for _ in range(400):
        stream = STREAMS[rng.integers(3)].key
        one = make[stream, bool(rng.random() < 0.2)](rng)
        writer.raw(stream, one)
        written.add(stream, one)
        if stream == OPTICAL.key:
            written.add("", tracked_frame(rng, performers=1))
            writer.solved(written.solved[-1])
    assert writer.acknowledged == len(written.frames[OPTICAL.key])
    counts = replace(written.counts, late=2, repeated=3, untimed=4, lost=2)
    others = {**counts.others, GLOVE.key: replace(counts.others[GLOVE.key], received=400, late=1, lost=5)}
    others[GLOVE.key] = replace(others[GLOVE.key], dropped={"queue full": 400 - others[GLOVE.key].written})
    still = (Standstill(0.5, 0.75, 12.0, 3), Standstill(1.0, 1.0, 0.25))
    others[GLOVE.key] = replace(others[GLOVE.key], standstills=still)
    counts = replace(counts, others=others, standstills=still[1:])
    if sealed:
        writer.seal(counts)
    else:
        writer.close()
    with open_take(writer.path) as take:
        assert take.complete and take.sealed == sealed
        assert take.counts == (counts if sealed else None)
        assert held(take) == written.bits
        assert list(take.streams) == [OPTICAL.key, GLOVE.key, OTHER.key] and take.solving == OPTICAL.key
        assert bits(tuple(one.info for one in take.streams.values())) == bits((OPTICAL, GLOVE, OTHER))
        assert take.streams[OPTICAL.key].frames is take.raw
        assert take.streams[GLOVE.key].counts == (others[GLOVE.key] if sealed else None)
        assert sealed <= any(
            "neuron-1/right: Phalanx stood still" in text for text in take.verdict.headline.split(", ")
        )
        glove = take.streams[GLOVE.key].frames
        assert bits(glove[-1]) == bits(written.frames[GLOVE.key][-1])
        assert bits(tuple(glove[40:10:-7])) == bits(tuple(written.frames[GLOVE.key][40:10:-7]))


def test_channels_are_where_the_specification_puts_them(tmp_path: Path) -> None:
    assert (TOPICS[RAW], TOPICS[SOLVED], TOPICS[MARK]) == (1, 2, 3)
    for n in some(range(1, MOST_STREAMS + 1)):
        assert TOPICS[clock_topic(n)] == 3 * n + 1
        if n > 1:
            assert TOPICS[frames_topic(n, "markers")] == 3 * n - 1 and TOPICS[frames_topic(n, "inertial")] == 3 * n
    assert frames_topic(1, "markers") == RAW and len(TOPICS) == 3 * MOST_STREAMS + 1
    record(tmp_path / "take.mcap", 12, sealed=True)
    with (tmp_path / "take.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        topics = {channel.topic: number for number, channel in summary.channels.items()}
        assert topics == {topic: number for topic, number in TOPICS.items() if number <= 10}
        counted = summary.statistics.channel_message_counts
        assert counted == {1: 12, 2: 12, 3: 1, 4: 2, 6: 6, 7: 2, 8: 4}
        schemas = {channel.topic: summary.schemas[channel.schema_id].name for channel in summary.channels.values()}
        assert schemas[frames_topic(2, "inertial")] == "phalanx.take.InertialFrame"
        assert schemas[frames_topic(3, "markers")] == schemas[RAW] == "phalanx.take.RawFrame"
        assert schemas[clock_topic(2)] == "phalanx.take.ClockSample"


def test_the_version_is_the_lowest_that_says_what_there_is(tmp_path: Path) -> None:
    cast = [PROFILE, PROFILE]

    def version(profiles: object, streams: tuple[StreamInfo, ...], solving: str) -> tuple[str, str]:
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.mcap"
        TakeWriter(path, TakeInfo("take"), profiles, streams, solving).seal(TakeCounts(0, 0))  # type: ignore[arg-type]
        info = told(path)["phalanx.take"]
        return info["version"], info.get("streams", "")

    assert version(PROFILE, (), "") == ("1", "")
    assert version(PROFILE, (OPTICAL,), OPTICAL.key) == ("1", "1")
    assert version(cast, (OPTICAL,), OPTICAL.key) == ("2", "1")
    assert version(PROFILE, (OPTICAL, GLOVE), OPTICAL.key) == ("3", "1 2")
    assert version(cast, (OPTICAL, OTHER), OTHER.key) == ("3", "1 2")
    assert version(PROFILE, (OPTICAL,), "") == ("3", "2")
    assert version(PROFILE, (GLOVE,), "") == ("3", "2")
    assert FORMAT_VERSION == 3


@pytest.mark.parametrize("name", test_golden.TAKES)
def test_a_take_of_one_stream_is_what_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """Record by record, but for the schemas, and profiles that know more today."""
    monkeypatch.setattr(writer_module, "library_versions", writer_module.library_versions)  # the golden ones set it
    test_golden.write(tmp_path / "take.mcap", *test_golden.TAKES[name])

    def kept(path: Path) -> list[tuple[int, bytes]]:
        return [one for one in records(path) if one[0] not in (Opcode.SCHEMA, Opcode.ATTACHMENT)]

    golden = kept(test_golden.FOLDER / f"{name}.mcap")
    assert len(golden) > 2 * test_golden.N and kept(tmp_path / "take.mcap") == golden


def of_one(path: Path, streams: tuple[StreamInfo, ...], sealed: bool) -> None:
    key = streams[0].key if streams else ""
    writer = TakeWriter(path, replace(INFO, rate_hz=120), PROFILE, streams, key)
    for i in range(60):
        writer.raw(key, plain_frame(i))
        writer.solved(plain_solved(i))
        if streams and i % 10 == 0:
            writer.raw(key, plain_sample(i))
    writer.mark(Mark(0.1, "clap"))
    if sealed:
        writer.seal(TakeCounts(60, 60, solved=60))
    else:
        writer.close()


INFO = TakeInfo("take", "Ann", device={"kind": "natnet", "title": "Motive"})


@pytest.mark.parametrize("sealed", [False, True])
def test_what_a_stream_says_is_added_to_a_take_of_one_and_changes_nothing(tmp_path: Path, sealed: bool) -> None:
    """What programs of version 1 pass over: two records of metadata, a channel, its schema and its messages."""
    for name, streams in (("plain", ()), ("named", (OPTICAL,))):
        of_one(tmp_path / f"{name}.mcap", streams, sealed)
    plain, named = (records(tmp_path / f"{name}.mcap") for name in ("plain", "named"))
    left = list(named)
    for one in plain:
        if one in left:
            left.remove(one)
    kinds = sorted(opcode for opcode, _ in left)
    info = Opcode.METADATA  # `phalanx.take` names the stream
    assert kinds == sorted([info, Opcode.METADATA, Opcode.SCHEMA, Opcode.CHANNEL, *[Opcode.MESSAGE] * 6])
    (changed,) = (one for one in plain if one not in named)
    assert changed[0] == info and b"rate_hz" in changed[1]
    with open_take(tmp_path / "plain.mcap") as without, open_take(tmp_path / "named.mcap") as take:
        assert bits(tuple(take.raw)) == bits(tuple(without.raw)) and take.complete
        assert bits(tuple(take.streams[OPTICAL.key].clock)) == bits(tuple(plain_sample(i) for i in range(0, 60, 10)))
        assert without.solving == "" and list(without.streams) == [""]
        (stream,) = without.streams.values()
        assert (stream.info.kind, stream.info.title, stream.info.rate_hz) == ("natnet", "Motive", 120)
        assert stream.info.what == "markers" and stream.frames is without.raw and len(stream.clock) == 0
        assert stream.counts == (TakeCounts(60, 60, solved=60) if sealed else None)


def test_what_a_take_has_no_place_for_is_refused(tmp_path: Path) -> None:
    writer = begin(tmp_path / "take.mcap")
    size = writer.bytes_written
    for stream, one in some(
        (
            ("natnet-9/markers", plain_frame(0)),
            ("", plain_frame(0)),
            (GLOVE.key, plain_frame(0)),
            (OPTICAL.key, plain_bones(0)),
            (OPTICAL.key, plain_solved(0)),
            (OPTICAL.key, Mark(0.0)),
        )
    ):
        with pytest.raises(TakeError, match=f"no place for a {type(one).__name__} of stream {stream!r}"):
            writer.raw(stream, one)  # type: ignore[arg-type]
    assert writer.bytes_written == size
    writer.raw(OPTICAL.key, plain_frame(0))
    assert writer.acknowledged == 1
    writer.close()
    for names in some((BONES[:2], ("x",) * 1025)):
        with pytest.raises(TakeError, match="cannot be in a take, which takes 1024 at most, each with one"):
            begin(tmp_path / f"{len(names)}.mcap").raw(GLOVE.key, replace(plain_bones(0, 3), bone_names=names))
    nameless = TakeWriter(tmp_path / "nameless.mcap", TakeInfo("take"), PROFILE)
    with pytest.raises(TakeError, match="no place for a ClockSample"):
        nameless.raw("", plain_sample(0))


@pytest.mark.parametrize(
    ("streams", "solving", "words"),
    [
        ((OPTICAL, OPTICAL), OPTICAL.key, "need names that differ"),
        ((replace(OPTICAL, key=""),), "", "need names that differ"),
        ((GLOVE,), GLOVE.key, "Stream 'neuron-1/right' cannot be solved"),
        ((GLOVE, OPTICAL), "x", "There is natnet-1/markers."),
        ((replace(GLOVE, bone_names=("x",) * 1025), OPTICAL), OPTICAL.key, "has 1025 bones. A take has 1024 at most"),
        (tuple(replace(OPTICAL, key=f"{i}") for i in range(MOST_STREAMS)), "0", "64 streams in a take. It holds 63"),
    ],
)
def test_streams_that_no_take_can_have(
    tmp_path: Path, streams: tuple[StreamInfo, ...], solving: str, words: str
) -> None:
    with pytest.raises(TakeError) as caught:
        TakeWriter(tmp_path / "take.mcap", TakeInfo("take"), PROFILE, streams, solving)
    assert words in str(caught.value) and not list(tmp_path.iterdir())


def test_as_many_streams_as_there_may_be(tmp_path: Path) -> None:
    streams = tuple(replace(GLOVE, key=f"neuron-{i}") for i in range(MOST_STREAMS - 2)) + (OPTICAL,)
    writer = TakeWriter(tmp_path / "take.mcap", TakeInfo("take"), PROFILE, streams, OPTICAL.key)
    for i, info in enumerate(streams[:-1]):
        writer.raw(info.key, plain_bones(i))
    writer.seal(TakeCounts(0, 0))
    with open_take(writer.path) as take:
        assert list(take.streams) == [OPTICAL.key, *(info.key for info in streams[:-1])] and take.complete
        assert [one.frames[0].sequence for one in take.streams.values() if not one.solved] == list(range(62))


def test_gloves_alone_are_a_take(tmp_path: Path) -> None:
    """Poses may be of them; times count from the first pose, or else from the first frame."""
    for solved in (True, False):
        writer = TakeWriter(tmp_path / f"{solved}.mcap", TakeInfo("take"), PROFILE, (GLOVE,))
        for i in range(120):
            writer.raw(GLOVE.key, plain_bones(i))
            if solved:
                writer.solved(plain_solved(2 * i))
        writer.mark(Mark(0.5, "clap"))
        others = {GLOVE.key: StreamCounts(120, 120)}
        writer.seal(TakeCounts(0, 0, solved=120 * solved, length_s=5.0, first_s=1.0, others=others))
        with open_take(writer.path) as take:
            assert take.complete and len(take.raw) == 0 and list(take.streams) == [GLOVE.key] and take.solving == ""
            assert bits(tuple(take.streams[GLOVE.key].frames)) == bits(tuple(map(plain_bones, range(120))))
            np.testing.assert_allclose(take.streams[GLOVE.key].frames.times_s[[0, -1]], [0, 119 / 60], atol=1e-6)
            assert take.span_s == (-1.0, 4.0)
            holes = take.holes_in(GLOVE.key)
            np.testing.assert_allclose(holes.from_s, [-1.0, 2.0], atol=1e-6)
            np.testing.assert_allclose(holes.to_s, [0.0, 4.0], atol=1e-6)
        (tmp_path / "cut.mcap").write_bytes(writer.path.read_bytes()[:-100])
        recovered = recover(tmp_path / "cut.mcap")
        assert recovered.path is not None and recovered.complete and recovered.beside == 120
        assert verify(recovered.path).ok


@pytest.mark.parametrize("sealed", [False, True])
def test_notes_change_and_no_stream_does(tmp_path: Path, sealed: bool) -> None:
    written, _ = record(tmp_path / "take.mcap", 60, sealed)
    path = tmp_path / "take.mcap"
    for change in (lambda: seal_take(path), lambda: update_info(path, TakeInfo("x", notes="good"), [Mark(0.2, "b")])):
        change()
        with open_take(path) as take:
            assert held(take) == written.bits and take.complete and take.sealed
            assert take.counts == written.counts
            assert bits(tuple(one.info for one in take.streams.values())) == bits((OPTICAL, GLOVE, OTHER))
    with open_take(path) as take:
        assert take.info.notes == "good" and take.marks == (Mark(0.2, "b"),)
        assert verify(path).ok


def test_what_is_written_anew_with_other_poses_keeps_its_streams(tmp_path: Path) -> None:
    record(tmp_path / "take.mcap", 60, sealed=True)
    with open_take(tmp_path / "take.mcap") as take:
        pairs = zip(take.raw, map(plain_solved, range(60)), strict=True)
        n = write_take(tmp_path / "anew.mcap", take.info, (PROFILE,), pairs, take.marks, source=take)
        assert n == 60
    with open_take(tmp_path / "anew.mcap") as take, open_take(tmp_path / "take.mcap") as before:
        (of, _), (of_before, _) = held(take), held(before)
        assert of == of_before and take.solving == OPTICAL.key and take.complete
        assert order(take) == order(before)
        assert len(take.solved) == 60 and take.marks == before.marks
    assert verify(tmp_path / "anew.mcap").ok


def order(take: object) -> list[str]:
    """Topics of all that was recorded, in the order of the file."""
    places = sorted((*place, topic) for topic, frames in take.topics.items() for place in frames.order.T.tolist())  # type: ignore[attr-defined]
    return [topic for _, _, topic in places if topic != SOLVED]


def test_marks_count_from_the_first_frame_of_the_stream_that_was_solved(tmp_path: Path) -> None:
    """Also where another came before it: on a tool's time line they stand beside its frames."""
    writer = begin(tmp_path / "take.mcap")
    for i in range(60):
        writer.raw(GLOVE.key, plain_bones(i))
    for i in range(60, 120):
        writer.raw(OPTICAL.key, plain_frame(i, 4))
    writer.mark(Mark(0.25, "clap"))
    writer.close()
    for _ in range(2):
        with open_take(writer.path) as take:
            assert take.raw.times_s[0] == 0 and take.streams[GLOVE.key].frames.times_s[0] == -0.5
            clap_ns = take.mark_records._places[2, 0]
            assert clap_ns == take.start_ns + 250_000_000
        update_info(writer.path, TakeInfo("take"), [Mark(0.25, "clap")])


def test_each_stream_is_checked(tmp_path: Path) -> None:
    writer = TakeWriter(tmp_path / "take.mcap", TakeInfo("take", rate_hz=120), PROFILE, STREAMS, OPTICAL.key)
    for i in range(120):
        writer.raw(OPTICAL.key, plain_frame(i))
        writer.solved(plain_solved(i))
        if i % 2 == 0 and not 30 <= i < 90:
            writer.raw(GLOVE.key, plain_bones(i // 2))
    others = {GLOVE.key: StreamCounts(33, 30, {"queue full": 3}, 27, 1), OTHER.key: StreamCounts(2, 1)}
    writer.seal(TakeCounts(120, 120, solved=120, length_s=1.0, first_s=0.0, others=others))
    report = verify(writer.path)
    texts = {finding.level: [] for finding in report.findings}
    for finding in report.findings:
        texts[finding.level].append(finding.text)
    assert sorted(texts["problem"]) == [
        "1 frame of stream natnet-2/markers cannot be read.",
        "It should hold 1 frame of stream natnet-2/markers and holds 0.",
        "Stream natnet-2/markers: Its counts do not balance: received 2, written 1, dropped 0.",
    ]
    assert texts["warning"] == [
        "Stream neuron-1/right: 3 frames were dropped while recording: 3 queue full.",
        "Stream neuron-1/right: 27 frames of the device never arrived.",
        "Stream neuron-1/right: 1 packet could not be read.",
        "Stream neuron-1/right: 0.50 s without frames, about 30: nothing came then.",
        "Stream natnet-2/markers: 1.0 s without frames, about 100: nothing came then.",
    ]
    assert report.streams == {GLOVE.key: 30, OTHER.key: 0}
    with open_take(writer.path) as take:
        assert take.verdict.level is Level.PROBLEM and take.holes.seconds == 0
        shorts = [finding.short for finding in take.verdict.findings]
        assert "neuron-1/right: 3 dropped" in shorts and "natnet-2/markers: no frames" in shorts
        assert "Stream neuron-1/right: 3 frames dropped: queue full." in take.verdict.texts


def test_the_verdict_on_gloves_alone_is_on_their_frames(tmp_path: Path) -> None:
    writer = TakeWriter(tmp_path / "take.mcap", TakeInfo("take"), PROFILE, (GLOVE,))
    for i in range(60):
        writer.raw(GLOVE.key, plain_bones(i))
    writer.seal(TakeCounts(0, 0, length_s=1.0, first_s=0.0, others={GLOVE.key: StreamCounts(60, 60)}))
    with open_take(writer.path) as take:
        assert take.verdict.findings == () and take.verdict.headline == "60 frames, none lost"
    assert verify(writer.path).findings == ()


def test_a_take_of_several_is_a_recording_of_the_one_that_was_solved(tmp_path: Path) -> None:
    record(tmp_path / "take.mcap", 60, sealed=True)
    assert read_recording(tmp_path / "take.mcap").points_m.shape == (60, 4, 3)


def test_what_is_in_a_session_is_of_the_kinds_it_says() -> None:
    kinds = {(stream, type(one)) for stream, one in events(12)}
    assert {(GLOVE.key, InertialFrame), (OTHER.key, MarkerFrame), (GLOVE.key, ClockSample)} < kinds
    assert BONES[:1] == ("RightHand",)


@pytest.mark.parametrize("streams", [(), (OPTICAL,), STREAMS])
def test_a_take_into_which_nothing_came_is_one_hole(tmp_path: Path, streams: tuple[StreamInfo, ...]) -> None:
    solving = OPTICAL.key if streams else ""
    writer = TakeWriter(tmp_path / "take.mcap", TakeInfo("take", rate_hz=120), PROFILE, streams, solving)
    writer.seal(TakeCounts(0, 0, length_s=5.0))
    with open_take(writer.path) as take:
        assert take.span_s == (0.0, 5.0) and take.complete
        assert [take.holes_in(key).seconds for key in take.streams] == [5.0] * max(len(streams), 1)
