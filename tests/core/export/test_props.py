"""Props in every format that can hold them."""

from __future__ import annotations

import csv
from dataclasses import replace
from functools import cache

import numpy as np
import pygltflib
import pytest
import trimesh

from core.errors import ExportError
from core.frames import NO_POINT, PropFrame
from core.gltf import read_glb
from core.props.mesh import prop_mesh
from core.takes.export import export, gltf_props
from core.takes.export.gltf_motion import read_tracks
from core.takes.solution import Solution
from tests.core.export.recordings import every_point, solution
from tests.core.props.things import BALL, PEN, path

LOST = range(90, 130)


@cache
def with_props() -> Solution:
    """The performer with a pen that is lost for a while, and a ball that is never seen."""
    plain = solution()
    solved = []
    for i, frame in enumerate(plain.solved):
        pose, lost = path((LOST.start - 1 if i in LOST else i) / 120.0), i in LOST
        point = np.where(np.arange(5) == i % 5, NO_POINT, 50 + np.arange(5))
        pen = PropFrame("pen", pose, not lost, point, np.nan if lost else 0.0003, PEN.placed_m(pose) + 0.0001)
        solved.append(replace(frame, props=(pen,)))
    profile = replace(plain.cast[0], props=(BALL, PEN))
    return Solution("props", profile, plain.rate_hz, plain.raw, tuple(solved))


@pytest.mark.parametrize("name", ["c3d", "trc"])
def test_labelled_points(tmp_path, name):
    (file,) = export(with_props(), [name], tmp_path)
    recording = every_point(file)
    assert recording.labels[-8:] == BALL.marker_names + PEN.marker_names
    assert recording.labels[:-8] == every_point(export(solution(), [name], tmp_path)[0]).labels
    slots = [frame.sequence - 7000 for frame in with_props().solved]
    points = recording.points_m[slots]
    assert np.isnan(points[:, -8:-5]).all()
    for i, frame in enumerate(with_props().solved):
        (pen,) = frame.props
        shown = pen.tracked & ((pen.point != NO_POINT) | (name == "c3d"))  # TRC holds nothing that was not seen
        expected = np.where(np.broadcast_to(shown, 5)[:, None], pen.markers_world_m, np.nan)
        np.testing.assert_allclose(points[i, -5:], expected, atol=1e-6)


def test_props_csv(tmp_path):
    files = export(with_props(), ["csv"], tmp_path)
    assert [file.name for file in files] == ["markers.csv", "angles.csv", "joints.csv", "props.csv"]
    rows = list(csv.DictReader(files[3].open()))
    tracked = [frame for frame in with_props().solved if frame.props[0].tracked]
    assert len(rows) == len(tracked) == len(with_props().solved) - len(LOST)
    for row, frame in zip(rows, tracked, strict=True):
        (pen,) = frame.props
        assert (int(row["frame"]), row["prop"], int(row["markers"])) == (frame.sequence, "pen", 4)
        w, x, y, z = (float(row[name]) for name in ("qw", "qx", "qy", "qz"))
        turned = trimesh.transformations.quaternion_matrix([w, x, y, z])
        np.testing.assert_allclose(turned[:3, :3], pen.transform_world[:3, :3], atol=1e-8)
        np.testing.assert_allclose([float(row[f"{a}_m"]) for a in "xyz"], pen.transform_world[:3, 3], atol=1e-7)
        assert float(row["rms_m"]) == pytest.approx(pen.rms_m)


def test_without_props_there_is_no_file_for_them(tmp_path):
    assert "props.csv" not in [file.name for file in export(solution(), ["csv"], tmp_path)]


def test_gltf_node_with_mesh_and_animation(tmp_path):
    file, _ = export(with_props(), ["gltf"], tmp_path)
    document = pygltflib.GLTF2().load(str(file))
    (number,) = [i for i, node in enumerate(document.nodes) if node.name == "pen"]
    assert number in document.scenes[0].nodes and document.nodes[number].skin is None
    (animation,) = document.animations
    assert sorted(c.target.path for c in animation.channels if c.target.node == number) == ["rotation", "translation"]
    assert "ball" not in [node.name for node in document.nodes]  # never seen
    scene = trimesh.load(file)
    (mesh,) = [mesh for name, mesh in scene.geometry.items() if name.startswith("pen")]
    assert mesh.extents == pytest.approx(np.ptp(prop_mesh(PEN)[0], axis=0), abs=1e-6)
    read = read_glb(file)
    tracks, _ = read_tracks(read)
    for i, frame in enumerate(with_props().solved):
        np.testing.assert_allclose(tracks[number, "translation"][i], frame.props[0].transform_world[:3, 3], atol=1e-6)


def test_a_file_that_differs_is_refused(tmp_path, monkeypatch):
    honest = gltf_props.mesh_of
    monkeypatch.setattr(gltf_props, "mesh_of", lambda *of: honest(*of) | {"name": "pencil"})
    with pytest.raises(ExportError, match="it holds the props pencil"):
        export(with_props(), ["gltf"], tmp_path)
