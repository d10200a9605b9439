"""What stands beside an export: the record of its files, and what is said of frames without a pose."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest

from core.errors import CancelledError
from core.frames import HandState
from core.gltf import read_glb
from core.takes.export import FORMATS, ExportOptions, c3d, export, export_each
from core.takes.export.gltf_motion import read_tracks
from core.takes.formats import read_recording
from core.takes.formats.bvh import read_bvh
from core.takes.holes import holes_of
from core.takes.take import Mark
from tests.core.export.recordings import RATE, solution

RECORD = "take 1_export.json"
ALWAYS = ("marks.csv", "take 1_holes.csv")
"""Beside every export of a take with marks and a hole."""


def said_of(folder):
    """What the record says of each file."""
    return {entry["file"]: entry for entry in json.loads((folder / RECORD).read_text(encoding="utf-8"))["files"]}


def frames_in(path):
    """As its format says."""
    if path.suffix == ".bvh":
        return len(read_bvh(path).positions())
    if path.suffix == ".glb":
        return len(read_tracks(read_glb(path))[1])
    if path.suffix == ".csv":
        return len({line.split(",")[0] for line in path.read_text().splitlines()[1:]})
    return read_recording(path).n_frames


@pytest.mark.parametrize("rate_hz", [None, 30.0, 500.0])
def test_the_frames_of_each_file_are_those_in_it(tmp_path, rate_hz):
    """Frames 100 and 101 of 240 never arrived, and the first 10 were not solved."""
    some = replace(solution(), solved=solution().solved[10:])
    paths = export(some, list(FORMATS), tmp_path, options=ExportOptions(rate_hz=rate_hz))
    said = {name: entry["frames"] for name, entry in said_of(tmp_path).items()}
    assert said.pop("take 1_held.csv") is None
    assert said == {path.name: frames_in(path) for path in paths if path.name in said}
    assert (said["points.csv"], said["angles.csv"]) == (238, 228)
    assert said["take 1.c3d"] == {None: 230, 30.0: 58, 500.0: 955}[rate_hz]


def test_a_part_of_a_c3d_says_its_own_frames(tmp_path, monkeypatch):
    monkeypatch.setattr(c3d, "MAX_FRAMES", 100)
    paths = export(solution(lost=()), ["c3d"], tmp_path)
    said = said_of(tmp_path)
    assert [said[path.name]["frames"] for path in paths] == [100, 100, 40]
    assert [struct.unpack_from("<H", path.read_bytes(), 8)[0] for path in paths] == [100, 100, 40]  # of its header


def interrupted():
    """A take with marks and a hole."""
    whole = solution(lost=tuple(range(100, 160)))
    times_s = [frame.times.host_s - whole.raw[0].times.host_s for frame in whole.raw]
    return replace(whole, marks=(Mark(0.5, "Grasp"),), holes=holes_of(np.array(times_s), RATE))


@pytest.mark.parametrize(
    ("formats", "during", "there"),
    [
        (["c3d", "csv"], "angles", ["take 1.c3d", *ALWAYS]),
        (["bvh", "gltf"], "glb", ["take 1_left.bvh", "take 1_right.bvh", "take 1_held.csv", *ALWAYS]),
        (["c3d", "bvh"], "right.bvh", ["take 1.c3d", *ALWAYS]),
        (["csv", "c3d"], "angles", []),
    ],
)  # fmt: skip
def test_what_was_finished_before_a_cancel_is_told_of(tmp_path, formats, during, there):
    with pytest.raises(CancelledError):
        export(interrupted(), formats, tmp_path, lambda done, text: during not in text)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*there, RECORD] if there else [])
    if there:
        assert sorted(said_of(tmp_path)) == sorted(there)


def test_what_is_finished_is_told_of_before_the_next_format_begins(tmp_path):
    """A process that is ended gets no chance to."""
    seen = {}

    def progress(done, text):
        if "Writing markers.csv" in text and not seen:
            seen.update(said_of(tmp_path))

    paths = export(interrupted(), ["c3d", "csv"], tmp_path, progress)
    assert sorted(seen) == ["marks.csv", "take 1.c3d", "take 1_holes.csv"]
    assert list(said_of(tmp_path)) == [path.name for path in paths]
    assert [path.name for path in paths][-2:] == ["marks.csv", "take 1_holes.csv"]


def test_frames_that_were_not_solved_are_told_of(tmp_path):
    one_hand = solution(240, "qualisys13", lost=(), untracked=(0, 0))
    lost = [
        replace(frame, hands=tuple(replace(hand, state=HandState.LOST) for hand in frame.hands))
        for frame in one_hand.solved[50:60]
    ]
    some = replace(one_hand, solved=(*one_hand.solved[20:50], *lost, *one_hand.solved[60:]))
    exported = export_each(some, ["c3d"], tmp_path)
    assert exported.warnings == ["30 of 240 frames have no pose (20 were not solved)."]
    record = json.loads((tmp_path / RECORD).read_text(encoding="utf-8"))
    assert record["recording"]["warnings"] == exported.warnings


def test_where_every_frame_has_a_pose_or_none_is_written_nothing_is_told(tmp_path):
    whole = solution(240, "qualisys13", lost=(), untracked=(0, 0))
    assert export_each(whole, ["c3d"], tmp_path).warnings == []
    assert export_each(replace(whole, solved=whole.solved[5:]), ["points"], tmp_path).warnings == []
    one = export_each(replace(whole, solved=whole.solved[1:]), ["trc"], tmp_path)
    assert one.warnings == ["1 of 240 frames has no pose: it was not solved."]
