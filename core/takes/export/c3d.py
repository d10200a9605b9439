"""C3D (c3d.org): labelled markers of all hands, millimetres, Y up, unless asked otherwise.

Reals of an Intel processor. A marker's residual tells what it is: above zero measured, zero predicted (C3D's mark
for a point that was calculated), -1 missing. One file holds at most 65,535 frames; longer recordings are split.
Written here because the library for it puts residuals where other programs read the camera mask (ezc3d 1.7,
pyomeca/ezc3d issue 386); the tests read the files with that library.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.frames import BoolArray, FloatArray
from core.takes.export.c3d_events import Event, event_group, put_in_header
from core.takes.export.c3d_facts import facts
from core.takes.export.c3d_section import BLOCK, MOST_TEXTS, Value, parameter_section
from core.takes.export.compare import compare, mismatch, read_back
from core.takes.export.content import Content
from core.takes.export.markers import MarkerTable, marker_table, n_marker_columns
from core.takes.export.options import UNITS_M
from core.takes.export.progress import Progress
from core.takes.export.turned import points_to_z_up
from core.takes.formats.c3d import read_with_residuals
from core.takes.formats.c3d_labels import COMPUTED, OWN_GROUP
from core.takes.formats.c3d_parameters import read_parameters

MAX_FRAMES = 65_535
TOLERANCE_M = 1e-6
"""Reals of 32 bits hold positions to better than this up to 16 m from the origin."""

MEASURED = 1.0
"""Fourth word of a measured point: no camera known, one step of POINT:SCALE as its residual."""

_CHUNK = 4096


@dataclass(frozen=True)
class _Part:
    """One file: the index-th of `count`, with its frames and the marks of its time."""

    content: Content
    table: MarkerTable
    index: int
    count: int

    @property
    def rate_hz(self) -> float:
        return self.content.grid.rate_hz

    @property
    def unit(self) -> str:
        return self.content.options.unit or "mm"

    @property
    def per_m(self) -> float:
        """Units of the file in a metre."""
        return 1.0 / UNITS_M[self.unit]

    @property
    def start_s(self) -> float:
        """When its first frame is, on the grid [s]."""
        return self.index * MAX_FRAMES / self.rate_hz

    @property
    def events(self) -> list[Event]:
        """Marks outside all frames are in the part that is nearest."""
        first = self.start_s if self.index else -np.inf
        last = self.start_s + MAX_FRAMES / self.rate_hz if self.index + 1 < self.count else np.inf
        placed = [Event(self.content.grid.place_s(mark.time_s), mark.text) for mark in self.content.solution.marks]
        return [
            Event(max(event.time_s - self.start_s, 0.0), event.text)
            for event in sorted(placed, key=lambda event: event.time_s)
            if first <= event.time_s < last
        ]


def names(content: Content) -> list[str]:
    """One file, or as many parts as 65,535 frames each make necessary."""
    n_parts = _n_parts(content)
    return [f"{content.stem}.c3d"] if n_parts == 1 else [f"{content.stem}_part{i + 1}.c3d" for i in range(n_parts)]


def counts(content: Content) -> list[int]:
    """Frames in each part."""
    n = len(content.grid)
    return [min(n - first, MAX_FRAMES) for first in range(0, max(n, 1), MAX_FRAMES)]


def write(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, CancelledError, OSError."""
    table = marker_table(content, progress.part(0.0, 0.4))
    for i, path in enumerate(paths):
        part = _Part(content, table.rows(slice(i * MAX_FRAMES, (i + 1) * MAX_FRAMES)), i, len(paths))
        step = progress.part(0.4 + 0.6 * i / len(paths), 0.4 + 0.6 * (i + 1) / len(paths))
        _write_part(path, part, step.part(0.0, 0.5))
        step(0.5, f"Reading back {path.name}")
        _check(path, part)
        step(1.0, f"{path.name} is complete")


