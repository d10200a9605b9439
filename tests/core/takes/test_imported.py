"""A take of another program's recording says when that was recorded."""

from __future__ import annotations

import os
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from core.profile import load_profile
from core.recording import Recording
from core.takes.formats import read_recording
from core.takes.formats.moment import moment
from core.takes.imported import info_of

CAST = (load_profile("han19"),)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("2021-08-26, 15:19:24", (2021, 8, 26, 15, 19, 24)),
        ("2026-01-02, 13:00:01.123", (2026, 1, 2, 13, 0, 1, 123000)),
        ("2026-08-04 03.25.39.000 PM", (2026, 8, 4, 15, 25, 39)),
        ("2017-02-14 12.30.26.264 AM", (2017, 2, 14, 0, 30, 26, 264000)),
        ("2017-02-14 12.30.26.264 pm", (2017, 2, 14, 12, 30, 26, 264000)),
        ("2024-02-29T10:00:00", (2024, 2, 29, 10)),
    ],
)
def test_times_of_headers(text, parts):
    found = moment(text)
    assert found == datetime(*parts).astimezone() and found.tzinfo is not None


@pytest.mark.parametrize(
    "text",
    ["", "today", "2021-13-01, 10:00:00", "2021-02-30, 10:00:00", "2021-02-03, 25:00:00", "2021-02-03 13.00.00 PM",
     "0000-00-00, 00:00:00", "0001-01-01, 00:00:00 x", "9" * 4000],
)  # fmt: skip
def test_what_is_no_time(text):
    assert moment(text) is None


def test_qualisys_and_motive_say_when(tmp_path):
    tsv = tmp_path / "walk.tsv"
    tsv.write_text(
        "NO_OF_FRAMES\t2\nNO_OF_MARKERS\t1\nFREQUENCY\t100\nTIME_STAMP\t2021-08-26, 15:19:24.5\t6284.31\n"
        "MARKER_NAMES\tA\n1\t2\t3\n1\t2\t4\n"
    )
    assert read_recording(tsv).recorded == datetime(2021, 8, 26, 15, 19, 24, 500000).astimezone()
    csv = tmp_path / "grasp.csv"
    csv.write_text(
        "Format Version,1.23,Take Name,grasp,Capture Frame Rate,100.000000,Export Frame Rate,100.000000,"
        "Capture Start Time,2017-02-14 04.30.26.264 PM,Total Frames in Take,2,Total Exported Frames,2,"
        "Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global\n\n"
        ",Type,Marker,Marker,Marker\n,Name,A,A,A\n,ID,1,1,1\n,,Position,Position,Position\n"
        "Frame,Time (Seconds),X,Y,Z\n0,0.0,0.1,0.2,0.3\n1,0.01,0.1,0.2,0.4\n"
    )
    recording = read_recording(csv)
    assert recording.recorded == datetime(2017, 2, 14, 16, 30, 26, 264000).astimezone()
    assert info_of(csv, recording, CAST).created_utc == recording.recorded
    assert info_of(csv, recording, CAST).created_utc.tzinfo is UTC


def test_without_a_date_the_file_tells(tmp_path):
    path = tmp_path / "x.trc"
    path.write_text("")
    os.utime(path, (1.6e9, 1.6e9))
    recording = Recording("x", 100.0, np.zeros(1), np.zeros(1, int), np.zeros((1, 1, 3)), ("A",), np.arange(1))
    assert info_of(path, recording, CAST).created_utc == datetime.fromtimestamp(1.6e9, UTC)
    said = datetime(2020, 1, 2, tzinfo=UTC)
    assert info_of(path, replace(recording, recorded=said), CAST).created_utc == said
