from dataclasses import replace

import numpy as np
import pytest

from core.errors import CancelledError, ExportError
from core.frames import HandState
from core.takes.export import FORMATS, export
from core.takes.formats import read_recording
from tests.core.export.recordings import solution

ALL = list(FORMATS)
FILES = [
    "take 1.c3d", "take 1.trc", "markers.csv", "angles.csv", "joints.csv", "points.csv", "take 1_left.bvh",
    "take 1_right.bvh", "take 1.glb", "take 1_held.csv",
]  # fmt: skip

RECORD = "take 1_export.json"


def found(folder):
    return sorted(path.name for path in folder.rglob("*"))


def test_all_formats_into_a_new_folder(tmp_path):
    told = []
    paths = export(solution(), ALL, tmp_path / "a" / "b", lambda done, text: told.append((done, text)))
    assert [path.name for path in paths] == FILES
    assert found(tmp_path / "a" / "b") == sorted([*FILES, RECORD])
    shares = [done for done, _ in told]
    assert shares == sorted(shares) and shares[0] == 0.0 and shares[-1] == pytest.approx(1.0)
    assert all(text for _, text in told)


def test_the_same_format_twice_is_written_once(tmp_path):
    assert [path.name for path in export(solution(), ["trc", "trc"], tmp_path)] == ["take 1.trc"]


def test_nothing_is_overwritten_unless_asked(tmp_path):
    (tmp_path / "take 1.trc").write_text("mine")
    with pytest.raises(ExportError, match=r"take 1\.trc exists already.*Choose another folder"):
        export(solution(), ["c3d", "trc"], tmp_path)
    assert found(tmp_path) == ["take 1.trc"]
    assert (tmp_path / "take 1.trc").read_text() == "mine"
    export(solution(), ["c3d", "trc"], tmp_path, overwrite=True)
    assert read_recording(tmp_path / "take 1.trc").n_frames == 240


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("share", [0.02, 0.3, 0.75])
def test_cancelling_leaves_nothing_half_done(tmp_path, name, share):
    with pytest.raises(CancelledError):
        export(solution(), [name], tmp_path, lambda done, text: done < share)
    assert found(tmp_path) == []


def test_formats_finished_before_a_cancel_stay(tmp_path):
    with pytest.raises(CancelledError):
        export(solution(), ["c3d", "csv"], tmp_path, lambda done, text: "angles" not in text)
    assert found(tmp_path) == ["take 1.c3d", RECORD]
    assert read_recording(tmp_path / "take 1.c3d").n_frames == 240


def test_a_callback_that_raises_cancels(tmp_path):
    def stop(done, text):
        if done > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export(solution(), ["csv"], tmp_path, stop)
    assert found(tmp_path) == []


@pytest.mark.parametrize("name", ["c3d", "trc", "csv", "points", "bvh", "gltf"])
def test_a_disk_that_takes_no_larger_file_is_one_error(tmp_path, name):
    resource = pytest.importorskip("resource", reason="limits of file size are POSIX")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, hard))
    try:
        with pytest.raises(ExportError, match=r"The export to .* failed .*takes no larger file") as error:
            export(solution(), [name], tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert isinstance(error.value.__cause__, OSError)
    assert found(tmp_path) == []


def test_a_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ExportError, match=r"The export to .*file.* failed"):
        export(solution(), ["trc"], tmp_path / "file")


def test_unknown_formats_and_none(tmp_path):
    with pytest.raises(ExportError, match=r"'fbx' is no export format. Choose of c3d, trc, csv, points, bvh, gltf"):
        export(solution(), ["c3d", "fbx"], tmp_path)
    with pytest.raises(ExportError, match="No export format was chosen"):
        export(solution(), [], tmp_path)


def test_a_recording_that_is_not_solved(tmp_path):
    unsolved = replace(solution(), solved=())
    with pytest.raises(ExportError, match="take 1 holds no solved frames"):
        export(unsolved, ["points", "c3d"], tmp_path)
    assert found(tmp_path) == ["points.csv", RECORD]
    with pytest.raises(ExportError, match="holds no raw frames"):
        export(replace(solution(), raw=()), ["points"], tmp_path)


def never_tracked():
    searching = tuple(
        replace(frame, hands=tuple(replace(hand, state=HandState.SEARCHING) for hand in frame.hands))
        for frame in solution(40).solved
    )
    return replace(solution(40), solved=searching)


def test_no_hand_was_ever_tracked(tmp_path):
    with pytest.raises(ExportError, match=r"No hand was tracked in any of the 40 frames of take 1.* bvh and gltf"):
        export(never_tracked(), ["c3d", "bvh", "gltf"], tmp_path)
    assert found(tmp_path) == ["take 1.c3d", RECORD]
    c3d, trc, markers, angles, _ = export(never_tracked(), ["c3d", "trc", "csv"], tmp_path, overwrite=True)
    assert np.isnan(read_recording(c3d).points_m).all() and np.isnan(read_recording(trc).points_m).all()
    assert len(markers.read_text().splitlines()) == 1
    assert len(angles.read_text().splitlines()) == 81


def test_one_hand(tmp_path):
    paths = export(solution(60, "qualisys13"), ALL, tmp_path)
    sides = solution(60, "qualisys13").cast[0].sides
    assert sides == ("right",)
    assert "take 1_right.bvh" in [path.name for path in paths] and "take 1_left.bvh" not in found(tmp_path)
    assert len(read_recording(tmp_path / "take 1.c3d").labels) == 13


def test_a_single_frame(tmp_path):
    one = replace(solution(), solved=solution().solved[50:51], raw=solution().raw[50:51])
    paths = export(one, [name for name in ALL if name != "bvh"], tmp_path)
    assert read_recording(tmp_path / "take 1.c3d").n_frames == 1
    assert [path.name for path in paths] == [file for file in FILES if not file.endswith((".bvh", "held.csv"))]


def test_frames_without_raw_ones_count_from_the_first_solved(tmp_path):
    markers, *_ = export(replace(solution(), raw=()), ["csv"], tmp_path)
    assert markers.read_text().splitlines()[1].startswith("7000,0.000000,right,")
