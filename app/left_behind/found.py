"""All that earlier runs left behind, as the window and the doctor tell of it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from app.left_behind.cut_takes import CutTake, cut_takes
from app.left_behind.leftovers import Leftover, leftovers
from app.left_behind.run_file import EndedRun, ended_runs, recorded_now, settle


@dataclass(frozen=True)
class Found:
    """faults: processes that a fault ended. takes: those that were cut off. files: what nobody needs. displays:
    processes whose display went away while they recorded."""

    faults: tuple[EndedRun, ...] = ()
    takes: tuple[CutTake, ...] = ()
    files: tuple[Leftover, ...] = ()
    displays: tuple[EndedRun, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.faults or self.takes or self.files or self.displays)

    @property
    def words(self) -> str:
        """In one sentence; "" for nothing."""
        parts = []
        if self.faults:
            parts.append(
                "a fault ended Phalanx" if len(self.faults) == 1 else f"{len(self.faults)} runs ended by a fault"
            )
        parts += [display_words(run) for run in self.displays]
        if self.takes:
            parts.append("a take was cut off" if len(self.takes) == 1 else f"{len(self.takes)} takes were cut off")
        if self.files:
            size = size_words(sum(file.bytes for file in self.files))
            parts.append(f"{_count(len(self.files), 'file')} that nobody needs {_are(len(self.files))} left ({size})")
        text = "; ".join(parts)
        return f"{text[:1].upper()}{text[1:]}." if text else ""


def look(takes: Path, kept: Collection[str] = ()) -> Found:
    """Reads what is on disk. takes: their folder. kept: paths that are to be left as they are, without a word."""
    runs = ended_runs()
    told = [take for run in runs for take in run.takes]
    cut = [take for take in cut_takes(takes, told, recorded_now()) if str(take.path) not in kept]
    faults, displays = [], []
    for run in runs:
        left = any(take.path in run.takes for take in cut)
        if run.fault:
            faults.append(run)
        elif run.display_gone is not None and (run.finished or left):
            displays.append(run)
        elif not left:
            settle(run)
    files = [file for file in leftovers(takes) if str(file.path) not in kept]
    return Found(tuple(faults), tuple(cut), tuple(files), tuple(displays))


def display_words(run: EndedRun) -> str:
    """Of a run whose display went away: what became of its takes, begun in the middle of a sentence."""
    names = " and ".join(take.stem for take in run.finished)
    became = f"take {names} was finished first" if names else "its take could not be finished"
    return f"the display went away, and Phalanx ended with it; {became}"


def size_words(n: int) -> str:
    """Bytes for people."""
    for unit, size in (("GB", 10**9), ("MB", 10**6), ("kB", 10**3)):
        if n >= size:
            return f"{n / size:.1f} {unit}"
    return f"{n} bytes"


def _count(n: int, what: str) -> str:
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def _are(n: int) -> str:
    return "is" if n == 1 else "are"
