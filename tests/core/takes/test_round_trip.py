from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from core.errors import FormatError, TakeError
from core.frames import Standstill, Times, TrackedFrame
from core.profile import load_profile
from core.takes.codec import (
    decode_clock,
    decode_inertial,
    decode_mark,
    decode_raw,
    decode_solved,
    encode_clock,
    encode_inertial,
    encode_mark,
    encode_raw,
    encode_solved,
)
from core.takes.reader import open_take
from core.takes.seal import update_info
from core.takes.take import Mark, TakeCounts, TakeInfo, info_from_text, info_to_text
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.core.takes.frames import (
    bits,
    clock_sample,
    floats,
    inertial_frame,
    marker_frame,
    plain_frame,
    tracked_frame,
)

INFO = TakeInfo(
    name="Åsa_wave_001",
    performer="Åsa",
    created_utc=datetime(2025, 3, 14, 15, 9, 26, 535897, tzinfo=UTC),
    rate_hz=119.88,
    device={"kind": "natnet", "server": "Motive 3.1"},
    notes='two lines\nand "quotes"',
    rating="alt",
)


@pytest.mark.parametrize("seed", range(60))
def test_every_bit_of_a_frame_survives(seed: int) -> None:
    rng = np.random.default_rng(seed)
    raw, solved = marker_frame(rng), tracked_frame(rng)
    assert bits(decode_raw(encode_raw(raw))) == bits(raw)
    assert bits(decode_solved(encode_solved(solved))) == bits(solved)
    mark = Mark(float(floats(rng, 1)[0]), "clap 手")
    assert bits(decode_mark(encode_mark(mark))) == bits(mark)
    bones, sample = inertial_frame(rng), clock_sample(rng)
    assert bits(decode_inertial(encode_inertial(bones))) == bits(bones)
    assert bits(decode_clock(encode_clock(sample))) == bits(sample)


def frame_with_a_hand() -> TrackedFrame:
    return next(frame for frame in map(tracked_frame, map(np.random.default_rng, range(9))) if frame.hands)


def test_standard_deviations_are_kept_to_single_precision() -> None:
    frame = frame_with_a_hand()
    hand = replace(frame.hands[0], theta_std=np.linspace(1e-6, 3.0, 26), marker_std_m=np.full(19, np.pi / 1000))
    hand = replace(hand, markers_world_m=np.zeros((19, 3)), point=np.arange(19), confidence=np.ones(19))
    hand.theta_std[[0, 1]] = (np.nan, 1e300)
    (read,) = decode_solved(encode_solved(replace(frame, hands=(hand,)))).hands
    assert read.theta_std.dtype == read.marker_std_m.dtype == np.float64
    np.testing.assert_allclose(read.theta_std[2:], hand.theta_std[2:], rtol=2**-24)
    np.testing.assert_allclose(read.marker_std_m, hand.marker_std_m, rtol=2**-24)
    assert np.isnan(read.theta_std[0]) and read.theta_std[1] == np.inf


def test_whose_hand_it_is_and_how_sure_its_labels_are_is_kept() -> None:
    frame = frame_with_a_hand()
    hand = replace(frame.hands[0], performer=2, why="two hands alike", markers_world_m=np.zeros((3, 3)))
    hand = replace(hand, point=np.arange(3), confidence=np.ones(3), marker_std_m=np.ones(3))
    hand = replace(hand, label_confidence=np.array([1.0, 1 / 3, np.nan]))
    (read,) = decode_solved(encode_solved(replace(frame, hands=(hand,)))).hands
    assert (read.performer, read.why) == (2, "two hands alike")
    assert read.label_confidence.dtype == np.float64 and np.isnan(read.label_confidence[2])
    np.testing.assert_allclose(read.label_confidence[:2], [1.0, 1 / 3], rtol=2**-24)


