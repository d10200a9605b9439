"""A recording of another program as a take: its points as raw frames, with what the engine makes of them."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from core.cast import Cast, performer_names
from core.recording import Recording
from core.takes.take import TakeInfo

FILE_KIND = "file"
"""What a take says of its device that came from a file of another program."""


def info_of(path: Path, recording: Recording, cast: Cast, name: str = "") -> TakeInfo:
    """What can be said of it. Recorded: when the file says, or else when it was last changed, the nearest that every
    file tells. What its reader found amiss is kept with what the device says of itself."""
    created = datetime.now(UTC)
    if recording.recorded is not None:
        created = recording.recorded.astimezone(UTC)
    else:
        with contextlib.suppress(OSError, OverflowError, ValueError):
            created = datetime.fromtimestamp(path.stat().st_mtime, UTC)
    device = {"kind": FILE_KIND, "title": path.name}
    if recording.warnings:
        device["warnings"] = " ".join(recording.warnings)
    return TakeInfo(
        name=name or path.stem,
        performer=", ".join(filter(None, performers_of(cast))),
        created_utc=created,
        rate_hz=recording.rate_hz,
        device=device,
    )


def performers_of(cast: Cast) -> Sequence[str]:
    """The performers by name, as far as they have one."""
    return performer_names(cast) if len(cast) > 1 else (cast[0].performer,)
