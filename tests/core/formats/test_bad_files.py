"""Whatever a file holds, reading it gives a recording or one FormatError that names the file."""

import numpy as np
import pytest

from core.errors import FormatError
from core.recording import Recording
from core.takes.formats import read_recording
from tests.core.formats import test_motive_csv, test_points_csv, test_qualisys_tsv, test_trc, test_wide_csv
from tests.core.formats.c3d_bytes import build

POINTS = np.random.default_rng(2).uniform(-900, 900, (6, 3, 3))
SOUND = {
    "a.trc": (test_trc.HEADER.format(unit="mm", a="Tip", b="Back") + test_trc.ROWS).encode(),
    "u.trc": (test_trc.HEADER.format(unit="mm", a="親指", b="Back") + test_trc.ROWS).encode("utf-16"),
    "a.tsv": (test_qualisys_tsv.HEADER + test_qualisys_tsv.TITLES + "1\t0\t1\t2\t3\t4\t5\t6\n").encode(),
    "m.csv": test_motive_csv.table(test_motive_csv.MARKERS, [[0, 0.0, 1, 2, 3, 4, 5, 6]]).encode(),
    "w.csv": (
        ",".join(["Frame", "Time", *test_wide_csv.AXES]) + "\n" + test_wide_csv.rows(test_wide_csv.COUNTED)
    ).encode(),
    "v.csv": test_wide_csv.VICON.encode(),
    "p.csv": (test_points_csv.HEADER + "1,0,5,1,2,3\n2,0.01,5,1,2,3\n").encode(),
    "a.c3d": build(84, -0.1, POINTS),
}


def outcome(path, data):
    path.write_bytes(data)
    try:
        recording = read_recording(path)
    except FormatError as error:
        assert path.name in str(error)
        assert error.action
        return error
    assert isinstance(recording, Recording)
    assert recording.n_frames > 0 and recording.rate_hz > 0
    assert not np.isinf(recording.points_m).any()
    assert len(recording.times_s) == len(recording.frame_numbers) == len(recording.points_m)
    return recording


@pytest.mark.parametrize("name", SOUND)
def test_every_truncation(tmp_path, name):
    data = SOUND[name]
    assert isinstance(outcome(tmp_path / name, data), Recording)
    for length in range(len(data)) if len(data) < 1000 else [*range(40), *range(510, 900), *range(900, len(data), 7)]:
        outcome(tmp_path / name, data[:length])


@pytest.mark.parametrize("name", SOUND)
def test_damaged_bytes(tmp_path, name):
    generator = np.random.default_rng(3)
    sound = np.frombuffer(SOUND[name], np.uint8)
    reach = min(len(sound), 1100)
    refused = 0
    for _ in range(400):
        data = sound.copy()
        where = generator.integers(0, reach, generator.integers(1, 8))
        data[where] = generator.integers(0, 256, len(where))
        refused += isinstance(outcome(tmp_path / name, data.tobytes()), FormatError)
    assert 0 < refused < 400  # some damage is met, and some is read past


@pytest.mark.parametrize("suffix", [".trc", ".tsv", ".csv", ".c3d", ".txt", ""])
@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\n\n\n",
        b"\x89PNG\r\n\x1a\n" + bytes(600),
        b"PK\x03\x04" + bytes(range(256)) * 4,
        bytes(2000),
        np.random.default_rng(5).bytes(5000),
        "Überschrift;Wert\n1;2\n".encode("latin-1"),
        b"frame,hand\n1,left\n",
        b"<html><body>not found</body></html>",
    ],
    ids=["empty", "blank", "png", "zip", "zeros", "noise", "latin", "other-csv", "html"],
)
def test_foreign_files(tmp_path, suffix, data):
    assert isinstance(outcome(tmp_path / f"foreign{suffix}", data), FormatError)


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(FormatError, match=r"gone\.trc cannot be read"):
        read_recording(tmp_path / "gone.trc")
    with pytest.raises(FormatError, match="cannot be read"):
        read_recording(tmp_path)


def test_what_is_expected_is_said_by_extension(tmp_path):
    path = tmp_path / "x.trc"
    path.write_text("hello\n")
    with pytest.raises(FormatError, match=r"starts with 'hello'.*PathFileType"):
        read_recording(path)


@pytest.mark.parametrize("name", ["x.tsv", "x.txt"])
def test_a_first_line_with_tabs_is_shown_as_text(tmp_path, name):
    path = tmp_path / name
    path.write_bytes("Größe\tWert  neu\n1\t2\n".encode())
    with pytest.raises(FormatError, match=r"starts with 'Größe Wert neu'"):
        read_recording(path)


@pytest.mark.parametrize("text", ["-" * 60_000, "x" * 60_000, " " * 60_000 + "x", "x," * 30_000, "(" * 60_000])
def test_a_long_first_line_is_soon_refused(tmp_path, text):
    assert isinstance(outcome(tmp_path / "long.csv", text.encode()), FormatError)


def test_a_line_without_end(tmp_path):
    path = tmp_path / "x.trc"
    path.write_bytes(b"PathFileType\t" + b"4" * 3_000_000)
    with pytest.raises(FormatError, match="longer than"):
        read_recording(path)
