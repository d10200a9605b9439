"""Takes cut short at any byte, with holes, foreign files: what is readable is read, what is not is said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.errors import PhalanxError, TakeError
from core.profile import load_profile
from core.takes.reader import open_take
from core.takes.recover import recover
from core.takes.take import TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.core.takes.frames import bits, hand_frame, plain_frame, plain_solved
from tests.some import some


def record(path: Path, n: int, sealed: bool = False, solved: bool = True) -> list[int]:
    """Writes a take of n frames; the file's size before the first and after each frame."""
    writer = TakeWriter(path, TakeInfo(path.stem, rate_hz=120), load_profile("schroeder6"))
    sizes = [writer.bytes_written]
    for i in range(n):
        writer.raw("", plain_frame(i))
        if solved:
            writer.solved(plain_solved(i))
        sizes.append(writer.bytes_written)
    if sealed:
        writer.seal(TakeCounts(n, n, solved=n if solved else 0))
    else:
        writer.close()
    return sizes


def plain(n: int) -> object:
    return bits(tuple(plain_frame(i) for i in range(n)))


def test_a_recording_cut_at_any_byte_gives_every_frame_before(tmp_path: Path) -> None:
    sizes = record(tmp_path / "take.mcap", 6, solved=False)
    data = (tmp_path / "take.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    begun = sizes[0]
    for end in some(range(begun, len(data) + 1)):
        cut.write_bytes(data[:end])
        whole = sum(size <= end for size in sizes[1:])
        with open_take(cut) as take:
            assert bits(tuple(take.raw)) == plain(whole)
            assert not take.sealed
            assert take.info.name == "take" and take.profile.layout.name == "schroeder6"
            assert take.complete == (end in sizes)
    for end in some(range(0, begun, 7)):
        cut.write_bytes(data[:end])
        try:
            with open_take(cut) as take:
                assert len(take.raw) == 0
        except PhalanxError as error:
            assert str(cut) in str(error)


def test_a_sealed_take_cut_at_any_byte_gives_a_prefix(tmp_path: Path) -> None:
    record(tmp_path / "take.mcap", 400, sealed=True)
    data = (tmp_path / "take.mcap").read_bytes()
    cut, seen = tmp_path / "cut.mcap", set()
    step = len(data) // 150
    for end in [*range(2000, len(data), step), len(data)]:
        cut.write_bytes(data[:end])
        try:
            take = open_take(cut)
        except PhalanxError as error:
            assert str(cut) in str(error)
            continue
        with take:
            n = len(take.raw)
            assert bits(tuple(take.raw)) == plain(n)
            assert take.sealed == (end == len(data))
            assert n == 400 or not take.complete
            if take.damage and take.counts:
                assert take.lost_raw == 400 - n
            seen.add(n)
    assert {0, 400} <= seen and len(seen) > 2


@pytest.mark.parametrize("sealed", [False, True])
@pytest.mark.parametrize("seed", range(25))
def test_a_hole_costs_only_what_was_in_it(tmp_path: Path, sealed: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 500
    record(tmp_path / "take.mcap", n, sealed)
    data = bytearray((tmp_path / "take.mcap").read_bytes())
    size = int(rng.choice([1, 8, 300]))
    start = int(rng.integers(4000, len(data) - size - (1500 if sealed else 0)))
    for i in range(start, start + size):
        data[i] ^= int(rng.integers(1, 256))
    hole = tmp_path / "hole.mcap"
    hole.write_bytes(data)
    with open_take(hole) as take:
        found = [frame.sequence for frame in take.raw]
        assert found == sorted(set(found))
        assert bits(tuple(take.raw)) == bits(tuple(plain_frame(i) for i in found))
        assert bits(tuple(take.solved)) == bits(tuple(plain_solved(frame.sequence) for frame in take.solved))
        solved = len(take.solved)
        if not take.damage:
            # Only the numbers and times around a message carry no checksum of their own while recording.
            assert not sealed and len(found) == n and solved == n
        elif sealed or max(found) == n - 1:
            assert take.lost_raw == n - len(found)
        if not sealed:
            assert n - len(found) <= 3
        damage = take.damage
    report = verify(hole)
    assert report.raw == len(found) and bool(damage) <= (not report.ok)
    before = hole.read_bytes()
    result = recover(hole)
    assert hole.read_bytes() == before
    assert result.path is not None and (result.recovered, result.recovered_solved) == (len(found), solved)
    assert result.complete == (not result.lost and not result.lost_solved)
    assert not (result.lost and result.verdict.whole)
    with open_take(result.path) as take:
        assert take.sealed and take.complete and take.counts is not None and take.counts.balanced
        assert [frame.sequence for frame in take.raw] == found
    assert recover(result.path).path is None


def test_a_damaged_profile_of_one_performer_costs_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    cast = [replace(load_profile("schroeder6"), performer=name) for name in ("Ann", "Ben-Gurion", "Cleo")]
    writer = TakeWriter(path, TakeInfo("take"), cast)
    writer.raw("", plain_frame(0))
    writer.close()
    data = path.read_bytes()
    path.write_bytes(data.replace(b"Ben-Gurion", b"Ben-Gur1on", 1))
    recovered = recover(path).path
    assert recovered is not None
    for damaged in (path, recovered):
        with open_take(damaged) as take:
            assert bits(tuple(take.raw)) == plain(1) and take.profile.performer == "Ann"
            assert len(take.profiles_data) == 3 and take.profiles_data[2] == cast[2].to_json().encode()
            with pytest.raises(TakeError, match=f"performer 2 saved in take {damaged} is damaged. Choose a profile"):
                _ = take.profiles
        assert any("performer 2" in finding.text for finding in verify(damaged).findings if finding.level == "problem")


def test_hands_of_a_performer_without_a_profile_are_a_problem(tmp_path: Path) -> None:
    writer = TakeWriter(tmp_path / "take.mcap", TakeInfo("take"), load_profile("schroeder6"))
    stranger = replace(hand_frame(np.random.default_rng(0), "right"), performer=1)
    writer.raw("", plain_frame(0))
    writer.solved(replace(plain_solved(0), hands=(stranger,)))
    writer.seal(TakeCounts(1, 1, solved=1))
    report = verify(writer.path)
    assert not report.ok
    assert "hands of 2 performers and the profiles of 1" in " ".join(finding.text for finding in report.findings)
