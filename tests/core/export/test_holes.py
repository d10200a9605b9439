"""A recording in which nothing came for a while: what each format says of it."""

import csv
from dataclasses import replace

import ezc3d
import numpy as np
import pygltflib
import pytest

from core.frames import Times
from core.takes.export import export
from core.takes.export.timeline import timeline_of
from core.takes.formats import trc
from core.takes.formats.bvh import read_bvh
from core.takes.holes import holes_of
from tests.core.export.recordings import RATE, START_S, solution

SILENCE_S = 34.4
BEFORE = 120
MISSING = round(SILENCE_S * RATE)


@pytest.fixture(scope="module")
def recording():
    """The server stood still for 34.4 s and then counted on as if nothing had been."""
    whole = solution(lost=(), untracked=(0, 0), scale=1.0)

    def later(frame):
        if frame.sequence < 7000 + BEFORE:
            return frame
        times = frame.times
        return replace(frame, times=Times(*(t + SILENCE_S for t in (times.device_s, times.host_s, times.arrival_s))))

    raw, solved = tuple(map(later, whole.raw)), tuple(map(later, whole.solved))
    times = np.array([frame.times.host_s for frame in raw]) - START_S
    return replace(whole, raw=raw, solved=solved, holes=holes_of(times, RATE))


@pytest.fixture(scope="module")
def folder(recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp("holes")
    export(recording, ["c3d", "trc", "csv", "bvh", "gltf"], folder)
    return folder


def test_the_hole_keeps_its_place_on_the_even_grid(recording):
    timeline = timeline_of(recording.raw, RATE)
    assert timeline.n_slots == 240 + MISSING
    steps = np.diff(timeline.slots)
    assert np.flatnonzero(steps != 1).tolist() == [BEFORE - 1] and steps[BEFORE - 1] == MISSING + 1


def test_a_file_beside_them_says_where(folder):
    with (folder / "take 1_holes.csv").open() as stream:
        (row,) = csv.DictReader(stream)
    assert float(row["from_s"]) == pytest.approx(BEFORE / RATE, abs=1e-5)
    assert float(row["to_s"]) == pytest.approx(BEFORE / RATE + SILENCE_S, abs=1e-5)
    assert int(row["frames"]) == MISSING


def test_no_such_file_without_holes(tmp_path):
    export(solution(lost=()), ["trc"], tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["take 1.trc", "take 1_export.json"]


def test_c3d_and_trc_hold_gaps(folder):
    hole = slice(BEFORE, BEFORE + MISSING)
    points = ezc3d.c3d(str(folder / "take 1.c3d"))["data"]["points"]
    assert points.shape[2] == 240 + MISSING
    assert np.isnan(points[:3, :, hole]).all() and not np.isnan(points[:3, :, hole.stop :]).all(axis=(0, 1)).any()
    read = trc.read(folder / "take 1.trc")
    assert np.isnan(read.points_m[hole]).all() and read.n_frames == 240 + MISSING


def test_bvh_holds_the_pose(folder):
    motion = read_bvh(folder / "take 1_right.bvh")
    assert len(motion.values) == 240 + MISSING
    assert (motion.values[BEFORE : BEFORE + MISSING] == motion.values[BEFORE - 1]).all()
    assert not (motion.values[BEFORE + MISSING] == motion.values[BEFORE - 1]).all()


def test_a_hand_in_gltf_does_not_drift_through_the_hole(folder):
    gltf = pygltflib.GLTF2().load(str(folder / "take 1.glb"))
    sampler = gltf.animations[0].samplers[0]

    def values(accessor):
        described = gltf.accessors[accessor]
        view = gltf.bufferViews[described.bufferView]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[described.type]
        data = gltf.binary_blob()[view.byteOffset : view.byteOffset + 4 * width * described.count]
        return np.frombuffer(data, "<f4").reshape(described.count, width)

    times, wrist = values(sampler.input)[:, 0], values(sampler.output)
    assert len(times) == 241 and (np.diff(times) > 0).all()
    inside = np.linspace(BEFORE / RATE, BEFORE / RATE + SILENCE_S - 2 / RATE, 50)
    for axis in range(3):
        blended = np.interp(inside, times, wrist[:, axis])
        assert np.ptp(blended) == 0.0 and blended[0] == wrist[BEFORE - 1, axis]
