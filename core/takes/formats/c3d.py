"""C3D: the binary format of biomechanics (c3d.org), its 3D points.

Read here rather than with a library, so that a damaged file gives an error instead of a crash: every count is
checked against the bytes there are. Intel, DEC and MIPS files, integer and float points, long files. A point is a
gap where its residual is negative, and in files of our own where it is zero: predicted. What header and parameters say
of the frames is weighed in c3d_frames.py, which axis is up in c3d_up.py, which columns are markers in c3d_labels.py.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import FloatArray
from core.recording import Recording
from core.takes.formats.assemble import assemble, check_size
from core.takes.formats.axes import TO_Y_UP
from core.takes.formats.c3d_frames import (
    Count,
    Header,
    Layout,
    count_frames,
    find_layout,
    frame_rate,
    stated_counts,
    trial_fields,
)
from core.takes.formats.c3d_labels import computed_columns, labels, marker_columns, predicted
from core.takes.formats.c3d_parameters import BLOCK, Numbers, Parameters, read_parameters
from core.takes.formats.c3d_up import up_axis
from core.takes.formats.text import METRES
from core.untrusted.files import read_bytes

MAGIC = 0x50


MOST_BYTES = 1 << 31
"""Of a file, which is read whole: hours of every marker there is."""


def recognises(head: bytes) -> bool:
    """Whether a file starts like a C3D file."""
    return len(head) >= BLOCK and head[1] == MAGIC and head[0] >= 1 and b"\0" in head[:BLOCK]


def read(path: Path) -> Recording:
    """Its markers, where they were measured. Raises FormatError."""
    return _read(path, measured_only=True)[0]


def read_with_residuals(path: Path) -> tuple[Recording, FloatArray]:
    """With what Phalanx predicted and computed in files of our own, and the residual word of each point, (t, m)
    float64: negative missing, 0 calculated. Raises FormatError.
    """
    return _read(path, measured_only=False)


def _read(path: Path, measured_only: bool) -> tuple[Recording, FloatArray]:
    try:
        data = read_bytes(path, MOST_BYTES)
    except (OSError, MemoryError) as error:
        words = getattr(error, "strerror", None) or error
        raise FormatError(f"{path.name} cannot be read ({words}).", "Copy it to this machine and try again.") from error
    parameters, numbers = read_parameters(path.name, data)
    header = _header(data, numbers)
    scale = _scale(path.name, parameters, header)
    counts = stated_counts(parameters, header)
    layout, of_layout = find_layout(len(data), parameters, header, 4 if scale < 0.0 else 2, counts)
    _check_layout(path.name, layout, counts)
    n_frames, of_counts = count_frames(data, layout, counts)
    check_size(path.name, n_frames, layout.n_points)
    names = labels(parameters, layout.n_points)
    columns, of_columns = marker_columns(parameters, names)
    if measured_only:
        computed = computed_columns(parameters, names)
        columns = [i for i in columns if names[i] not in computed]
    points, residuals = _points(data, numbers, layout, n_frames, columns, scale)
    points[residuals < 0.0] = np.nan
    if measured_only:
        points[predicted(parameters, residuals)] = np.nan
    rate_hz, of_rate = frame_rate(parameters, header)
    up, of_up = up_axis(parameters)
    first_frame = _first_frame(parameters, header, n_frames)
    recording = assemble(
        path.name,
        rate_hz,
        points * _unit_m(path.name, parameters),
        [names[i] for i in columns],
        np.arange(first_frame, first_frame + n_frames, dtype=np.float64),
        display_name=path.stem,
        to_y_up=TO_Y_UP[up],
        warnings=[*parameters.warnings, *of_layout, *of_counts, *of_rate, *of_columns, *of_up],
    )
    # Frame 1 of what was recorded is at 0 s, and this may be a part of it.
    source_s = recording.times_s + (first_frame - 1) / recording.rate_hz
    return replace(recording, source_s=source_s), residuals


def _header(data: bytes, numbers: Numbers) -> Header:
    words = [int(word) for word in numbers.words(data[:BLOCK])]
    scale, rate = numbers.floats(data[12:16]), numbers.floats(data[20:24])
    return Header(words[1], words[2], words[3], words[4], words[8], words[9], float(scale[0]), float(rate[0]))


def _scale(name: str, parameters: Parameters, header: Header) -> float:
    """POINT:SCALE, else the header's: millimetres or so per step, negative where points are reals."""
    stated = parameters.number("POINT", "SCALE", header.scale)
    for scale in (stated, header.scale):
        if np.isfinite(scale) and scale != 0.0:
            return scale
    raise FormatError(f"{name}: POINT:SCALE is {stated:g}.", "The file is damaged; export it again.")


def _check_layout(name: str, layout: Layout, counts: list[Count]) -> None:
    if layout.n_points == 0:
        raise FormatError(f"{name} holds no 3D points.", "Export it with its markers.")
    if layout.start < BLOCK or layout.whole_frames == 0:
        promised = max(count.frames for count in counts)
        if promised == 0 and layout.n_bytes == 0:
            raise FormatError(f"{name} holds no frames, only a header.", "Export it again.")
        raise FormatError(
            f"{name} promises {promised} frames of {layout.frame_bytes} bytes from block "
            f"{layout.start // BLOCK + 1} on, but holds {layout.n_bytes} bytes there.",
            "The file is cut off or damaged; export it again.",
        )


def _points(
    data: bytes, numbers: Numbers, layout: Layout, n_frames: int, columns: list[int], scale: float
) -> tuple[FloatArray, FloatArray]:
    """Positions (t, m, 3) in the file's unit, and residuals (t, m), negative where invalid, of some columns."""
    block = memoryview(data)[layout.start : layout.start + n_frames * layout.frame_bytes]
    values = numbers.floats(block) if scale < 0.0 else numbers.integers(block)
    table = values.reshape(n_frames, -1)[:, : 4 * layout.n_points].reshape(n_frames, layout.n_points, 4)
    if len(columns) < layout.n_points:
        table = table[:, columns]
    with np.errstate(invalid="ignore"):  # a damaged file may hold any bits
        points, residuals = table[:, :, :3].astype(np.float64), table[:, :, 3].astype(np.float64)
    return (points if scale < 0.0 else points * scale), residuals


def _unit_m(name: str, parameters: Parameters) -> float:
    unit = parameters.text("POINT", "UNITS") or "mm"
    if unit.lower() not in METRES:
        raise FormatError(f"{name} gives lengths in {unit!r} (POINT:UNITS).", "Export it again in mm or m.")
    return METRES[unit.lower()]


def _first_frame(parameters: Parameters, header: Header, n_frames: int) -> int:
    """The first frame's number: the header's, or TRIAL's where it is of these frames, as it goes beyond 65,535."""
    first, last = trial_fields(parameters)
    if first is not None and last is not None and last - first + 1 == n_frames:
        return first
    return header.first_frame if header.last_frame else 1
