"""Where the results of a batch go: DIR/NAME, or where that holds results of something else (another recording,
profile, network, version or option) the first of DIR/NAME-2, DIR/NAME-3, ... that does not.

`run.json` says of each folder what it holds (app.run_record).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands.terminal import Progress, say
from core.errors import FormatError, PhalanxError

if TYPE_CHECKING:
    from app.commands.job import Job
    from app.run_record import Origin
    from app.tracking_figures import TrackFigures

_MOST_FOLDERS = 1000  # of one name


@dataclass(frozen=True)
class Placed:
    """A job with the folder of its results. before: the figures of a result that is there already and is to be skipped.
    instead: why they do not go to DIR/NAME, "" where they do."""

    job: Job
    before: TrackFigures | None = None
    instead: str = ""


def placed(jobs: Sequence[Job], resume: bool) -> list[Placed]:
    """A folder for each job, with what killed runs left in DIR cleared away. The folders of the jobs are DIR/NAME."""
    from core.takes.drafts import clear_drafts

    for out in dict.fromkeys(job.folder.parent for job in jobs):
        if out.is_dir():
            clear_drafts(out)
    taken = {job.folder: job.path for job in jobs}
    found = []
    line = Progress("Looking at earlier results")
    for i, job in enumerate(jobs):
        line(i / len(jobs))
        one = _placed(job, resume, taken)
        taken[one.job.folder] = job.path
        found.append(one)
    line.done()
    return found


def tell_places(found: Sequence[Placed]) -> None:
    """Says, once for all that have the same reason, which results go elsewhere."""
    reasons: dict[tuple[str, str], list[Placed]] = {}
    for one in found:
        if one.instead:
            suffix = one.job.folder.name.removeprefix(one.job.path.stem)
            reasons.setdefault((one.instead, suffix), []).append(one)
    for (reason, suffix), those in reasons.items():
        first = those[0].job
        folder = first.folder.with_name(first.path.stem)
        if len(those) == 1:
            say(
                f"phalanx: {folder} holds {reason}: {first.path.name} goes to {first.folder} (--overwrite replaces it)."
            )
        else:
            out = folder.parent
            say(
                f"phalanx: {len(those)} folders in {out} hold {reason}: these results go to {out / f'NAME{suffix}'} "
                "(--overwrite replaces them)."
            )


def _placed(job: Job, resume: bool, taken: Mapping[Path, Path]) -> Placed:
    from app.run_record import figures_in, is_whole

    try:
        folder, record, instead = _folder(job, taken)
    except (PhalanxError, OSError):
        return Placed(job)  # what is wrong with the file is said when it is its turn
    before = None
    if resume and record is not None:
        take = f"{job.path.stem}.mcap" if job.take else ""
        if is_whole(record, folder, job.formats, take, job.judged_by):
            before = figures_in(record, job.path, folder)
    return Placed(replace(job, folder=folder), before, instead)


def _folder(job: Job, taken: Mapping[Path, Path]) -> tuple[Path, Mapping[str, Any] | None, str]:
    """The folder of a job; the record of a result of the very same that is there; why it is not the first one."""
    first = job.folder
    if not holds_results(first) and not any(_numbered(first)):
        return first, None, ""
    origin = origin_of_job(job)
    if job.overwrite:
        record = _record(first)
        return first, record if record is not None and not differences(record, origin) else None, ""
    found = [(folder, _record(folder)) for folder in (first, *_numbered(first))]
    for folder, record in found:
        if record is not None and not differences(record, origin) and taken.get(folder, job.path) == job.path:
            return folder, record, _reason(found[0][1], origin) if folder != first else ""
    for k in range(1, _MOST_FOLDERS):
        folder = first if k == 1 else first.with_name(f"{first.name}-{k}")
        if not holds_results(folder) and taken.get(folder, job.path) == job.path:
            return folder, None, _reason(found[0][1], origin) if folder != first else ""
    raise FormatError(f"{first} and {_MOST_FOLDERS - 2} more hold other results.", "Choose another folder with --out.")


def holds_results(folder: Path) -> bool:
    """Of `phalanx track` or `export`, of any version: every export leaves a record."""
    from core.takes.export.record import RECORD

    return (folder / "run.json").exists() or any(folder.glob(f"*{RECORD}"))


def _numbered(first: Path) -> list[Path]:
    """DIR/NAME-2, ... that are there, by number."""
    numbers = {
        int(number): folder
        for folder in first.parent.glob(f"{escape(first.name)}-*")
        if (number := folder.name.removeprefix(f"{first.name}-")).isdecimal() and folder.is_dir()
    }
    return [folder for _, folder in sorted(numbers.items())]


def _record(folder: Path) -> Mapping[str, Any] | None:
    from app.run_record import read_record

    try:
        return read_record(folder)
    except FormatError:
        return None


def differences(record: Mapping[str, Any], origin: Origin) -> tuple[str, ...]:
    """Which of what decides a result differ from those of a record: keys of app.run_record.DECIDING."""
    return tuple(name for name, value in origin.deciding.items() if record.get(name) != value)


def _reason(record: Mapping[str, Any] | None, origin: Origin) -> str:
    """What a folder holds that is not the result of `origin`, in words."""
    if record is None:
        return "results that do not say what they came from"
    differing = differences(record, origin)
    if "input" in differing:
        return "results of another recording of this name"
    words = []
    if "profiles" in differing:
        words.append("another profile or network")
    if "program_version" in differing:
        words.append(f"Phalanx {record.get('program_version')}")
    if "settings" in differing:
        before, now = record.get("settings"), origin.deciding["settings"]
        if isinstance(before, Mapping):
            names = [name for name in {**before, **now} if before.get(name) != now.get(name)]
            words.append(
                "other settings ("
                + ", ".join(f"{name} {before.get(name)}, now {now.get(name)}" for name in names)
                + ")"
            )
        else:
            words.append("other settings")
    return "results of " + " and ".join(words)


def origin_of_job(job: Job) -> Origin:
    """Raises FormatError and TakeError."""
    from app.run_origin import origin_of

    return origin_of(job.path, job.profiles, job.network, job.settings)