def test_what_is_unknown_takes_no_room() -> None:
    frame = frame_with_a_hand()
    m = [len(hand.point) for hand in frame.hands]
    unknown = tuple(
        replace(
            hand, theta_std=np.full(26, np.nan), marker_std_m=np.full(n, np.nan), label_confidence=np.full(n, np.nan)
        )
        for hand, n in zip(frame.hands, m, strict=True)
    )
    known = tuple(
        replace(hand, theta_std=np.ones(26), marker_std_m=np.ones(n), label_confidence=np.ones(n))
        for hand, n in zip(frame.hands, m, strict=True)
    )
    without, with_them = (len(encode_solved(replace(frame, hands=hands))) for hands in (unknown, known))
    read = decode_solved(encode_solved(replace(frame, hands=unknown)))
    assert bits(read.hands) == bits(unknown)
    assert 4 * sum(26 + 2 * n for n in m) <= with_them - without <= 4 * sum(26 + 2 * n for n in m) + 16 * len(m)


def test_a_wrong_number_of_deviations_is_told() -> None:
    frame = frame_with_a_hand()
    short = replace(frame, hands=(replace(frame.hands[0], theta_std=np.ones(25)),))
    with pytest.raises(FormatError, match="25 numbers as theta_std, not 26"):
        decode_solved(encode_solved(short))


def test_a_wrong_number_of_label_confidences_is_told() -> None:
    frame = frame_with_a_hand()
    m = len(frame.hands[0].point)
    assert m > 1
    hand = replace(frame.hands[0])
    object.__setattr__(hand, "label_confidence", np.ones(m - 1))  # no HandFrame is made so
    with pytest.raises(FormatError, match=f"{m - 1} numbers as label_confidence, not {m}"):
        decode_solved(encode_solved(replace(frame, hands=(hand,))))


@pytest.mark.parametrize("sealed", [False, True])
def test_a_take_gives_back_what_was_recorded(tmp_path: Path, sealed: bool) -> None:
    rng = np.random.default_rng(7)
    raw = [marker_frame(rng) for _ in range(300)]
    solved = [tracked_frame(rng) for _ in range(200)]
    marks = [Mark(0.5, "clap"), Mark(1.25, "")]
    counts = TakeCounts(310, 300, {"queue full": 8, "disk full": 2}, lost=3, rejected=1, solved=200)
    counts = replace(counts, standstills=(Standstill(-0.25, 12.5, 12.75, 2), Standstill(20.0, 20.0, 3600.0)))
    profile = load_profile("han19")
    writer = TakeWriter(tmp_path / "new" / "take.mcap", INFO, profile)
    for i, frame in enumerate(raw):
        writer.raw("", frame)
        assert writer.acknowledged == i + 1
        if i < len(solved):
            writer.solved(solved[i])
        if i in (10, 200):
            writer.mark(marks[i > 10])
    assert writer.bytes_written == writer.path.stat().st_size
    if sealed:
        writer.seal(counts)
    else:
        writer.close()
    assert [path.name for path in writer.path.parent.iterdir()] == ["take.mcap"]
    with open_take(writer.path) as take:
        assert take.info == INFO
        assert take.profile.to_json() == profile.to_json()
        assert take.sealed == sealed
        assert take.counts == (counts if sealed else None)
        assert take.marks == tuple(marks)
        assert take.complete and take.damage == ()
        assert take.libraries["numpy"] == np.__version__
        assert bits(tuple(take.raw)) == bits(tuple(raw))
        assert bits(tuple(take.solved)) == bits(tuple(solved))
        for i in rng.permutation(300)[:50]:
            assert bits(take.raw[int(i)]) == bits(raw[i])
        assert bits(take.raw[-1]) == bits(raw[-1])
        assert bits(tuple(take.raw[250:10:-7])) == bits(tuple(raw[250:10:-7]))
        with pytest.raises(IndexError):
            take.raw[300]


