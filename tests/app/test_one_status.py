"""Every command that says what a take is ends with the same status for it: 0 whole, 3 not whole, 1 nothing in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from app.cli import main
from app.review.take_row import read_row
from app.stream_figures import StreamFigures
from app.take_summary import TakeSummary
from core.level import Level
from core.profile import load_profile
from core.takes.reader import open_take
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.core.takes.frames import plain_frame, plain_solved
from tests.some import some

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
    """One of its chunks cannot be unpacked, the others can be read."""
    n = 12 * N
    written(path, 0, n).seal(TakeCounts(n, n, solved=n))
    with open_take(path) as take:
        chunk, *others = take.index.chunks
    assert others
    data = bytearray(path.read_bytes())
    data[chunk.offset + 50 : chunk.offset + 1000] = bytes(950)
    path.write_bytes(data)


def of_unknown_time(path: Path) -> TakeWriter:
    """Three frames came while the machine slept."""
    writer = TakeWriter(path, TakeInfo("take", rate_hz=120), load_profile("han19"))
    for i in range(N):
        frame = plain_frame(i)
        writer.raw("", replace(frame, times=replace(frame.times, host_s=math.nan)) if 20 <= i < 23 else frame)
        writer.solved(plain_solved(i))
    return writer


def with_unknown_times(path: Path) -> None:
    of_unknown_time(path).seal(TakeCounts(N, N, solved=N, untimed=3))


def with_unknown_times_that_nobody_counted(path: Path) -> None:
    of_unknown_time(path).seal(TakeCounts(N, N, solved=N))


def with_unknown_times_and_not_sealed(path: Path) -> None:
    of_unknown_time(path).close()


def empty(path: Path) -> None:
    written(path, 0, 0).seal(TakeCounts(0, 0))


STATES: Mapping[Callable[[Path], None], tuple[int, int]] = {
    whole: (0, 0), without_poses: (0, 0), not_sealed: (3, 0), with_losses: (3, 3), with_drops: (3, 3),
    with_a_hole: (3, 3), cut_off: (3, 3), damaged: (3, 3), empty: (1, 1),
    with_unknown_times: (3, 3), with_unknown_times_that_nobody_counted: (3, 3),
    with_unknown_times_and_not_sealed: (3, 3),
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


def test_frames_of_unknown_time_are_no_green_light_anywhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They are in the take, and nothing tells when they were taken: the list, which reads no frame, says so as well."""
    path, words = tmp_path / "take.mcap", "3 of unknown time"
    with_unknown_times(path)
    row = read_row(path)
    assert row.level is Level.WARNING and len(row.problems) == 1 and "3 frames" in row.problems[0]
    for state in (with_unknown_times, with_unknown_times_that_nobody_counted, with_unknown_times_and_not_sealed):
        path.unlink()
        state(path)
        main(["info", str(path)])
        assert words in capsys.readouterr().out, state
    main(["recover", str(path)])
    assert words in capsys.readouterr().out
    with open_take(tmp_path / "take_recovered.mcap") as take:
        assert take.counts is not None and take.counts.untimed == 3 and words in take.verdict.headline


@pytest.mark.parametrize("command", [["info"], ["verify"], ["recover"], ["export", "--to", "csv", "--out", "out"]])
def test_a_take_that_was_rescued_is_found_by_every_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    whole(tmp_path / "take_rescued.mcap")
    path = tmp_path / "take.mcap"
    assert main([command[0], str(path), *command[1:]]) == 1
    said = capsys.readouterr().err
    assert f"There is no take {path}. But it was rescued as {tmp_path / 'take_rescued.mcap'}. Name that one." in said
    assert said.count("rescued as") == 1
    assert main([command[0], str(tmp_path / "other.mcap"), *command[1:]]) == 1
    assert "Check the name." in capsys.readouterr().err


def test_figures_have_their_thousands_separated_wherever_people_read_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    n, gone = 1234, 2345
    counts = TakeCounts(n + gone, n, {"disk did not answer": gone}, lost=4567, solved=n)
    path = tmp_path / "take.mcap"
    written(path, 0, n).seal(counts)
    cut = tmp_path / "cut.mcap"
    written(cut, 0, n).close()
    said = ""
    for command in (["verify", path], ["info", path], ["recover", cut]):
        main([str(word) for word in command])
        said += capsys.readouterr().out
    of = StreamFigures(n + gone, n, {"disk did not answer": gone}, 4567)
    said += TakeSummary("take", path, 60.0, n, streams={"": of}).line
    for number in some((n, gone, n + gone, 4567)):
        assert f"{number:,}" in said and str(number) not in said, (number, said)
    assert counts.words == "Received 3,579 = written 1,234 + dropped 2,345" and counts.words in said
