"""C3D (c3d.org): labelled markers of all hands, millimetres, Y up.

Reals of an Intel processor. A marker's residual tells what it is: above zero measured, zero predicted (C3D's mark
for a point that was calculated), -1 missing. One file holds at most 65,535 frames; longer recordings are split.
Written here because the library for it puts residuals where other programs read the camera mask (ezc3d 1.7,
pyomeca/ezc3d issue 386); the tests read the files with that library.
"""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np

from core.frames import BoolArray, FloatArray
from core.takes.export.c3d_section import BLOCK, MOST_TEXTS, Value, parameter_section
from core.takes.export.compare import compare, mismatch, read_back
from core.takes.export.content import Content
from core.takes.export.markers import MarkerTable, marker_table
from core.takes.export.naming import file_stem
from core.takes.export.progress import Progress
from core.takes.formats.c3d import read_with_residuals

MAX_FRAMES = 65_535
TOLERANCE_M = 1e-6
"""Reals of 32 bits hold millimetres to better than this up to 16 m from the origin."""

MEASURED = 1.0
"""Fourth word of a measured point: no camera known, one step of POINT:SCALE as its residual."""

_MM = 1000.0
_CHUNK = 4096


def names(content: Content) -> list[str]:
    """One file, or as many parts as 65,535 frames each make necessary."""
    stem, n_parts = file_stem(content.solution.name), _n_parts(content)
    return [f"{stem}.c3d"] if n_parts == 1 else [f"{stem}_part{i + 1}.c3d" for i in range(n_parts)]


def write(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, CancelledError, OSError."""
    table = marker_table(content, progress.part(0.0, 0.4))
    for i, path in enumerate(paths):
        frames = slice(i * MAX_FRAMES, (i + 1) * MAX_FRAMES)
        part = replace(table, points_m=table.points_m[frames], measured=table.measured[frames])
        step = progress.part(0.4 + 0.6 * i / len(paths), 0.4 + 0.6 * (i + 1) / len(paths))
        _write_part(path, part, content.timeline.rate_hz, i, len(paths), step.part(0.0, 0.5))
        step(0.5, f"Reading back {path.name}")
        _check(path, part, i * MAX_FRAMES + 1)
        step(1.0, f"{path.name} is complete")


def _n_parts(content: Content) -> int:
    return max(-(-content.timeline.n_slots // MAX_FRAMES), 1)


def _write_part(path: Path, part: MarkerTable, rate_hz: float, index: int, n_parts: int, progress: Progress) -> None:
    n_frames, n_points = part.measured.shape
    farthest_mm = float(np.abs(np.nan_to_num(part.points_m)).max(initial=0.0)) * _MM
    scale = -max(farthest_mm / 32_000.0, 0.001)  # as the format asks; negative: the points are reals
    data_block = 2 + len(_parameters(part, n_frames, rate_hz, scale, index, n_parts, 0)) // BLOCK
    with path.open("wb") as stream:
        stream.write(_header(n_points, n_frames, rate_hz, scale, data_block))
        stream.write(_parameters(part, n_frames, rate_hz, scale, index, n_parts, data_block))
        for start in range(0, n_frames, _CHUNK):
            progress(start / n_frames, f"Writing {path.name}: frame {start} of {n_frames}")
            stream.write(_points(part.points_m[start : start + _CHUNK], part.measured[start : start + _CHUNK]))
        stream.write(bytes(-stream.tell() % BLOCK))


def _points(points_m: FloatArray, measured: BoolArray) -> bytes:
    missing = np.isnan(points_m[:, :, 0])
    table = np.zeros((*measured.shape, 4), dtype="<f4")
    table[:, :, :3] = np.where(missing[:, :, None], 0.0, points_m * _MM)
    table[:, :, 3] = np.where(missing, -1.0, np.where(measured, MEASURED, 0.0))
    return table.tobytes()


def _header(n_points: int, n_frames: int, rate_hz: float, scale: float, data_block: int) -> bytes:
    words = struct.pack("<BBHHHHHfHHf", 2, 0x50, n_points, 0, 1, n_frames, 0, scale, data_block, 0, rate_hz)
    return words.ljust(BLOCK, b"\0")


def _parameters(
    part: MarkerTable, n_frames: int, rate_hz: float, scale: float, index: int, n_parts: int, data_block: int
) -> bytes:
    labels = part.labels
    return parameter_section(
        {
            "POINT": {
                "USED": len(labels),
                "SCALE": scale,
                "RATE": rate_hz,
                "DATA_START": data_block,
                "FRAMES": n_frames,
                **_in_parts("LABELS", labels),
                **_in_parts("DESCRIPTIONS", ("",) * len(labels)),
                "UNITS": ("mm",),
                "X_SCREEN": ("+X",),
                "Y_SCREEN": ("+Y",),
            },
            **_subjects(part.subjects),
            # Programs for biomechanics expect these two, even empty.
            "ANALOG": {"USED": 0, "GEN_SCALE": 1.0, "RATE": 0.0},
            "FORCE_PLATFORM": {"USED": 0},
            "MANUFACTURER": {"COMPANY": ("Phalanx",), "SOFTWARE": ("Phalanx",)},
            "PHALANX": {"PART": index + 1, "PARTS": n_parts, "START_S": index * MAX_FRAMES / rate_hz},
        }
    )


def _in_parts(name: str, texts: tuple[str, ...]) -> dict[str, Value]:
    """LABELS, LABELS2, ...: a parameter holds 255 texts (c3d.org, "POINT:LABELS2")."""
    parts = [texts[i : i + MOST_TEXTS] for i in range(0, len(texts), MOST_TEXTS)]
    return {name + (str(i + 1) if i else ""): part for i, part in enumerate(parts)}


def _subjects(subjects: tuple[str, ...]) -> dict[str, dict[str, Value]]:
    """Whose markers begin with what, as Vicon's programs write it; nothing for one performer."""
    if len(subjects) == 1:
        return {}
    prefixes = tuple(f"{subject}:" for subject in subjects)
    return {"SUBJECTS": {"USED": len(subjects), "NAMES": subjects, "LABEL_PREFIXES": prefixes}}


def _check(path: Path, part: MarkerTable, first_frame: int) -> None:
    recording, residuals = read_back(path, read_with_residuals)
    if recording.labels != part.labels:
        raise mismatch(path, f"its markers are {', '.join(recording.labels[:5])} ...")
    compare(path, recording.points_m, part.points_m, TOLERANCE_M, part.labels, first_frame)
    missing = np.isnan(part.points_m[:, :, 0])
    kind = np.where(missing, -1.0, np.where(part.measured, 1.0, 0.0))
    compare(path, np.sign(residuals), kind, 0.0, part.labels, first_frame, "(sign of the residual)")
