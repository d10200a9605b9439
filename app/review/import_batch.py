"""Recordings that are imported one after the other, what became of each, and how that is said."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from core.cast import Cast
from core.errors import FormatError

_SHOWN = 5


@dataclass(frozen=True)
class Wanted:
    """One recording that is to be imported: into which folder, with whose profiles, its points named as live."""

    path: Path
    folder: Path
    cast: Cast
    live_labels: bool


@dataclass
class Batch:
    """More may be added while it is worked off, in another thread: lists only grow.

    made: the takes, in order. failed: why a recording is none. doubtful: what there is to say of one that is, in
    sentences; both with the recording. at: how many are done. share: of the one in work, 0..1.
    """

    wanted: list[Wanted] = field(default_factory=list)
    made: list[Path] = field(default_factory=list)
    failed: list[tuple[Path, Exception]] = field(default_factory=list)
    doubtful: list[tuple[Path, Sequence[str]]] = field(default_factory=list)
    at: int = 0
    share: float = 0.0

    @property
    def well(self) -> bool:
        """Whether there is nothing to look into."""
        return not self.failed and not self.doubtful

    @property
    def words(self) -> str:
        """How far it is: 'Importing 2 of 8: 45 %'."""
        of = f" {min(self.at + 1, len(self.wanted))} of {len(self.wanted)}" if len(self.wanted) > 1 else ""
        return f"Importing{of}: {100 * self.share:.0f} %"

    def summary(self, cancelled: bool = False) -> str:
        """What became of all, in a sentence or two."""
        n, several = len(self.made), len(self.wanted) > 1
        if cancelled:
            of = f"{n} of {len(self.wanted)} were imported" if several else "nothing was imported"
            parts = [f"Import cancelled; {of}"]
        elif several or (n and self.well):
            parts = [f"{n} imported"] if several else [f"{self.made[0].name} is ready"]
        else:
            parts = []
        if self.failed:
            done = "read" if all(isinstance(error, FormatError) for _, error in self.failed) else "imported"
            names = _some(path.name for path, _ in self.failed)
            parts.append(f"{len(self.failed)} could not be {done}: {names}" if several else f"{names} was not imported")
        text = ", ".join(parts) + "." if parts else ""
        if self.doubtful:
            names = _some(path.name for path, _ in self.doubtful)
            text = f"{text} There is something to look at in {names}.".strip()
        return text

    @property
    def reasons(self) -> str:
        """Why and what, a line for each recording of which there is something to say."""
        lines = [f"{error}" if path.name in str(error) else f"{path.name}: {error}" for path, error in self.failed]
        lines += [f"{path.name}: {' '.join(said)}" for path, said in self.doubtful]
        return "\n".join(lines)


def _some(names: Iterable[str]) -> str:
    each = list(names)
    shown = ", ".join(each[:_SHOWN])
    return shown if len(each) <= _SHOWN else f"{shown} and {len(each) - _SHOWN} more"