def test_a_take_keeps_the_profile_of_every_performer(tmp_path: Path) -> None:
    cast = tuple(
        replace(load_profile(layout), performer=name)
        for layout, name in (("han19", "Ann"), ("schroeder6", "Ben"), ("qualisys13", ""))
    )
    frames = [frame_with_a_hand()] * 3
    writer = TakeWriter(tmp_path / "take.mcap", INFO, cast)
    for i, frame in enumerate(frames):
        writer.raw("", plain_frame(i))
        writer.solved(frame)

    def is_kept(path: Path) -> None:
        with open_take(path) as take:
            assert [profile.to_json() for profile in take.profiles] == [profile.to_json() for profile in cast]
            assert take.profile.to_json() == cast[0].to_json()
            assert bits(tuple(take.solved)) == bits(tuple(frames))

    is_kept(writer.path)
    writer.seal(TakeCounts(3, 3, solved=3))
    is_kept(writer.path)
    assert verify(writer.path).ok
    update_info(writer.path, replace(INFO, notes="better"))
    is_kept(writer.path)


def test_a_take_of_one_performer_stays_readable_for_programs_of_version_1(tmp_path: Path) -> None:
    def told(profiles: object) -> dict[str, str]:
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.mcap"
        TakeWriter(path, INFO, profiles).seal(TakeCounts(0, 0))  # type: ignore[arg-type]
        with path.open("rb") as file:
            return next(
                record for record in make_reader(file).iter_metadata() if record.name == "phalanx.take"
            ).metadata

    one = load_profile("han19")
    assert told(one)["version"] == told((one,))["version"] == "1" and "performers" not in told(one)
    assert (told((one, one))["version"], told((one, one))["performers"]) == ("2", "2")


def test_a_cast_too_large_for_a_take(tmp_path: Path) -> None:
    with pytest.raises(TakeError, match=r"65 performers in take .* 64 at most"):
        TakeWriter(tmp_path / "take.mcap", INFO, [load_profile("schroeder6")] * 65)
    assert not list(tmp_path.iterdir())


def test_times_are_known_without_decoding_and_bad_ones_end_nothing(tmp_path: Path) -> None:
    nan = float("nan")
    writer = TakeWriter(tmp_path / "take.mcap", INFO, load_profile("han19"))
    host_arrival = ((50, 51), (50.5, 51.5), (nan, 51), (nan, nan), (1e300, 52))
    for host_s, arrival_s in host_arrival:
        frame = plain_frame(0)
        writer.raw("", type(frame)(0, Times(nan, host_s, arrival_s), frame.points_m, frame.ids, frame.residuals_m))
    writer.raw("", plain_frame(1))
    writer.seal(TakeCounts(6, 6))
    with open_take(writer.path) as take:
        assert len(take.raw) == 6
        np.testing.assert_allclose(take.raw.times_s[:4], [0, 0.5, 1, 1], atol=1e-6)
        assert np.isfinite(take.raw.times_s).all()
        assert take.raw[4].times.host_s == 1e300


def test_a_take_says_that_it_was_looked_back_at_also_when_its_notes_are_changed(tmp_path: Path) -> None:
    path = tmp_path / "before.mcap"
    writer = TakeWriter(path, replace(INFO, looked_back=True), load_profile("han19"))
    writer.raw("", plain_frame(0))
    with open_take(path) as take:
        assert take.info.looked_back and not take.sealed
    writer.seal(TakeCounts(1, 1))
    update_info(path, replace(INFO, looked_back=True, notes="the one"))
    with open_take(path) as take:
        assert take.info == replace(INFO, looked_back=True, notes="the one")
        said = take.index.metadata["phalanx.take"]
        assert said["looked_back"] == "yes" and said["version"] == "1"
        assert not info_from_text({**said, "looked_back": "perhaps"}, {}, "", INFO.created_utc).looked_back
    assert "looked_back" not in info_to_text(INFO, 1)
