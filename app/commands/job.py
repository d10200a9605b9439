"""What `phalanx track` is to do with one file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.least import LEAST_TRACKED

if TYPE_CHECKING:
    from app.run_record import Origin
    from core.takes.export import ExportOptions


@dataclass(frozen=True)
class Job:
    """One file: profiles as `--profile` takes them, one for each performer; () for a take's own.

    network: as `--network` takes it, None for the profiles' own. no_ids: points without ids, too. formats, options: of
    the export; None for the usual ones. take: a take is written too. settings, command, judged_by: for run.json, every
    option that can change a value of a result, what was typed, and the options that change what is said of a result.
    overwrite: results of other settings are replaced. origin: what the results come from, where that is known. least:
    see app.tracking_doubts.doubts.
    """

    path: Path
    profiles: tuple[str, ...]
    folder: Path
    unlabelled: bool
    live_labels: bool
    fill: bool
    network: str | None = None
    no_ids: bool = False
    formats: tuple[str, ...] = ("csv",)
    options: ExportOptions | None = None
    take: bool = False
    settings: Mapping[str, Any] = field(default_factory=dict)
    command: tuple[str, ...] = ()
    judged_by: Mapping[str, Any] = field(default_factory=dict)
    overwrite: bool = False
    origin: Origin | None = None
    least: float = LEAST_TRACKED
