"""The take under review: its frames, its solutions, its notes and marks. Knows no window."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from app.review.analysis import Analysis, analyse, match_solved
from app.review.job import Report
from core.errors import CancelledError, PhalanxError, TakeError
from core.frames import FloatArray, IntArray, MarkerFrame, TrackedFrame
from core.profile import Profile
from core.takes.export import export
from core.takes.reader import Take, open_take
from core.takes.recover import recover
from core.takes.reprocess import solve
from core.takes.seal import seal_take, update_info
from core.takes.solution import Solution
from core.takes.take import EXTENSION, Mark, TakeCounts, TakeInfo
from core.takes.writer import TakeWriter


@dataclass(frozen=True)
class Solved:
    """One solution of a take.

    frames: solved frames, None for those in the take's own file. matched: (n,) int64, the solved frame of each raw
    one, -1 for none.
    """

    title: str
    profile: Profile
    frames: Sequence[TrackedFrame] | None
    matched: IntArray


@dataclass(frozen=True)
class ExportOptions:
    """replace: files of an earlier export may be overwritten. joints: C3D and TRC hold joint centres too."""

    replace: bool = False
    joints: bool = False


class ReviewDocument:
    """One open take. Frames are read on the window's thread; jobs open the file for themselves.

    profile_error: why the profile recorded with the take cannot be used, "" if it can; `solved` is None then until
    the take is solved again with another. Raises FormatError and TakeError.
    """

    def __init__(self, path: Path, report: Report | None = None) -> None:
        """Reads the index of the file, all of a long one: for a job. Raises CancelledError if stopped."""
        self._take: Take | None = open_take(path, stopping(report, f"Opening {path.name}") if report else None)
        self.path = path
        self.info: TakeInfo = self._take.info
        self.marks: tuple[Mark, ...] = self._take.marks
        self.counts: TakeCounts | None = self._take.counts
        self.times_s: FloatArray = self._take.raw.times_s
        self.recorded: Solved | None = None
        self.profile_error = ""
        try:
            matched = match_solved(self.times_s, self._take.solved.times_s)
            self.recorded = Solved("As recorded", self._take.profile, None, matched)
        except PhalanxError as error:
            self.profile_error = str(error)
        self.solved: Solved | None = self.recorded
        self.analysis: Analysis | None = None

    @property
    def n_frames(self) -> int:
        """Raw frames."""
        return len(self.times_s)

    @property
    def take(self) -> Take:
        """The open take. Raises TakeError while its file is being replaced."""
        if self._take is None:
            raise TakeError(f"Take {self.path} is being saved.", "Try again when that is done.")
        return self._take

    def frame(self, i: int) -> tuple[MarkerFrame, TrackedFrame | None]:
        """Raw frame i and its solution, if it has one. Raises FormatError and TakeError if the file is damaged."""
        raw, solved = self.take.raw[i], None
        j = -1 if self.solved is None else int(self.solved.matched[i])
        if self.solved is not None and j >= 0:
            solved = (self.take.solved if self.solved.frames is None else self.solved.frames)[j]
        return raw, solved

    def release(self) -> None:
        """Close the file, so that it can be replaced; `reopen` follows."""
        if self._take is not None:
            self._take.close()
            self._take = None

    def reopen(self, take: Take | None) -> None:
        """After `release`: read on from `take`, or open the file again. Raises FormatError and TakeError."""
        if self._take is None:
            self._take = take or open_take(self.path)
        elif take is not None:
            take.close()

    close = release


def free_name(path: Path) -> Path:
    """`<take>_solved.mcap` beside a take, or the next name that is free."""
    target, number = path.with_name(f"{path.stem}_solved{EXTENSION}"), 1
    while target.exists():
        number += 1
        target = path.with_name(f"{path.stem}_solved{number}{EXTENSION}")
    return target


# For jobs: each opens the file for itself.


def read_analysis(path: Path, solved: Solved, report: Report) -> Analysis | None:
    """Analyse a solution. None if stopped."""
    if solved.frames is not None:
        return analyse(solved.frames, solved.matched, solved.profile, report)
    with open_take(path) as take:
        return analyse(take.solved, solved.matched, solved.profile, report)


def solve_again(path: Path, profile: Profile, report: Report) -> Solved:
    """Solve every raw frame of a take anew. Raises TakeError, and Cancelled if stopped."""
    with open_take(path) as take:
        if not len(take.raw):
            raise TakeError(f"Take {path} holds no frames.", "There is nothing to solve.")
        frames = solve(take.raw, profile, report)
        times_s = take.raw.times_s
    return Solved("Solved again", profile, frames, match_solved(times_s, times_s))


def save_info(path: Path, info: TakeInfo, marks: Sequence[Mark], report: Report | None = None) -> None:
    """Write notes, rating and marks into the take's file. Raises TakeError and leaves the file as it was."""
    update_info(path, info, marks, stopping(report, "Saving") if report else None)


def save_and_open(path: Path, info: TakeInfo, marks: Sequence[Mark], report: Report) -> Take:
    """As save_info; returns the take, open. Raises FormatError and TakeError."""
    save_info(path, info, marks, report)
    return open_take(path)


def save_solved(
    path: Path, target: Path, solved: Solved, info: TakeInfo, marks: Sequence[Mark], report: Report
) -> Path:
    """Write the raw frames of a take and another solution of them as a new take. Raises TakeError; never overwrites."""
    with open_take(path) as take:
        frames = take.solved if solved.frames is None else solved.frames
        writer = TakeWriter(target, info, solved.profile)
        try:
            n_solved = 0
            for i in range(len(take.raw)):
                if i % 100 == 0 and not report(0.7 * i / len(take.raw), f"Writing frame {i} of {len(take.raw)}"):
                    raise CancelledError
                writer.raw(take.raw[i])
                if solved.matched[i] >= 0:
                    writer.solved(frames[int(solved.matched[i])])
                    n_solved += 1
            for mark in marks:
                writer.mark(mark)
            old = take.counts
            counts = TakeCounts(
                old.received if old else len(take.raw), len(take.raw), old.dropped if old else {},
                old.lost if old else 0, old.rejected if old else 0, n_solved,
            )  # fmt: skip
            writer.seal(counts, stopping(report, "Sealing"))
        except BaseException:
            writer.close()
            target.unlink(missing_ok=True)
            raise
    return target


def export_part(
    path: Path, solved: Solved, first: int, last: int, formats: Sequence[str], folder: Path, options: ExportOptions,
    report: Report,
) -> list[Path]:  # fmt: skip
    """Export raw frames `first` to `last`, both included, with a solution. Raises ExportError, CancelledError."""
    with open_take(path) as take:
        frames = take.solved if solved.frames is None else solved.frames
        used = solved.matched[first : last + 1]
        used = used[used >= 0]
        part = frames[int(used.min()) : int(used.max()) + 1] if len(used) else frames[:0]
        name = take.info.name or path.stem
        solution = Solution(name, solved.profile, take.info.rate_hz, take.raw[first : last + 1], part)
        return export(solution, formats, folder, report, options.replace, options.joints)


def rescue(path: Path, report: Report) -> Path:
    """Seal a take whose recording was cut short; write one that is damaged anew, beside it. Raises TakeError."""
    with open_take(path) as take:
        whole = take.complete
    if whole:
        seal_take(path, None, stopping(report, "Sealing"))
        return path
    return recover(path, stopping(report, "Recovering")).path or path


def stopping(report: Report, text: str) -> Callable[[float], None]:
    """`report` for work that tells only its share and stops by an exception."""

    def tell(share: float) -> None:
        if not report(share, text):
            raise CancelledError

    return tell
