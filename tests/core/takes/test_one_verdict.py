"""Whoever opens a take says the same of it, whatever became of the file: how many frames, damaged or not, sealed or
not, and in the same words."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from mcap.opcode import Opcode

from core.errors import PhalanxError
from core.profile import load_profile
from core.takes.checked import check
from core.takes.reader import open_take
from core.takes.records import RECORD_HEAD
from core.takes.recover import recover
from core.takes.take import Mark, TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.core.takes.crafted import resealed
from tests.core.takes.frames import bits, plain_frame, plain_solved
from tests.data import CASES, ROOT

N = 60


@pytest.fixture(scope="module")
def takes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A good take in both of its states."""
    made = {}
    for state in ("recorded", "sealed"):
        path = tmp_path_factory.mktemp(state) / "take.mcap"
        writer = TakeWriter(path, TakeInfo("take", rate_hz=120), load_profile("schroeder6"))
        for i in range(N):
            writer.raw("", plain_frame(i, n=60))
            writer.solved(plain_solved(i))
        writer.mark(Mark(0.1, "clap"))
        if state == "sealed":
            writer.seal(TakeCounts(N, N, solved=N))
        else:
            writer.close()
        made[state] = path.read_bytes()
    return made


def said_alike(path: Path) -> str:
    """The condition of a take, "" of what is none, after everyone was asked."""
    try:
        report = verify(path)
    except PhalanxError as error:
        for other in (open_take, recover):
            with pytest.raises(type(error)) as caught:
                other(path)
            assert str(caught.value) == str(error)
        return ""
    problems = tuple(one.text for one in report.findings if one.level == "problem")
    with open_take(path) as take:
        # The reader believes an index under right checksums: it may find later what the others know, and miss frames
        # that these find without it.
        believed = any(text.startswith("The index of") for text in problems)
        assert take.sealed == report.sealed and (believed or set(take.damage) <= set(problems))
        if take.damage:
            assert not report.ok and take.complete is False
    with open_take(path) as take:
        checked = check(take)  # as `info` does
        assert checked.take.problems == problems and checked.condition == report.condition
        assert (len(checked.take.raw), len(checked.take.solved), len(checked.take.marks)) == (
            report.raw, report.solved, report.marks,
        )  # fmt: skip
        raw, solved = bits(tuple(checked.take.raw)), bits(tuple(checked.take.solved))
        lost, sealed, complete = checked.take.lost_raw, checked.take.sealed, checked.take.complete
        assert report.ok == (not problems) and complete <= (not checked.take.damage)
    try:
        recovery = recover(path)
    except PhalanxError as error:
        assert "holds no readable frame" in str(error) and report.raw == report.solved == 0
        assert not (sealed and complete)
        return report.condition
    assert (recovery.findings, recovery.condition, recovery.lost) == (problems, report.condition, lost)
    assert (recovery.recovered, recovery.recovered_solved) == (report.raw, report.solved)
    assert (recovery.path is None) == (sealed and complete)
    if recovery.path is not None:
        with open_take(recovery.path) as take:
            assert take.sealed and take.complete
            assert bits(tuple(take.raw)) == raw and bits(tuple(take.solved)) == solved
        assert recover(recovery.path).path is None
        recovery.path.unlink()
    return report.condition


@pytest.mark.parametrize("state", ["recorded", "sealed"])
def test_of_a_good_take(tmp_path: Path, takes: dict[str, bytes], state: str) -> None:
    path = tmp_path / "take.mcap"
    path.write_bytes(takes[state])
    assert said_alike(path) == ("is whole" if state == "sealed" else "is not sealed; `phalanx recover` seals it")


@pytest.mark.parametrize("state", ["recorded", "sealed"])
def test_of_a_take_cut_anywhere(tmp_path: Path, takes: dict[str, bytes], state: str) -> None:
    data, path = takes[state], tmp_path / "take.mcap"
    conditions = set()
    for end in np.linspace(0, len(data) - 1, 60).astype(int):
        path.write_bytes(data[:end])
        conditions.add(said_alike(path))
    assert len(conditions) > 2


@pytest.mark.parametrize(("state", "right_checksums"), [("recorded", False), ("sealed", False), ("sealed", True)])
def test_of_a_take_with_flipped_bytes(
    tmp_path: Path, takes: dict[str, bytes], state: str, right_checksums: bool
) -> None:
    rng = np.random.default_rng(7)
    path, conditions = tmp_path / "take.mcap", set()
    for at in rng.integers(0, len(takes[state]), 40):
        data = bytearray(takes[state])
        data[at] ^= 1 << rng.integers(8)
        path.write_bytes(resealed(bytes(data)) if right_checksums else data)
        conditions.add(said_alike(path))
    assert any("damaged" in condition for condition in conditions)


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """(opcode, begin, end) of the records of a file."""
    position = 8
    while position + 9 <= len(data) - 8:
        opcode, length = RECORD_HEAD.unpack_from(data, position)
        yield opcode, position, position + 9 + length
        position += 9 + length


@pytest.mark.parametrize("right_checksums", [False, True])
@pytest.mark.parametrize("with_index", [False, True])
def test_of_a_take_whose_chunks_changed_places(
    tmp_path: Path, takes: dict[str, bytes], with_index: bool, right_checksums: bool
) -> None:
    """Nothing is lost by it, and nothing is said to be."""
    data, path = takes["sealed"], tmp_path / "take.mcap"
    chunks = [(begin, end) for opcode, begin, end in records(data) if opcode == Opcode.CHUNK]
    assert len(chunks) > 1
    ends = [begin for begin, _ in chunks[1:]] + [next(b for o, b, _ in records(data) if o == Opcode.DATA_END)]
    first, second = [(begin, end if with_index else own) for (begin, own), end in zip(chunks, ends, strict=True)][:2]
    swapped = b"".join(
        (data[: first[0]], data[slice(*second)], data[first[1] : second[0]], data[slice(*first)], data[second[1] :])
    )
    assert len(swapped) == len(data)
    path.write_bytes(resealed(swapped) if right_checksums else swapped)
    assert said_alike(path) != "is whole"
    report = verify(path)
    assert (report.raw, report.solved, report.marks) == (N, N, 1)
    words = " ".join(one.text for one in report.findings)
    assert "out of order by their numbers" in words and "missing" not in words


@pytest.mark.parametrize("name", sorted(path.name for path in (CASES / "faults").glob("*.mcap")) or ["none"])
def test_of_every_fault(tmp_path: Path, name: str) -> None:
    if name == "none":
        pytest.skip("needs the case faults (set PHALANX_CASES to the folder that holds it)")
    path = tmp_path / name
    path.write_bytes((CASES / "faults" / name).read_bytes())
    said_alike(path)


@pytest.mark.parametrize("name", sorted(path.name for path in (ROOT / "tests/golden/takes").glob("*.mcap")))
def test_of_every_golden_take(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes((ROOT / "tests/golden/takes" / name).read_bytes())
    assert "damaged" not in said_alike(path)
