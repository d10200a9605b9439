"""points.csv, the long form: unlabelled points as a device sends them, one per line.

    frame,time_s,id,x_m,y_m,z_m[,time_source_s]

Metres, Y up. Lines of one frame stand together, in the order of time; any number per frame. `id` is the device's,
-1 or empty for none. A frame without points is one line with only frame and time. A point that lacks a coordinate is
none, and one that has an id and no coordinates was not seen. `time_source_s` is when the device says that the frame
was, empty where it does not; files of earlier versions do not have it.
"""

from __future__ import annotations

from array import array
from collections import deque
from dataclasses import replace
from math import isnan, nan
from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import NO_ID
from core.recording import Recording
from core.takes.formats.assemble import assemble, check_size
from core.takes.formats.cut_off import Cut, last_number
from core.takes.formats.text import TextLines

HEADER = "frame,time_s,id,x_m,y_m,z_m"
N_COLUMNS = 6
WITH_SOURCE = f"{HEADER},time_source_s"
HEADERS = (HEADER, WITH_SOURCE)
MAX_INTEGER = 2**53


def read(path: Path) -> Recording:
    """Raises FormatError."""
    lines = TextLines(path)
    frame_numbers, times, sources, counts = array("d"), array("d"), array("d"), array("q")
    points, ids = array("d"), array("q")
    last = (nan, nan)
    start = ""
    halves = first_half = 0
    recent: deque[str] = deque(maxlen=16)
    rows = iter(lines)
    header = (next(rows, "")).replace(" ", "").strip().lower()
    columns = N_COLUMNS if header == HEADER else N_COLUMNS + 1
    for line in rows:
        if not line.strip():
            continue
        try:
            frame, time, number, *point, source_s = _row(lines, line, last, columns)
            cells = line.split(",")
            cut = Cut.NO if lines.complete else last_number(cells, recent, lacking=False, one_column=False)
            if cut is Cut.YES:
                raise lines.error("is cut off in its last number.")
            if cut is Cut.MAYBE:
                lines.warn_of_doubt(cells[-1])
            recent.append(cells[-1])
        except FormatError:
            if lines.complete or not counts:
                raise
            lines.warn("Its last line is cut off; the frame that it may belong to was left out.")
            if line.startswith(start) or start.startswith(line):
                n_points = counts.pop()
                del (
                    frame_numbers[-1:],
                    times[-1:],
                    sources[-1:],
                    points[len(points) - 3 * n_points :],
                    ids[len(ids) - n_points :],
                )
            break
        if (frame, time) != last:
            last = (frame, time)
            start = ",".join(line.split(",")[:2]) + ","
            frame_numbers.append(frame)
            times.append(time)
            sources.append(source_s)
            counts.append(0)
        lacking = sum(map(isnan, point))
        if lacking == 3 and isnan(number):
            continue  # a frame without points
        if 0 < lacking < 3:
            halves += 1
            first_half = first_half or lines.number
        points.extend(point)
        ids.append(NO_ID if isnan(number) else int(number))
        counts[-1] += 1
    most = max(counts, default=0)
    if halves == 1:
        lines.warn(f"1 point lacks a coordinate and is a gap: line {first_half}.")
    elif halves:
        lines.warn(f"{halves:,} points lack a coordinate and are gaps, the first in line {first_half}.")
    check_size(lines.name, len(counts), most)
    per_frame = np.frombuffer(counts, dtype=np.int64)
    filled = np.arange(most) < per_frame[:, None]
    dense = np.full((len(counts), most, 3), np.nan)
    dense_ids = np.full((len(counts), most), NO_ID, dtype=np.int64)
    dense[filled] = np.frombuffer(points, dtype=np.float64).reshape(-1, 3)
    dense_ids[filled] = np.frombuffer(ids, dtype=np.int64)
    recording = assemble(
        lines.name,
        nan,
        dense,
        (),
        np.frombuffer(frame_numbers, dtype=np.float64),
        np.frombuffer(times, dtype=np.float64),
        dense_ids,
        display_name=path.stem,
        used=filled,
        warnings=lines.warnings,
    )
    return replace(recording, source_s=np.frombuffer(sources, dtype=np.float64)) if columns > N_COLUMNS else recording


def _row(lines: TextLines, line: str, last: tuple[float, float], columns: int) -> tuple[float, ...]:
    """Frame, time, id, x, y, z and the source's time of one line after the frame and time `last`; NaN for what is left
    empty, or has no column."""
    cells = line.split(",")
    if len(cells) != columns:
        raise lines.error(
            f"has {len(cells)} columns instead of {columns}.",
            f"Each line must hold {HEADERS[columns - N_COLUMNS]}, with points in numbers and commas between them.",
        )
    frame, time, number, x, y, z, *source = lines.numbers(cells)
    if (frame, time) != last:
        if not time > last[1] and not isnan(last[1]):
            raise lines.error(f"column 2: time {time:g} s comes after {last[1]:g} s.", "Sort the lines by time.")
        if isnan(time) or not abs(frame) < MAX_INTEGER:
            raise lines.error(f"has frame {cells[0][:40]!r} and time {cells[1][:40]!r}.", "Each line needs both.")
    if not lines.complete and 0 < sum(map(isnan, (x, y, z))) < 3:
        raise lines.error(f"ends after {','.join(cells[3:N_COLUMNS])[:60]!r}.", "Give x, y and z, or none of them.")
    if not isnan(number) and (number != number // 1 or abs(number) >= MAX_INTEGER):
        raise lines.error(f"column 3: id {cells[2][:40]!r} is not an integer.")
    return frame, time, number, x, y, z, *(source or [nan])
