"""One file solved, its results with their `run.json`, and all of it in its place at once or nothing of it."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands.result_folders import differences, holds_results, origin_of_job
from core.disk_error import remedy, why
from core.errors import ExportError, TakeError

if TYPE_CHECKING:
    from app.commands.job import Job
    from app.tracking_figures import TrackFigures

    Solve = Callable[[Job, Callable[[float, str], bool | None]], TrackFigures]


def solve_and_place(job: Job, progress: Callable[[float, str], bool | None]) -> TrackFigures:
    """`solve_file` into a folder that is this process's own, with `run.json` beside the results; then to job.folder.

    Raises FormatError, TakeError, ExportError, and CancelledError if `progress` says so.
    """
    from app.commands.solving import solve_file
    from app.run_record import read_record, record_of, write_record
    from core.takes.drafts import draft_folder

    started = time.perf_counter()
    origin, folder = origin_of_job(job), job.folder
    take = folder / f"{job.path.stem}.mcap"
    if job.take and take.exists():
        raise TakeError(f"Take {take} exists already.", "Takes are never overwritten: choose another folder.")
    there = read_record(folder)
    same = there if there is not None and not differences(there, origin) else None
    if same is None and not job.overwrite and holds_results(folder):  # since its folder was chosen
        raise ExportError(
            f"{folder} holds results of something else by now.",
            "Do this file again, alone: its results then go to a folder of their own.",
        )
    formats = tuple(dict.fromkeys([*_formats_in(same), *job.formats]))
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with draft_folder(folder.parent) as drafts:
            draft = drafts / folder.name
            draft.mkdir()
            found = _named_for(folder, solve_file, replace(job, folder=draft, formats=formats, origin=origin), progress)
            if found.files:
                kept = _kept(same, folder, {path.name for path in draft.iterdir()})
                seconds = time.perf_counter() - started
                write_record(record_of(origin, formats, found, draft, job.command, job.judged_by, seconds, kept), draft)
                if read_record(folder) != there:
                    raise ExportError(f"Another Phalanx wrote to {folder} meanwhile.", "Do this file again.")
                _move(draft, folder, None if same is not None else there)
    except OSError as error:
        raise ExportError(
            f"The results in {folder} cannot be written ({why(folder.parent, error)}).",
            f"{remedy(error)} --out names the folder.",
        ) from error
    finally:
        with suppress(OSError):
            folder.parent.rmdir()  # nothing came into it
    return found


def _named_for(folder: Path, solve: Solve, job: Job, progress: Callable[[float, str], bool | None]) -> TrackFigures:
    """Solves, and says of the files what is true of them once they have moved to `folder`."""
    draft = str(job.folder)
    try:
        found = solve(job, progress)
    except ExportError as error:
        raise ExportError(error.what.replace(draft, str(folder)), error.action) from error
    failed = {name: text.replace(draft, str(folder)) for name, text in found.failed.items()}
    return replace(found, files=tuple(folder / path.name for path in found.files), failed=failed)


def _formats_in(record: Mapping[str, Any] | None) -> list[str]:
    """Those that a result of the very same has already: they are written anew with those asked for, so that the folder
    has them all from one run."""
    from core.takes.export import FORMATS

    names = record.get("formats") if record is not None else None
    return [name for name in names if name in FORMATS] if isinstance(names, list) else []


def _kept(record: Mapping[str, Any] | None, folder: Path, new: Collection[str]) -> list[dict[str, str]]:
    """What a record says of files that are there and that no new ones replace."""
    return [entry for entry in _entries(record) if entry["file"] not in new and (folder / entry["file"]).is_file()]


def _entries(record: Mapping[str, Any] | None) -> list[dict[str, str]]:
    """What a record says of its files; nothing of paths that lead elsewhere."""
    entries = record.get("files") if record is not None else None
    if not isinstance(entries, list):
        return []
    return [
        entry
        for entry in entries
        if isinstance(entry, dict) and isinstance(name := entry.get("file"), str) and name == Path(name).name
    ]


def _move(draft: Path, folder: Path, replaced: Mapping[str, Any] | None) -> None:
    """replaced: the record of another result that is to go. Raises OSError."""
    if not folder.exists():
        draft.rename(folder)  # in one step
        return
    run = "run.json"
    if replaced is not None:
        (folder / run).unlink(missing_ok=True)  # it speaks of files that go
        for entry in _entries(replaced):
            if Path(entry["file"]).suffix != ".mcap":
                (folder / entry["file"]).unlink(missing_ok=True)
    for path in sorted(draft.iterdir(), key=lambda path: path.name == run):  # run.json last: it says that all are there
        os.replace(path, folder / path.name)  # noqa: PTH105 - says that it replaces
