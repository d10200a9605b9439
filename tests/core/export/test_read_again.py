"""Files of our own, read again: what was measured comes back, what was predicted or computed does not."""

from dataclasses import replace
from functools import cache

import ezc3d
import numpy as np
import pytest

from app.labels import cast_labels
from core.cast import props_of
from core.frames import NO_POINT, HandState
from core.takes.export import ExportOptions, c3d, export
from core.takes.formats import read_recording
from core.takes.formats.computed import computed_labels, joint_labels
from core.takes.reprocess import solve
from tests.core.export.recordings import every_point, hands_of, solution
from tests.core.export.test_props import with_props

JOINTS = ExportOptions(joints=True)
HIDDEN = 0.2


@cache
def hidden_markers():
    """A recording of which the device saw four of five markers, at one size of the hand."""
    base = solution(150, lost=(), scale=1.0)
    generator = np.random.default_rng(4)

    def hiding(hand):
        hidden = generator.random(len(hand.point)) < HIDDEN
        return replace(hand, point=np.where(hidden, NO_POINT, np.arange(len(hand.point))), scale=1.0)

    solved = tuple(replace(frame, hands=tuple(hiding(hand) for hand in frame.hands)) for frame in base.solved)
    return replace(base, solved=solved)


def observed(recording):
    """(t, m, 3) [m] of the markers that the device saw, NaN for others, left hand first."""

    def seen(hand):
        there = hand.observed & (hand.state is HandState.TRACKED)
        return np.where(there[:, None], hand.markers_world_m, np.nan)

    sides = [[seen(hand) for hand in hands_of(recording, side)] for side in ("left", "right")]
    return np.concatenate(sides, axis=1)


def joints_of(path, profile):
    """(t, 2, 16, 3) [m] of the hands that our engine makes of a file, NaN where it tracks none."""
    recording = read_recording(path)
    return np.array(
        [
            [
                hand.joints_world[:, :3, 3] if hand.state is HandState.TRACKED else np.full((16, 3), np.nan)
                for hand in frame.hands
            ]
            for frame in solve(recording.frames(), profile, labels=cast_labels(recording, profile))
        ]
    )


@pytest.mark.parametrize("options", [ExportOptions(), JOINTS, ExportOptions(joints=True, up="z", unit="m")])
@pytest.mark.parametrize("name", ["c3d", "trc"])
def test_the_observed_markers_come_back(tmp_path, name, options):
    (path,) = export(hidden_markers(), [name], tmp_path, options=options)
    recording, expected = read_recording(path), observed(hidden_markers())
    names = hidden_markers().cast[0].layout.marker_names
    assert recording.labels == tuple(f"{side}_{marker}" for side in "LR" for marker in names)
    assert np.isnan(expected[:, 19:, 0]).mean() == pytest.approx(HIDDEN, abs=0.02)
    if name == "c3d" or options.up == "y":  # TRC cannot say what is up
        np.testing.assert_allclose(recording.points_m, expected, rtol=0.0, atol=1e-6)
    assert np.array_equal(np.isnan(recording.points_m), np.isnan(expected))
    assert recording.gaps.total == recording.gaps.absent == np.isnan(expected[:, :, 0]).sum()
    assert recording.warnings == ()


def test_they_are_solved_alike_from_every_format(tmp_path):
    recording = hidden_markers()
    paths = export(recording, ["c3d", "trc"], tmp_path, options=JOINTS)
    (bare,) = export(recording, ["trc"], tmp_path / "bare")
    expected, *others = [joints_of(path, recording.cast[0]) for path in (bare, *paths)]
    truth = np.array([[hand.joints_world[:, :3, 3] for hand in frame.hands] for frame in recording.solved])
    assert np.nanmax(np.linalg.norm(expected - truth, axis=-1)[30:, 1]) < 0.003
    for other in others:
        np.testing.assert_allclose(other, expected, rtol=0.0, atol=2e-5)


