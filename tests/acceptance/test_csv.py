"""CSV in pandas: every table read without a word about its form, and as true as the frames it was written from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from core.frames import NO_POINT, HandKey, HandState
from core.hand.skeleton import DOF_NAMES, JOINT_NAMES, TIP_NAMES
from tests.acceptance import truth
from tests.acceptance.programs import CSV_PANDAS
from tests.acceptance.report import Row
from tests.acceptance.takes import KINDS, RATE_HZ, Taken

NEAR_M, NEAR_RAD = 0.06e-6, 1e-9

kinds = pytest.mark.parametrize("kind", KINDS)


def table(bench, kind: str, name: str):
    """What pandas makes of one of a take's tables, as arrays by column; and the program."""
    opened = bench.open(CSV_PANDAS, "csv")
    (path,) = [path for path in bench.files(kind, "csv") if Path(path).name.endswith(f"{name}.csv")]
    found = opened.file(path)
    texts = {"performer", "hand", "marker", "joint", "source", "state", "prop", "text"}
    columns = {
        column: np.array(values, dtype=object if column in texts else np.float64)
        for column, values in found["columns"].items()
    }
    return columns, opened.program


def whose(taken: Taken, key: HandKey, columns) -> np.ndarray:
    """Which lines are of one hand."""
    lines = columns["hand"] == key.side
    if len(taken.kind.worn) > 1:
        # A performer whose name is a number is a number to pandas, as to any reader of tables.
        named = taken.kind.worn[key.performer].performer or str(key.performer + 1)
        lines &= np.array([str(one) == named for one in columns["performer"]])
    return lines


@kinds
def test_markers(bench, report, kind: str) -> None:
    taken = bench.taken(kind)
    columns, program = table(bench, kind, "markers")
    compared = 0
    for key in truth.hands(taken):
        lines = whose(taken, key, columns)
        compared += int(lines.sum())
        frames = zip(taken.solution.solved, truth.each(taken, key), strict=True)
        hands = [(frame.sequence, hand) for frame, hand in frames if hand is not None]
        names = taken.kind.worn[key.performer].layout.marker_names
        assert columns["marker"][lines].tolist() == list(names) * len(hands)
        if not hands:
            continue
        np.testing.assert_array_equal(columns["frame"][lines], np.repeat([number for number, _ in hands], len(names)))
        point = np.concatenate([hand.point for _, hand in hands])
        np.testing.assert_array_equal(columns["source"][lines] == "predicted", point == NO_POINT)
        places = np.concatenate([hand.markers_world_m for _, hand in hands])
        _near(report, program, kind, "markers.csv", columns, lines, places)
    assert 0 < compared == len(columns["hand"])


@kinds
def test_joints(bench, report, kind: str) -> None:
    taken = bench.taken(kind)
    columns, program = table(bench, kind, "joints")
    compared = 0
    for key in truth.hands(taken):
        lines = whose(taken, key, columns)
        compared += int(lines.sum())
        hands = [hand for hand in truth.each(taken, key) if hand is not None]
        assert columns["joint"][lines].tolist() == [*JOINT_NAMES, *TIP_NAMES] * len(hands)
        if not hands:
            continue
        places = np.concatenate([truth.with_ends(taken, hand) for hand in hands])
        _near(report, program, kind, "joints.csv", columns, lines, places)
        # A fingertip is turned as the joint that it follows.
        joints = [*range(len(JOINT_NAMES)), *truth.LAST]
        turns = np.concatenate([hand.joints_world[joints, :3, :3] for hand in hands])
        w, x, y, z = (columns[name][lines] for name in ("qw", "qx", "qy", "qz"))
        # The first and last columns of the rotation that the quaternion is.
        first = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1)
        last = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
        np.testing.assert_allclose(first, turns[:, :, 0], atol=1e-8)
        np.testing.assert_allclose(last, turns[:, :, 2], atol=1e-8)
    assert 0 < compared == len(columns["hand"])


@kinds
def test_angles(bench, report, kind: str) -> None:
    """A line for every hand in every frame; cells are empty, and the state says why, where it is not tracked."""
    taken = bench.taken(kind)
    columns, program = table(bench, kind, "angles")
    compared = 0
    for key in truth.hands(taken):
        lines = whose(taken, key, columns)
        compared += int(lines.sum())
        hands = [hand for frame in taken.solution.solved for hand in frame.hands if hand.key == key]
        assert columns["state"][lines].tolist() == [hand.state.value for hand in hands]
        theta = np.array([h.theta_rad if h.state is HandState.TRACKED else np.full(26, np.nan) for h in hands])
        found = np.stack([columns[name][lines] for name in DOF_NAMES], axis=1)
        np.testing.assert_array_equal(np.isnan(found), np.isnan(theta))
        np.testing.assert_allclose(found[:, :3], theta[:, :3], atol=NEAR_M)
        np.testing.assert_allclose(found[:, 3:], theta[:, 3:], atol=NEAR_RAD)
        there = ~np.isnan(theta[:, 3:])
        largest = np.degrees(np.abs(found - theta)[:, 3:][there].max(initial=0.0))
        report(Row("CSV", program, kind, "angles.csv", found.size, 1e6 * largest, "µdeg"))
    assert 0 < compared == len(columns["hand"])


