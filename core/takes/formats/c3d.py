"""C3D: the binary format of biomechanics (c3d.org), its 3D points.

Read here rather than with a library, so that a damaged file gives an error instead of a crash: every count is
checked against the bytes there are. Intel, DEC and MIPS files, integer and float points, long files (TRIAL).
A point is a gap where its residual is negative. The up axis is POINT:Y_SCREEN's; without it
the axes are read as they stand.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import FloatArray
from core.recording import Recording
from core.takes.formats.assemble import assemble, check_size
from core.takes.formats.axes import from_screen
from core.takes.formats.c3d_parameters import BLOCK, Numbers, Parameters, read_parameters
from core.takes.formats.text import METRES

MAGIC = 0x50


def recognises(head: bytes) -> bool:
    """Whether a file starts like a C3D file."""
    return len(head) >= BLOCK and head[1] == MAGIC and head[0] >= 1 and b"\0" in head[:BLOCK]


def read(path: Path) -> Recording:
    """Raises FormatError."""
    return read_with_residuals(path)[0]


def read_with_residuals(path: Path) -> tuple[Recording, FloatArray]:
    """The recording, and the residual word of each point, (t, m) float64: negative missing, 0 calculated."""
    try:
        data = path.read_bytes()
    except (OSError, MemoryError) as error:
        raise FormatError(f"{path.name} cannot be read ({error}).", "Copy it to this machine and try again.") from error
    parameters, numbers = read_parameters(path.name, data)
    header = numbers.words(data[:BLOCK])
    scale = parameters.number("POINT", "SCALE", float(numbers.floats(data[12:16])[0]))
    points, residuals = _points(path.name, data, parameters, numbers, header, scale)
    points[residuals < 0.0] = np.nan
    unit = parameters.text("POINT", "UNITS") or "mm"
    if unit.lower() not in METRES:
        raise FormatError(f"{path.name} gives lengths in {unit!r} (POINT:UNITS).", "Export it again in mm or m.")
    first_frame = int(header[3])
    recording = assemble(
        path.name,
        parameters.number("POINT", "RATE", float(numbers.floats(data[20:24])[0])),
        points * METRES[unit.lower()],
        _labels(parameters, points.shape[1]),
        np.arange(first_frame, first_frame + len(points), dtype=np.float64),
        display_name=path.stem,
        to_y_up=from_screen(parameters.text("POINT", "X_SCREEN"), parameters.text("POINT", "Y_SCREEN")),
    )
    return recording, residuals


def _points(
    name: str, data: bytes, parameters: Parameters, numbers: Numbers, header: np.ndarray, scale: float
) -> tuple[FloatArray, FloatArray]:
    """Positions (t, m, 3) in the file's unit, and residuals (t, m), negative where invalid."""
    n_points, n_analog = int(header[1]), int(header[2])
    n_frames = _frame_count(parameters, header)
    start = (int(header[8]) or int(parameters.number("POINT", "DATA_START", 0.0))) - 1
    if n_points == 0:
        raise FormatError(f"{name} holds no 3D points.", "Export it with its markers.")
    if not np.isfinite(scale) or scale == 0.0:
        raise FormatError(f"{name}: POINT:SCALE is {scale:g}.", "The file is damaged; export it again.")
    item = 4 if scale < 0 else 2
    frame_bytes = (4 * n_points + n_analog) * item
    available = len(data) - max(start, 0) * BLOCK
    if start < 1 or n_frames < 0 or available < n_frames * frame_bytes:
        raise FormatError(
            f"{name} promises {n_frames} frames of {frame_bytes} bytes from block {start + 1} on, but holds "
            f"{max(available, 0)} bytes there.",
            "The file is cut off or damaged; export it again.",
        )
    check_size(name, n_frames, n_points)
    block = data[start * BLOCK : start * BLOCK + n_frames * frame_bytes]
    values = numbers.floats(block) if scale < 0 else numbers.integers(block)
    table = values.reshape(n_frames, 4 * n_points + n_analog)[:, : 4 * n_points].reshape(n_frames, n_points, 4)
    with np.errstate(invalid="ignore"):  # a damaged file may hold any bits
        points, residuals = table[:, :, :3].astype(np.float64), table[:, :, 3].astype(np.float64)
    return (points if scale < 0 else points * scale), residuals


def _frame_count(parameters: Parameters, header: np.ndarray) -> int:
    """Frames in the file; the header's own count ends at 65,535, longer files say it in TRIAL."""
    first = parameters.long("TRIAL", "ACTUAL_START_FIELD")
    last = parameters.long("TRIAL", "ACTUAL_END_FIELD")
    if first and last and last >= first:
        return last - first + 1
    return int(header[4]) - int(header[3]) + 1


def _labels(parameters: Parameters, n_points: int) -> list[str]:
    labels: list[str] = []
    for suffix in ("", *map(str, range(2, 2 + n_points // 255))):  # 255 names fit one parameter
        labels += parameters.texts("POINT", "LABELS" + suffix)
    labels = labels[:n_points]
    return labels + [f"point {i + 1}" for i in range(len(labels), n_points)]
