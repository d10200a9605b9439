import numpy as np
import pytest

from core.errors import ExportError
from core.takes.export import export, trc
from core.takes.formats import read_recording
from tests.core.export.recordings import RATE, solution
from tests.core.export.test_c3d import expected_points


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    (path,) = export(solution(), ["trc"], tmp_path_factory.mktemp("trc"))
    return path


def test_the_file_as_opensim_expects_it(written):
    lines = written.read_text().split("\n")
    points, kinds = expected_points(solution())
    assert lines[0].split("\t") == ["PathFileType", "4", "(X/Y/Z)", "take 1.trc"]
    values = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=True))
    assert values == {
        "DataRate": "120", "CameraRate": "120", "NumFrames": "240", "NumMarkers": "38", "Units": "mm",
        "OrigDataRate": "120", "OrigDataStartFrame": "1", "OrigNumFrames": "240",
    }  # fmt: skip
    assert lines[3].split("\t")[:6] == ["Frame#", "Time", "L_ThumbCMC", "", "", "L_ThumbMCP"]
    assert len({line.count("\t") for line in (lines[3], lines[4], *lines[6:-1])}) == 1  # for readers of plain tables
    assert lines[4].split("\t")[:5] == ["", "", "X1", "Y1", "Z1"]
    assert lines[5] == ""
    rows = [line.split("\t") for line in lines[6:-1]]
    assert {len(row) for row in rows} == {2 + 3 * 38 + 1} and {row.pop() for row in rows} == {""}  # a tab at the end
    assert [int(row[0]) for row in rows] == list(range(1, 241))
    assert np.allclose([float(row[1]) for row in rows], np.arange(240) / RATE, atol=1e-6)
    cells = np.array([[float(cell or "nan") for cell in row[2:]] for row in rows]).reshape(240, 38, 3)
    measured = np.where(kinds[:, :, None] == 1, points, np.nan)
    assert np.allclose(cells / 1000.0, measured, atol=0.51e-7, equal_nan=True)


def test_our_reader_reads_the_same(written):
    points, kinds = expected_points(solution())
    recording = read_recording(written)
    assert np.allclose(recording.points_m, np.where(kinds[:, :, None] == 1, points, np.nan), atol=1e-7, equal_nan=True)


def test_names_with_tabs_cannot_break_the_columns(tmp_path):
    from dataclasses import replace

    base = solution(30, "schroeder6")
    names = ("a\tb", "a b", " c ", "d\ne", "e,f", 'g"h')
    layout = replace(base.cast[0].layout, marker_names=names)
    odd = replace(base, profiles=replace(base.cast[0], layout=layout))
    paths = export(odd, ["trc", "c3d", "csv"], tmp_path)
    assert [path.suffix for path in paths[:2]] == [".trc", ".c3d"]
    expected = (r"L_a\tb", "L_a b", "L_ c", r"L_d\ne", "L_e,f", 'L_g"h')
    assert [read_recording(path).labels[:6] for path in paths[:2]] == [expected, expected]


def test_a_file_that_differs_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(trc, "DECIMALS", 1)
    with pytest.raises(
        ExportError, match=r"take 1\.trc did not read back equal: frame 1, R_ThumbMCP: .* m stands where"
    ):
        export(solution(), ["trc"], tmp_path)
    assert list(tmp_path.iterdir()) == []