def test_props(bench, report) -> None:
    taken = bench.taken("props")
    columns, program = table(bench, "props", "props")
    pens = [pen for frame in taken.solution.solved for pen in frame.props if pen.tracked]
    assert set(columns["prop"]) == {"pen"} and len(columns["prop"]) == len(pens)
    everywhere = np.ones(len(pens), dtype=bool)
    places = np.array([pen.transform_world[:3, 3] for pen in pens])
    _near(report, program, "props", "props.csv", columns, everywhere, places)


def test_holes(bench, report) -> None:
    columns, program = table(bench, "a hole in time", "holes")
    hole = KINDS["a hole in time"].hole
    np.testing.assert_allclose(
        [columns["from_s"][0], columns["to_s"][0]], [hole.start / 120.0, hole.stop / 120.0], atol=1e-6
    )
    assert columns["frames"].tolist() == [len(hole)]
    report(Row("CSV", program, "a hole in time", "holes.csv", 3, 0.0))


@kinds
def test_when_a_pose_is_held(bench, report, kind: str) -> None:
    """Beside BVH and glTF, which can only hold it."""
    taken = bench.taken(kind)
    held = [
        (truth.hand_words(taken, key), *span) for key in truth.tracked_hands(taken) for span in truth.held(taken, key)
    ]
    paths = [path for path in bench.files(kind, "bvh") if path.name.endswith("held.csv")]
    if not held and kind != "props":
        assert not paths
        return
    opened = bench.open(CSV_PANDAS, "bvh")
    found = opened.file(paths[0])["columns"]
    lines = [i for i, name in enumerate(found["held"]) if name.endswith("hand")]
    assert [found["held"][i] for i in lines] == [name for name, *_ in held]
    assert [found["reason"][i] for i in lines] == [why for *_, why in held]
    frames = [(found["from_frame"][i], found["to_frame"][i]) for i in lines]
    assert frames == [(first + 1, stop) for _, first, stop, _ in held]
    times_s = [(found["from_s"][i], found["to_s"][i]) for i in lines]
    np.testing.assert_allclose(
        np.reshape(times_s, (-1, 2)), np.reshape([(a, b) for _, a, b, _ in held], (-1, 2)) / RATE_HZ, atol=1e-6
    )
    report(Row("CSV", opened.program, kind, "held.csv", 6 * len(held), 0.0))


@kinds
def test_marks(bench, report, kind: str) -> None:
    marks = KINDS[kind].marks
    if not marks:
        assert not [path for path in bench.files(kind, "csv") if path.name.endswith("marks.csv")]
        return
    columns, program = table(bench, kind, "marks")
    np.testing.assert_allclose(columns["time_s"], [i / RATE_HZ for i, _ in marks], atol=1e-6)
    solved = bench.taken(kind).solution.solved
    assert columns["frame"].tolist() == [solved[i].sequence for i, _ in marks]
    assert [text or "" for text in columns["text"]] == [text for _, text in marks]
    report(Row("CSV", program, kind, "marks.csv", 3 * len(marks), 0.0))


@kinds
def test_points(bench, report, kind: str) -> None:
    """The raw points, and a line without any for a frame that held none."""
    taken = bench.taken(kind)
    opened = bench.open(CSV_PANDAS, "points")
    (path,) = [path for path in bench.files(kind, "points") if path.name.endswith("points.csv")]
    found = {name: np.array(values, dtype=np.float64) for name, values in opened.file(path)["columns"].items()}
    points = [frame.points_m if len(frame.points_m) else np.full((1, 3), np.nan) for frame in taken.solution.raw]
    numbers = np.repeat([frame.sequence for frame in taken.solution.raw], [len(one) for one in points])
    np.testing.assert_array_equal(found["frame"], numbers)
    everywhere = np.ones(len(numbers), dtype=bool)
    _near(report, opened.program, kind, "points.csv", found, everywhere, np.concatenate(points))


def _near(report, program: str, kind: str, name: str, columns, lines, expected) -> None:
    found = np.stack([columns[column][lines] for column in ("x_m", "y_m", "z_m")], axis=1)
    np.testing.assert_allclose(found, expected, atol=NEAR_M)
    largest = float(np.nanmax(np.abs(found - expected), initial=0.0))
    report(Row("CSV", program, kind, name, found.size, 1e6 * largest, "µm"))
