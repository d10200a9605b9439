"""A take as a recording: its raw, unlabelled points by id."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from core.errors import FormatError
from core.frames import NO_ID, MarkerFrame
from core.gaps import Gaps
from core.recording import Recording
from core.takes.formats.assemble import assemble, check_size
from core.untrusted.files import open_file
from core.words import listed

MAGIC = b"\x89MCAP0\r\n"
EXTENSION = ".mcap"
TITLE = "take of Phalanx"


def is_take(path: Path) -> bool:
    """Whether a file is a take by how it begins, or should be one by its name. False where it cannot be read."""
    if path.suffix.lower() == EXTENSION:
        return True
    try:
        with open_file(path) as stream:
            return stream.read(len(MAGIC)) == MAGIC
    except OSError:
        return False


def gap_warnings(gaps: Gaps, points: int) -> tuple[str, ...]:
    """What there is to warn of in the raw points of a take. points: how many are.

    Points at 0 0 0 alone are nothing to warn of: so do systems send a marker that they do not see.
    """
    if not (gaps.far or gaps.absent):
        return ()
    return (f"{gaps.words} among its raw points, {100 * gaps.share(points):.1f} %: none of them is used.",)


def read(path: Path) -> Recording:
    """The whole take in memory. Raises FormatError or TakeError."""
    from core.takes.reader import open_take  # only here: the other formats do not need the take's machinery

    with open_take(path) as opened:
        if not opened.raw and any(not stream.solved for stream in opened.streams.values()):
            others = listed(list(opened.streams))
            raise FormatError(
                f"{path.name} holds no frames of markers that were to be solved, only of {others}.",
                "Choose a take in which an optical system was solved.",
            )
        return from_frames(opened.info.name or path.stem, opened.info.rate_hz, list(opened.raw))


def from_frames(name: str, rate_hz: float, frames: Sequence[MarkerFrame]) -> Recording:
    """The recording of a device's frames, timed by the mapped host clock. Raises FormatError."""
    most = max((len(frame.points_m) for frame in frames), default=0)
    check_size(name, len(frames), most)
    points = np.full((len(frames), most, 3), np.nan)
    ids = np.full((len(frames), most), NO_ID, dtype=np.int64)
    used = np.arange(most) < np.array([len(frame.points_m) for frame in frames], dtype=np.int64)[:, None]
    for i, frame in enumerate(frames):
        points[i, : len(frame.points_m)] = frame.points_m
        ids[i, : len(frame.points_m)] = frame.ids
    recording = assemble(
        name,
        rate_hz,
        points,
        (),
        np.array([frame.sequence for frame in frames], dtype=np.float64),
        np.array([frame.times.host_s for frame in frames]),
        ids,
        used=used,
    )
    device_s = np.array([frame.times.device_s for frame in frames], dtype=np.float64)
    return replace(recording, source_s=device_s if np.all(np.isfinite(device_s)) else None)
