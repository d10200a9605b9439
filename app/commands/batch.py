"""Many files in one command: what is done before, in which order, and how to go on with what is left."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands.result_folders import placed, tell_places
from app.commands.terminal import say

if TYPE_CHECKING:
    from app.commands.job import Job
    from app.tracking_figures import TrackFigures
    from core.errors import PhalanxError

_NO_SETTINGS = {
    "files", "profile", "network", "out", "to", "take",
    "json", "overwrite", "resume", "run", "refuse", "words",
}  # fmt: skip
"""What changes no value of a result, and what is said of it apart: file, profiles, network, formats."""

_JUDGING = {"least"}
"""What changes no file, but what is said of it, and the exit status."""


@dataclass(frozen=True)
class Batch:
    """jobs: of all files, in order, each with its folder. before: what is done already, by the recording's path.
    replaced: when the record of each result was written that a new one is to replace [ns], by folder."""

    jobs: Sequence[Job]
    before: dict[Path, TrackFigures]
    replaced: dict[Path, int]

    def outcomes(
        self, solve: Callable[[Sequence[Job]], Generator[TrackFigures | PhalanxError]]
    ) -> Generator[TrackFigures | PhalanxError]:
        """What became of each job, in order; `solve` is given those that are to be done."""
        with closing(solve([job for job in self.jobs if job.path not in self.before])) as results:
            for job in self.jobs:
                yield self.before[job.path] if job.path in self.before else next(results)

    def say_what_is_left(self) -> None:
        """How many files have their results, and how to go on; nothing of a single file."""
        if len(self.jobs) < 2:
            return
        done = sum(_written_ns(job.folder) not in (None, self.replaced.get(job.folder)) for job in self.jobs)
        if done < len(self.jobs):
            say(
                f"phalanx: {done} of {len(self.jobs)} files have their results, the others not yet; the same command "
                "with --resume does those."
            )


def batch_of(jobs: Sequence[Job], resume: bool) -> Batch:
    """Chooses the folders, says where results go that do not go where they would be expected, and what is skipped."""
    found = placed(jobs, resume)
    tell_places([one for one in found if one.before is None])
    before = {one.job.path: one.before for one in found if one.before is not None}
    if resume:
        say(f"phalanx: {len(before)} of {len(found)} files are done already, {len(found) - len(before)} to do.")
    replaced = {
        one.job.folder: written_ns
        for one in found
        if one.job.overwrite and one.before is None and (written_ns := _written_ns(one.job.folder)) is not None
    }
    return Batch([one.job for one in found], before, replaced)


def _written_ns(folder: Path) -> int | None:
    """When the record of the results in a folder was written; None where there is none."""
    try:
        return (folder / "run.json").stat().st_mtime_ns
    except OSError:
        return None


def settings_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """Every option that can change a value of a result, by name."""
    return {name: value for name, value in vars(arguments).items() if name not in _NO_SETTINGS | _JUDGING}


def judged_by(arguments: argparse.Namespace) -> dict[str, Any]:
    """Every option that changes what is said of a result and none of its files, by name."""
    return {name: value for name, value in vars(arguments).items() if name in _JUDGING}


def command_for(arguments: argparse.Namespace, path: Path) -> tuple[str, ...]:
    """What was typed, with one file in place of all."""
    words, files = getattr(arguments, "words", ()), set(arguments.files)
    first = next((i for i, word in enumerate(words) if word in files), len(words))
    return (*words[:first], str(path), *(word for word in words[first:] if word not in files))
