"""Plain CSV with one header line: markers.csv, angles.csv, joints.csv, props.csv where the profile has props, and
points.csv of the raw frames.

Metres, radians, seconds, Y up; points as decimal mark. `frame` is the device's frame number, `time_s` counts from
the first frame of the recording. `time_source_s`, always the last column, is the time of the file that it came from, or
of the device's own clock; empty where that tells none. With several performers there is a column `performer` before
`hand`. Hands that are not tracked have no lines in markers.csv and joints.csv, and empty cells in angles.csv.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from math import isnan, nan
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from core.cast import props_of
from core.frames import NO_POINT, HandKey, HandState
from core.hand.skeleton import DOF_NAMES, JOINT_NAMES, N_DOFS, N_JOINTS, TIP_JOINTS, TIP_NAMES
from core.hand.tips import tips_world
from core.sources import SOURCES
from core.takes.export.compare import mismatch
from core.takes.export.content import Content
from core.takes.export.counted import reported
from core.takes.export.csv_text import csv_text
from core.takes.export.fixed_std import FixedErrors
from core.takes.export.progress import Progress
from core.takes.export.timeline import timeline_of
from core.takes.formats.points_csv import WITH_SOURCE as POINTS_HEADER

Cell = str | int | float
Row = tuple[Cell, ...]
_CLOSE = 0.51  # of the last decimal: half of it, and the rounding of the number itself

SOURCE = "time_source_s"
"""The last column."""

_BLOCK = 128  # frames whose rotations are converted, and whose deviations are found, at once


@dataclass(frozen=True)
class Table:
    """One file: its header, the decimals of each column (0: text or integers), and its rows, frame by frame."""

    file_name: str
    header: tuple[str, ...]
    decimals: tuple[int, ...]
    frames: Callable[[Content], Iterator[list[Row]]]

    @cached_property
    def line_format(self) -> str:
        """Of a row without gaps and quotes."""
        return ",".join(f"%.{n}f" if n else "%s" for n in self.decimals)

    @cached_property
    def reals(self) -> list[tuple[int, float]]:
        """Columns of decimals, and how near a value must read back."""
        return [(i, _CLOSE * 10.0**-n) for i, n in enumerate(self.decimals) if n]

    @cached_property
    def texts(self) -> list[int]:
        """The other columns."""
        return [i for i, n in enumerate(self.decimals) if not n]


def names(content: Content) -> list[str]:
    """The files of the solved frames."""
    return [table.file_name for table in _solved_tables(content)]


def write(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, CancelledError, OSError."""
    for i, (table, path) in enumerate(zip(_solved_tables(content), paths, strict=True)):
        step = progress.part(i / len(paths), (i + 1) / len(paths))
        _write_and_check(table, path, content, content.timeline.n_frames, step)


def points_names(content: Content) -> list[str]:
    """The one file of the raw frames."""
    return [POINTS.file_name]