def _n_parts(content: Content) -> int:
    return max(-(-len(content.grid) // MAX_FRAMES), 1)


def _write_part(path: Path, part: _Part, progress: Progress) -> None:
    points_m, measured = part.table.points_m, part.table.measured
    n_frames, n_points = measured.shape
    farthest = float(np.abs(np.nan_to_num(points_m)).max(initial=0.0)) * part.per_m
    scale = -max(farthest / 32_000.0, 1e-6 * part.per_m)  # as the format asks; negative: the points are reals
    data_block = 2 + len(_parameters(part, scale, 0)) // BLOCK
    with path.open("wb") as stream:
        stream.write(_header(part, n_points, n_frames, scale, data_block))
        stream.write(_parameters(part, scale, data_block))
        for start in range(0, n_frames, _CHUNK):
            progress(start / n_frames, f"Writing {path.name}: frame {start} of {n_frames}")
            stream.write(_points(points_m[start : start + _CHUNK] * part.per_m, measured[start : start + _CHUNK]))
        stream.write(bytes(-stream.tell() % BLOCK))


def _points(points: FloatArray, measured: BoolArray) -> bytes:
    missing = np.isnan(points[:, :, 0])
    table = np.zeros((*measured.shape, 4), dtype="<f4")
    table[:, :, :3] = np.where(missing[:, :, None], 0.0, points)
    table[:, :, 3] = np.where(missing, -1.0, np.where(measured, MEASURED, 0.0))
    return table.tobytes()


def _header(part: _Part, n_points: int, n_frames: int, scale: float, data_block: int) -> bytes:
    words = struct.pack("<BBHHHHHfHHf", 2, 0x50, n_points, 0, 1, n_frames, 0, scale, data_block, 0, part.rate_hz)
    header = bytearray(words.ljust(BLOCK, b"\0"))
    put_in_header(header, part.events)
    return bytes(header)


def _parameters(part: _Part, scale: float, data_block: int) -> bytes:
    labels, n_frames = part.table.labels, len(part.table.points_m)
    about = facts(part.content, n_frames, part.index, part.count, part.start_s)
    about[OWN_GROUP] |= _in_parts(COMPUTED, labels[n_marker_columns(part.content) :])
    subjects = about.get("SUBJECTS", {}).get("NAMES", ("",))
    subject = str(subjects[0]) if isinstance(subjects, tuple) and len(subjects) == 1 else ""
    return parameter_section(
        {
            "POINT": {
                "USED": len(labels),
                "SCALE": scale,
                "RATE": part.rate_hz,
                "DATA_START": data_block,
                "FRAMES": n_frames,
                **_in_parts("LABELS", labels),
                **_in_parts("DESCRIPTIONS", ("",) * len(labels)),
                "UNITS": (part.unit,),
                "X_SCREEN": ("+X",),
                "Y_SCREEN": ("+Z" if part.content.options.up == "z" else "+Y",),
            },
            # Programs for biomechanics expect these two, even empty.
            "ANALOG": {"USED": 0, "GEN_SCALE": 1.0, "RATE": 0.0},
            "FORCE_PLATFORM": {"USED": 0},
            **about,
            **event_group(part.events, subject),
        }
    )


def _in_parts(name: str, texts: tuple[str, ...]) -> dict[str, Value]:
    """LABELS, LABELS2, ...: a parameter holds 255 texts (c3d.org, "POINT:LABELS2")."""
    parts = [texts[i : i + MOST_TEXTS] for i in range(0, len(texts), MOST_TEXTS)]
    return {name + (str(i + 1) if i else ""): part for i, part in enumerate(parts)}


def _check(path: Path, part: _Part) -> None:
    table, first_frame = part.table, part.index * MAX_FRAMES + 1
    recording, residuals = read_back(path, read_with_residuals)
    if recording.labels != table.labels:
        raise mismatch(path, f"its markers are {', '.join(recording.labels[:5])} ...")
    written = points_to_z_up(recording.points_m) if part.content.options.up == "z" else recording.points_m
    compare(path, written, table.points_m, TOLERANCE_M, table.labels, first_frame)
    missing = np.isnan(table.points_m[:, :, 0])
    kind = np.where(missing, -1.0, np.where(table.measured, 1.0, 0.0))
    compare(path, np.sign(residuals), kind, 0.0, table.labels, first_frame, "(sign of the residual)")
    _check_events(path, part.events[:MOST_TEXTS])


def _check_events(path: Path, events: list[Event]) -> None:
    with path.open("rb") as stream:
        parameters, _ = read_parameters(path.name, stream.read(BLOCK * 256))
    times = parameters.array("EVENT", "TIMES").reshape(-1, 2)
    wanted = np.array([event.time_s for event in events])
    if len(times) != len(events) or not np.allclose(60.0 * times[:, 0] + times[:, 1], wanted, rtol=0.0, atol=1e-5):
        raise mismatch(path, f"its {len(times)} events are not the {len(events)} marks")
