"""Two cheap rows of `make faults`, and its table. All of them: `make faults`."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.frames import MarkerFrame, Times
from core.profile import load_profile
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.app.stage import performance
from tests.data import ROOT
from tests.faults.__main__ import main
from tests.faults.all import FAULTS
from tests.faults.fault import Fault, NotHere, Outcome
from tests.faults.stage import wrong_sealed
from tests.faults.table import BEGIN, END, Row, write_into


def test_a_killed_recording_and_one_that_is_ended_keep_every_frame(capsys, tmp_path: Path) -> None:
    status = main(["kill-record", "end-record", "--tries", "1", "--json", "--folder", str(tmp_path)])
    said = capsys.readouterr()
    assert status == 0, said.err
    figures = json.loads(said.out.splitlines()[-1])
    assert set(figures) == {"kill-record", "end-record"}
    assert all(row["tried"] == row["survived"] == 1 and not row["broken"] for row in figures.values())
    assert "2 faults" in said.out and list(tmp_path.iterdir()) == []


def _take(path: Path, frames: list[MarkerFrame]) -> Path:
    writer = TakeWriter(path, TakeInfo(path.stem), load_profile("schroeder6"))
    for frame in frames:
        writer.raw("", frame)
    writer.seal(TakeCounts(len(frames), len(frames)))
    return path


def test_a_take_that_lost_its_frames_or_their_times_did_not_survive(tmp_path: Path) -> None:
    sent = [
        replace(frame, points_m=np.float32(frame.points_m).astype(np.float64), times=Times(1.0, 1.0, 1.1))
        for frame in performance()[:5]
    ]
    whole = _take(tmp_path / "whole.mcap", sent)
    assert wrong_sealed(whole, 5) == ""
    assert wrong_sealed(whole, 6) == "5 frames of at least 6 are left"
    assert wrong_sealed(_take(tmp_path / "empty.mcap", [])) == "0 frames of at least 1 are left"
    untimed = [*sent[:4], replace(sent[4], times=Times(1.0, math.nan, 1.1))]
    unknown = _take(tmp_path / "unknown.mcap", untimed)
    assert wrong_sealed(unknown) == "of 1 frame the time is not known"
    assert wrong_sealed(unknown, untimed=True) == ""
    late = _take(tmp_path / "late.mcap", [replace(frame, times=Times(1.0, 1.1, 1.1)) for frame in sent])
    assert wrong_sealed(late).startswith("5 times are off")


def test_a_loss_is_a_row_that_says_so_and_an_exit_status(capsys, monkeypatch) -> None:
    def loses(tries: int, folder: Path) -> Outcome:
        outcome = Outcome(lost="3 frames")
        for _ in range(tries):
            outcome.count(f"{folder}/a/take.mcap is gone" if outcome.tried else "")
        return outcome

    def breaks(tries: int, folder: Path) -> Outcome:
        raise ZeroDivisionError("no such luck")

    def not_here(tries: int, folder: Path) -> Outcome:
        raise NotHere("there is no display")

    made = (
        Fault("loses", "a", 2, loses),
        Fault("breaks", "b", 1, breaks, alone=True),
        Fault("nothing", "c", 1, not_here),
    )
    monkeypatch.setattr("tests.faults.__main__.FAULTS", made)
    assert main([]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[2] == "| a | 2 | 1 | 3 frames | nothing Not as it should be: take.mcap is gone |"
    assert "| b | 1 | 0 |" in lines[3] and "no such luck" in lines[3]
    assert lines[4] == "| c | 0 | | | not tried here: there is no display |"
    assert main(["nothing"]) == 0
    with pytest.raises(SystemExit):
        main(["nosuch"])


def test_the_table_of_the_documentation_is_of_these_faults_and_is_renewed_line_by_line(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "faults.md").read_text(encoding="utf-8")
    whats = [fault.what for fault in FAULTS]
    told = [line.split("|")[1].strip() for line in text.partition(BEGIN)[2].partition(END)[0].strip().splitlines()[2:]]
    assert told and told == [what for what in whats if what in told]  # those that could be tried, in their order
    assert len({fault.name for fault in FAULTS}) == len(set(whats)) == len(FAULTS)
    document = tmp_path / "faults.md"
    document.write_text(text, encoding="utf-8")
    write_into(
        document, [Row(FAULTS[1], Outcome(1, 1, said="a | b\nc")), Row(FAULTS[2], Outcome(), "no display")], whats
    )
    changed = [line for line in document.read_text(encoding="utf-8").splitlines() if line not in text.splitlines()]
    assert changed == [f"| {whats[1]} | 1 | 1 | nothing | a / b c |"]
    with pytest.raises(ValueError, match="no place"):
        write_into(ROOT / "README.md", [], whats)
