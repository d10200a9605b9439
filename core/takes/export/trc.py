"""TRC (OpenSim, Motion Analysis): measured markers of hands and props, millimetres, Y up, tab-separated.

The format cannot say of a point that it was predicted, so a marker that was not seen is a gap: an empty cell.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from core.takes.export.compare import compare, mismatch, read_back
from core.takes.export.content import Content
from core.takes.export.markers import MarkerTable, marker_table, n_marker_columns
from core.takes.export.naming import file_stem
from core.takes.export.progress import Progress
from core.takes.formats import trc as reader

DECIMALS = 4
"""Of a millimetre."""

TOLERANCE_M = 0.51e-3 * 10.0**-DECIMALS
_MM = 1000.0


def names(content: Content) -> list[str]:
    """One file."""
    return [file_stem(content.solution.name) + ".trc"]


def write(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, CancelledError, OSError."""
    (path,) = paths
    table = marker_table(content, progress.part(0.0, 0.3))
    n_markers = n_marker_columns(content)
    table.points_m[:, :n_markers][~table.measured[:, :n_markers]] = np.nan
    _write(path, table, content.timeline.rate_hz, progress.part(0.3, 0.8))
    progress(0.8, f"Reading back {path.name}")
    recording = read_back(path, reader.read)
    if recording.labels != table.labels:
        raise mismatch(path, f"its markers are {', '.join(recording.labels[:5])} ...")
    compare(path, recording.points_m, table.points_m, TOLERANCE_M, table.labels)
    times = np.arange(len(table.points_m))[:, None] / content.timeline.rate_hz
    compare(path, recording.times_s[:, None], times, 1e-6, ("Time",), unit="s")
    progress(1.0, f"{path.name} is complete")


def _write(path: Path, table: MarkerTable, rate_hz: float, progress: Progress) -> None:
    n_frames, n_markers = table.measured.shape
    rate = f"{rate_hz:.6f}".rstrip("0").rstrip(".")
    axes = "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, n_markers + 1))
    row = f"\t%.{DECIMALS}f" * (3 * n_markers)
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(
            f"PathFileType\t4\t(X/Y/Z)\t{path.name}\n"
            "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
            f"{rate}\t{rate}\t{n_frames}\t{n_markers}\tmm\t{rate}\t1\t{n_frames}\n"
            "Frame#\tTime\t" + "\t\t\t".join(table.labels) + "\t\t\n"
            f"\t\t{axes}\n\n"
        )
        for i, points in enumerate(progress.over(table.points_m, f"Writing {path.name}")):
            cells = row % tuple((points * _MM).ravel().tolist())
            stream.write(f"{i + 1}\t{i / rate_hz:.6f}{cells.replace('nan', '')}\n")
