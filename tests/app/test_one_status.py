"""Every command that says what a take is ends with the same status for it: 0 whole, 3 not whole, 1 nothing in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from app.cli import main
from core.profile import load_profile
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.core.takes.frames import plain_frame, plain_solved

N = 60


def written(path: Path, begin: int = 0, end: int = N, poses: bool = True) -> TakeWriter:
    writer = TakeWriter(path, TakeInfo("take", rate_hz=120), load_profile("han19"))
    for i in range(begin, end):
        writer.raw("", plain_frame(i))
        if poses:
            writer.solved(plain_solved(i))
    return writer


def whole(path: Path) -> None:
    written(path).seal(TakeCounts(N, N, solved=N))


def without_poses(path: Path) -> None:
    written(path, poses=False).seal(TakeCounts(N, N, solved=0))


def not_sealed(path: Path) -> None:
    written(path).close()


def with_losses(path: Path) -> None:
    written(path).seal(TakeCounts(N, N, lost=3, solved=N))


def with_drops(path: Path) -> None:
    written(path).seal(TakeCounts(N + 2, N, {"disk error": 2}, solved=N))


def with_a_hole(path: Path) -> None:
    writer = written(path)
    for i in range(N + 240, N + 300):
        writer.raw("", plain_frame(i))
        writer.solved(plain_solved(i))
    writer.seal(TakeCounts(120, 120, solved=120))


def cut_off(path: Path) -> None:
    written(path, poses=False).close()
    path.write_bytes(path.read_bytes()[:-10])


def damaged(path: Path) -> None:
    whole(path)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def empty(path: Path) -> None:
    written(path, 0, 0).seal(TakeCounts(0, 0))


STATES: Mapping[Callable[[Path], None], tuple[int, int]] = {
    whole: (0, 0), without_poses: (0, 0), not_sealed: (3, 0), with_losses: (3, 3), with_drops: (3, 3),
    with_a_hole: (3, 3), cut_off: (3, 3), damaged: (3, 3), empty: (1, 1),
}  # fmt: skip
"""Of a take as it is, and of what `recover` makes of it: sealing is all that one may lack that was never sealed."""


@pytest.mark.parametrize("state", list(STATES))
def test_one_take_one_status(tmp_path: Path, capsys: pytest.CaptureFixture[str], state: Callable[[Path], None]) -> None:
    path = tmp_path / "take.mcap"
    state(path)
    said = {command: main([command, str(path)]) for command in ("info", "verify")}
    assert set(said.values()) == {STATES[state][0]}, capsys.readouterr().out
    assert main(["recover", str(path)]) == STATES[state][1], capsys.readouterr().out
    recovered = tmp_path / "take_recovered.mcap"
    if recovered.exists():
        assert main(["verify", str(recovered)]) == STATES[state][1], capsys.readouterr().out


@pytest.mark.parametrize("left", [None, b"", b"what another program put there"])
def test_recover_says_where_a_take_was_rescued(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], left: bytes | None
) -> None:
    path = tmp_path / "take.mcap"
    if left is not None:
        path.write_bytes(left)
    whole(path.with_name("take_rescued.mcap"))
    assert main(["recover", str(path)]) == 1
    err = capsys.readouterr().err
    assert "rescued as" in err and "take_rescued.mcap" in err and "Name that one." in err