def write_points(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, CancelledError, OSError."""
    _write_and_check(POINTS, paths[0], content, len(content.raw), progress)


def _solved_tables(content: Content) -> tuple[Table, ...]:
    tables = SOLVED_TABLES if len(content.cast) == 1 else tuple(_with_performers(table) for table in SOLVED_TABLES)
    return (*tables, PROPS) if props_of(content.cast) else tables


def _with_performers(table: Table) -> Table:
    """The same with the performer in a column of his own, before the hand."""
    k = table.header.index("hand")
    header = (*table.header[:k], "performer", *table.header[k:])
    return replace(table, header=header, decimals=(*table.decimals[:k], 0, *table.decimals[k:]))


def _whose(content: Content) -> dict[HandKey, tuple[str, ...]]:
    """The cells that say which hand it is: side, or performer and side."""
    if len(content.cast) == 1:
        return {hand: (hand.side,) for hand in content.hands}
    return {hand: (csv_text(content.performers[hand.performer]), hand.side) for hand in content.hands}


def _write_and_check(table: Table, path: Path, content: Content, n_frames: int, progress: Progress) -> None:
    with path.open("w", encoding="utf-8", newline="") as stream:
        stream.write(",".join(table.header) + "\n")
        for rows in progress.part(0.0, 0.5).over(table.frames(content), f"Writing {path.name}", n_frames):
            stream.writelines(_line(row, table) for row in rows)
    _check(table, path, content, n_frames, progress.part(0.5, 1.0))


def _check(table: Table, path: Path, content: Content, n_frames: int, progress: Progress) -> None:
    with path.open(encoding="utf-8", newline="") as stream:
        lines = csv.reader(stream)
        if tuple(next(lines, ())) != table.header:
            raise mismatch(path, "its header line differs")
        for rows in progress.over(table.frames(content), f"Reading back {path.name}", n_frames):
            for row in rows:
                _compare(path, next(lines, []), row, table)
        if next(lines, None) is not None:
            raise mismatch(path, "it goes on after its last line")


def _line(row: Row, table: Table) -> str:
    line = table.line_format % row
    if line.count(",") != len(row) - 1 or "nan" in line or '"' in line or "\n" in line or "\r" in line:
        line = ",".join(map(_cell, row, table.decimals))
    return line + "\n"


def _cell(value: Cell, decimals: int) -> str:
    if isinstance(value, float):
        return "" if isnan(value) else f"{value:.{decimals}f}"
    text = str(value)
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\r\n') else text


def _compare(path: Path, cells: list[str], row: Row, table: Table) -> None:
    """Fast where all is well, else cell by cell."""
    try:
        equal = len(cells) == len(row)
        for i in table.texts:
            equal = equal and cells[i] == str(row[i])
        for i, tolerance in table.reals:
            equal = equal and abs(float(cells[i]) - row[i]) <= tolerance  # type: ignore[operator]
    except (ValueError, IndexError):
        equal = False
    if equal:
        return
    for cell, value, decimals, column in zip(cells, row, table.decimals, table.header, strict=False):
        if not _same(cell, value, decimals):
            raise mismatch(path, f"frame {row[0]}, {column}: {cell!r} stands where {value!r} was written")
    if len(cells) != len(row):
        raise mismatch(path, f"frame {row[0]} has {len(cells)} cells instead of {len(row)}")


def _same(cell: str, value: Cell, decimals: int) -> bool:
    if not isinstance(value, float):
        return cell == str(value)
    try:
        read = float(cell)
        return read == value or abs(read - value) <= _CLOSE * 10.0**-decimals
    except ValueError:
        return not cell and isnan(value)


def _marker_rows(content: Content) -> Iterator[list[Row]]:
    whose = _whose(content)
    marker_names = [tuple(map(csv_text, profile.layout.marker_names)) for profile in content.cast]
    for frame, time in zip(content.solved, content.timeline.times_s.tolist(), strict=False):
        rows: list[Row] = []
        source_s = float(frame.times.device_s)
        for hand in frame.hands:
            if hand.state is not HandState.TRACKED:
                continue
            places, points, confidences, deviations = (
                values.tolist() for values in (hand.markers_world_m, hand.point, hand.confidence, hand.marker_std_m)
            )
            for name, (x, y, z), point, confidence, std_m in zip(
                marker_names[hand.performer], places, points, confidences, deviations, strict=True
            ):
                if point == NO_POINT and content.options.measured:
                    continue
                source = "predicted" if point == NO_POINT else "observed"
                rows.append(
                    (frame.sequence, time, *whose[hand.key], name, x, y, z, source, point, confidence, std_m, source_s)
                )
        yield rows


def _angle_rows(content: Content) -> Iterator[list[Row]]:
    whose, nothing = _whose(content), (*(nan,) * (1 + 3 * N_DOFS), *("",) * N_DOFS)
    fixed, sources = FixedErrors(content), content.sources()
    frames = zip(content.solved, content.timeline.times_s.tolist(), strict=False)
    while block := list(islice(frames, _BLOCK)):
        tracked = [hand for frame, _ in block for hand in frame.hands if hand.state is HandState.TRACKED]
        fixed_std = iter(fixed.of(tracked))
        for frame, time in block:
            source = next(sources)
            yield [
                (frame.sequence, time, *whose[hand.key], hand.state.value)
                + (
                    (
                        float(hand.rms_m),
                        *(value for values in reported(content, hand) for value in values.tolist()),
                        *next(fixed_std).tolist(),
                        *(SOURCES[k] for k in source[hand.key]),
                    )
                    if hand.state is HandState.TRACKED
                    else nothing
                )
                + (float(frame.times.device_s),)
                for hand in frame.hands
            ]


def _joint_rows(content: Content) -> Iterator[list[Row]]:
    whose, frames = _whose(content), zip(content.solved, content.timeline.times_s.tolist(), strict=False)
    while block := list(islice(frames, _BLOCK)):
        hands = [hand for frame, _ in block for hand in frame.hands if hand.state is HandState.TRACKED]
        joints = np.array([hand.joints_world for hand in hands]).reshape(-1, 4, 4)
        rotations = Rotation.from_matrix(joints[:, :3, :3]).as_quat(canonical=True).tolist() if hands else []
        each = zip(joints[:, :3, 3].tolist(), rotations, strict=True)
        for frame, time in block:
            rows: list[Row] = []
            source_s = float(frame.times.device_s)
            for hand in frame.hands:
                if hand.state is not HandState.TRACKED:
                    continue
                poses = list(islice(each, N_JOINTS))
                skeleton = content.cast[hand.performer].hand.skeleton
                tips = tips_world(skeleton, hand.side, hand.joints_world, hand.scale).tolist()
                poses += [(tip, poses[joint][1]) for tip, joint in zip(tips, TIP_JOINTS, strict=True)]
                rows += [
                    (frame.sequence, time, *whose[hand.key], name, *position, qw, qx, qy, qz, source_s)
                    for name, (position, (qx, qy, qz, qw)) in zip(JOINT_NAMES + TIP_NAMES, poses, strict=True)
                ]
            yield rows


def _prop_rows(content: Content) -> Iterator[list[Row]]:
    for frame, time in zip(content.solved, content.timeline.times_s.tolist(), strict=False):
        rows: list[Row] = []
        source_s = float(frame.times.device_s)
        for prop in frame.props:
            if prop.tracked:
                turn = Rotation.from_matrix(prop.transform_world[:3, :3])
                qx, qy, qz, qw = turn.as_quat(canonical=True).tolist()
                position = prop.transform_world[:3, 3].tolist()
                seen = int((prop.point != NO_POINT).sum()), float(prop.rms_m)
                rows.append((frame.sequence, time, csv_text(prop.name), *position, qw, qx, qy, qz, *seen, source_s))
        yield rows


def _point_rows(content: Content) -> Iterator[list[Row]]:
    raw = content.raw
    times = timeline_of(raw, content.timeline.rate_hz).times_s.tolist()
    for frame, time in zip(raw, times, strict=True):
        seen = ~np.isnan(frame.points_m).any(axis=1)
        points = zip(frame.ids[seen].tolist(), frame.points_m[seen].tolist(), strict=True)
        source_s = float(frame.times.device_s)
        yield [(frame.sequence, time, number, *point, source_s) for number, point in points] or [
            (frame.sequence, time, "", nan, nan, nan, source_s)  # the frame was received, and held no point
        ]


MARKERS = Table(
    "markers.csv",
    ("frame", "time_s", "hand", "marker", "x_m", "y_m", "z_m", "source", "point", "confidence", "std_m", SOURCE),
    (0, 6, 0, 0, 7, 7, 7, 0, 0, 4, 7, 6),
    _marker_rows,
)
ANGLES = Table(
    "angles.csv",
    (
        *("frame", "time_s", "hand", "state", "rms_m", *DOF_NAMES),
        *(f"{name}_std" for name in DOF_NAMES),
        *(f"{name}_std_fixed" for name in DOF_NAMES),
        *(f"{name}_source" for name in DOF_NAMES),
        SOURCE,
    ),
    (0, 6, 0, 0, 7, *(7,) * 3, *(9,) * (N_DOFS - 3), *(7,) * N_DOFS, *(7,) * N_DOFS, *(0,) * N_DOFS, 6),
    _angle_rows,
)
JOINTS = Table(
    "joints.csv",
    ("frame", "time_s", "hand", "joint", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", SOURCE),
    (0, 6, 0, 0, 7, 7, 7, 9, 9, 9, 9, 6),
    _joint_rows,
)
PROPS = Table(
    "props.csv",
    ("frame", "time_s", "prop", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "markers", "rms_m", SOURCE),
    (0, 6, 0, 7, 7, 7, 9, 9, 9, 9, 0, 7, 6),
    _prop_rows,
)
POINTS = Table("points.csv", tuple(POINTS_HEADER.split(",")), (0, 6, 0, 7, 7, 7, 6), _point_rows)
SOLVED_TABLES = (MARKERS, ANGLES, JOINTS)
