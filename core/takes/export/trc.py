"""TRC (OpenSim, Motion Analysis): measured markers of hands and props, millimetres, Y up, tab-separated.

The format cannot say of a point that it was predicted, so a marker that was not seen is a gap: three empty cells. Every
line ends with a tab, as OpenSim writes it: its reader takes an empty last cell for the end of the line, and refuses the
row as too short (OpenSim 4.6, TRCFileAdapter).

Of a recording of another program `Time` begins where that began, so that it still lies beside what else was recorded.
"""

from __future__ import annotations

from math import isfinite
from pathlib import Path

from core.takes.export.compare import compare, mismatch, read_back
from core.takes.export.content import Content
from core.takes.export.markers import MarkerTable, marker_table, n_marker_columns
from core.takes.export.options import UNITS_M
from core.takes.export.progress import Progress
from core.takes.formats import trc as reader

DECIMALS = 4
"""Of a millimetre; as many more of a longer unit."""

_MORE = {"mm": 0, "cm": 1, "m": 3}

TOLERANCE_M = 0.51e-3 * 10.0**-DECIMALS


def names(content: Content) -> list[str]:
    """One file."""
    return [content.stem + ".trc"]


def write(content: Content, paths: list[Path], progress: Progress) -> None:
    """Writes and reads back. Raises ExportError, CancelledError, OSError."""
    (path,) = paths
    table = marker_table(content, progress.part(0.0, 0.3)).measured_only(n_marker_columns(content))
    rate_hz, begin_s = content.grid.rate_hz, _begin_s(content)
    _write(path, table, rate_hz, begin_s, content.options.unit or "mm", progress.part(0.3, 0.8))
    progress(0.8, f"Reading back {path.name}")
    recording = read_back(path, reader.read_all)
    if recording.labels != table.labels:
        raise mismatch(path, f"its markers are {', '.join(recording.labels[:5])} ...")
    compare(path, recording.points_m, table.points_m, TOLERANCE_M, table.labels)
    if recording.source_s is None:
        raise mismatch(path, "its times do not increase")
    compare(path, recording.source_s[:, None], begin_s + content.grid.times_s[:, None], 1e-6, ("Time",), unit="s")
    progress(1.0, f"{path.name} is complete")


def _begin_s(content: Content) -> float:
    """What `Time` begins with [s]: the clock of a live device tells nobody anything."""
    begin_s = content.source_s(0) if content.of_file and len(content.grid) else 0.0
    return begin_s if isfinite(begin_s) else 0.0


def _write(path: Path, table: MarkerTable, rate_hz: float, begin_s: float, unit: str, progress: Progress) -> None:
    n_frames, n_markers = table.measured.shape
    rate = f"{rate_hz:.6f}".rstrip("0").rstrip(".")
    axes = "".join(f"X{i}\tY{i}\tZ{i}\t" for i in range(1, n_markers + 1))
    row = f"%.{DECIMALS + _MORE[unit]}f\t" * (3 * n_markers)
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(
            f"PathFileType\t4\t(X/Y/Z)\t{path.name}\n"
            "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
            f"{rate}\t{rate}\t{n_frames}\t{n_markers}\t{unit}\t{rate}\t1\t{n_frames}\n"
            "Frame#\tTime\t" + "\t\t\t".join(table.labels) + "\t\t\t\n"
            f"\t\t{axes}\n\n"
        )
        for i, points in enumerate(progress.over(table.points_m, f"Writing {path.name}")):
            cells = row % tuple((points / UNITS_M[unit]).ravel().tolist())
            stream.write(f"{i + 1}\t{begin_s + i / rate_hz:.6f}\t{cells.replace('nan', '')}\n")