def test_unlabelled_points_hold_no_joint_centres(tmp_path):
    """As points without names they would lie inside the hands."""
    recording = hidden_markers()
    paths = export(recording, ["c3d", "trc"], tmp_path, options=JOINTS)
    seen = [[len(frame.points_m) for frame in read_recording(path).frames()] for path in paths]
    expected = (~np.isnan(observed(recording)[:, :, 0])).sum(axis=1).tolist()
    assert seen == [expected, expected] and max(expected) > 19


@pytest.mark.parametrize("name", ["c3d", "trc"])
def test_markers_of_props_come_back_where_they_were_seen(tmp_path, name):
    (path,) = export(with_props(), [name], tmp_path, options=JOINTS)
    recording = read_recording(path)
    (_, pen) = props_of(with_props().cast)
    assert recording.labels[-5:] == pen.marker_names
    for frame in with_props().solved:
        (prop,) = frame.props
        seen = (prop.point != NO_POINT) & prop.tracked
        expected = np.where(seen[:, None], prop.markers_world_m, np.nan)
        np.testing.assert_allclose(recording.points_m[frame.sequence - 7000, -5:], expected, rtol=0.0, atol=1e-6)


def test_a_marker_that_is_called_like_a_joint_is_a_marker(tmp_path):
    base = solution(30, "schroeder6")
    layout = replace(base.cast[0].layout, marker_names=("wrist_joint", "b", "c", "d", "e", "index_tip_joint"))
    odd = replace(base, profiles=replace(base.cast[0], layout=layout))
    expected = tuple(f"{side}_{marker}" for side in "LR" for marker in layout.marker_names)
    for path in export(odd, ["c3d", "trc"], tmp_path):
        assert read_recording(path).labels == expected
    (path,) = export(odd, ["c3d"], tmp_path / "joints", options=JOINTS)
    assert read_recording(path).labels == expected


def test_computed_labels_are_those_of_whole_hands():
    anna, right = joint_labels("Anna:L_"), joint_labels("R_")
    assert len(right) == 21 and right[0] == "R_wrist_joint" and right[-1] == "R_pinky_tip_joint"
    markers = ("R_ThumbTip", "Anna:L_ThumbTip", "R_wrist", "knee_joint")
    assert computed_labels((*markers, *reversed(anna), *right)) == {*anna, *right}
    assert computed_labels((*markers, *anna[:-1], *right)) == {*right}
    assert computed_labels((*markers, *joint_labels(""), *joint_labels("left_"))) == frozenset()
    assert computed_labels(()) == frozenset()


def test_files_that_do_not_name_what_is_computed(tmp_path, monkeypatch):
    """As Phalanx wrote them at first."""
    monkeypatch.setattr(c3d, "COMPUTED", "SOMETHING")
    (path,) = export(hidden_markers(), ["c3d"], tmp_path, options=JOINTS)
    recording = read_recording(path)
    assert len(recording.labels) == 38
    np.testing.assert_allclose(recording.points_m, observed(hidden_markers()), rtol=0.0, atol=1e-6)


def test_a_file_written_again_by_another_program(tmp_path):
    """Which keeps the group PHALANX; ezc3d keeps the residuals, others set all of them to zero."""
    (path,) = export(hidden_markers(), ["c3d"], tmp_path, options=JOINTS)
    again = tmp_path / "again.c3d"
    ezc3d.c3d(str(path)).write(str(again))
    np.testing.assert_allclose(read_recording(again).points_m, observed(hidden_markers()), rtol=0.0, atol=1e-6)
    data = bytearray(path.read_bytes())
    start = (int(np.frombuffer(data[16:18], "<u2")[0]) - 1) * 512
    table = np.frombuffer(data, "<f4", 150 * 80 * 4, start).reshape(150, 80, 4)
    table[:, :, 3][table[:, :, 3] > 0.0] = 0.0
    again.write_bytes(data)
    everything = every_point(path).points_m[:, :38]
    np.testing.assert_array_equal(read_recording(again).points_m, everything)
    assert np.isnan(everything[:, 19:]).sum() == 0
