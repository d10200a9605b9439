"""The take under review: its frames, its solutions, its notes and marks. Knows no window."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
import time
import weakref
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from app.every_nth import MOST
from app.review.analysis import Analysis, analyse
from app.review.job import Report
from app.review.own_process import run
from app.review.take_streams import stream_rows
from core.cast import Cast, cast_of
from core.disk_error import remedy
from core.errors import CancelledError, ExportError, PhalanxError, TakeError
from core.frames import FloatArray, IntArray, MarkerFrame, TrackedFrame
from core.profile import Profile
from core.takes.drafts import SOLVED, Draft, draft_folder
from core.takes.drafts import clear_drafts as clear_import_drafts
from core.takes.export import Exported, ExportOptions, clear_drafts
from core.takes.export.naming import file_stem
from core.takes.holes import Holes
from core.takes.matching import match_solved
from core.takes.reader import Take, open_take
from core.takes.recover import recover
from core.takes.seal import COPY_SUFFIX, seal_take, update_info
from core.takes.take import EXTENSION, Mark, TakeCounts, TakeInfo


@dataclass(frozen=True, eq=False)
class Solved:
    """One solution of a take.

    again: the take, in a temporary folder of its own, that solving again has written; None for what was recorded.
    matched: (n,) int64, the solved frame of each raw one, -1 for none. took_s: how long solving again took [s].
    """

    title: str
    profiles: Profile | Cast
    matched: IntArray
    again: Take | None = None
    took_s: float = 0.0

    @property
    def cast(self) -> Cast:
        """The profiles it was solved with."""
        return cast_of(self.profiles)

    @property
    def profile(self) -> Profile:
        """That of the first performer."""
        return self.cast[0]

    def discard(self) -> None:
        """Closes and removes what solving again has written."""
        if self.again is not None:
            self.again.close()
            _discard(self.again.path)


class ReviewDocument:
    """One open take. Frames are read on the window's thread; jobs open the file for themselves.

    profile_error: why the profile recorded with the take cannot be used, "" if it can; `solved` is None then until
    the take is solved again with another. solutions: those to choose from, the recorded one first. streams: in words,
    () where there is but the one that was solved. n_beside: frames of the others. Raises FormatError and TakeError.
    """

    def __init__(self, path: Path, report: Report | None = None) -> None:
        """Reads the index of the file, all of a long one: for a job. Raises CancelledError if stopped."""
        self._take: Take | None = open_take(path, stopping(report, f"Opening {path.name}") if report else None)
        self.path = path
        self.info: TakeInfo = self._take.info
        self.marks: tuple[Mark, ...] = self._take.marks
        self.counts: TakeCounts | None = self._take.counts
        self.times_s: FloatArray = self._take.raw.times_s
        self.span_s: tuple[float, float] = self._take.span_s
        self.holes: Holes = self._take.holes
        self.length_s, self.verdict = self._take.duration_s, self._take.verdict
        self.streams = stream_rows(self._take)
        self.n_beside = sum(len(stream.frames) for stream in self._take.streams.values() if not stream.solved)
        self.recorded: Solved | None = None
        self.profile_error = ""
        try:
            matched = match_solved(self.times_s, self._take.solved.times_s)
            self.recorded = Solved("As recorded", self._take.profiles, matched)
        except PhalanxError as error:
            self.profile_error = str(error)
        self.solved: Solved | None = self.recorded
        self.solutions: list[Solved] = [self.recorded] if self.recorded is not None else []
        self.analysis: Analysis | None = None
        self._again: weakref.WeakSet[Solved] = weakref.WeakSet()
        self._saved: weakref.WeakKeyDictionary[Solved, Path] = weakref.WeakKeyDictionary()

    def own(self, solved: Solved) -> Solved:
        """A solution made of this take, with a title of its own. Its files go when nobody has it any more, and when
        the document is closed."""
        number = sum(1 for known in self.solutions if known.again is not None) + 1
        title = f"{solved.title} {number}" if number > 1 else solved.title
        worn = " and ".join(dict.fromkeys(profile.layout.name for profile in solved.cast))
        solved = replace(solved, title=f"{title}: {worn}")
        self._again.add(solved)
        return solved

    def saved(self, solved: Solved, path: Path) -> None:
        """A solution was saved as a take of its own."""
        self._saved[solved] = path

    def saved_as(self, solved: Solved) -> Path | None:
        """The take that a solution made again was saved as, None if it was not."""
        return self._saved.get(solved)

    @property
    def unsaved(self) -> list[Solved]:
        """The solutions to choose from that would be lost if the document were closed now."""
        return [solved for solved in self.solutions if solved.again is not None and solved not in self._saved]

    def path_of(self, solved: Solved) -> Path:
        """The take that holds a solution of this one."""
        return self.path if solved.again is None else solved.again.path

    @property
    def file_gone(self) -> bool:
        """Whether the file that is read is not at its path any more: removed, moved, or replaced by another."""
        if self._take is None:
            return False
        try:
            return not os.path.samestat(os.fstat(self._take.fileno()), self.path.stat())
        except OSError:
            return True

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
            solved = (self.solved.again or self.take).solved[j]
        return raw, solved

    def while_playing(self, i: int) -> int:
        """The frame that is shown when frame i is played over: where every n-th was solved, the last one that was, for
        hands that come and go flicker."""
        if self.solved is None or self.counts is None or not self.counts.left_out:
            return i
        first = max(i + 1 - MOST, 0)
        with_pose = np.flatnonzero(self.solved.matched[first : i + 1] >= 0)
        return first + int(with_pose[-1]) if len(with_pose) else i

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

    def close(self) -> None:
        """The end, also of the solutions that were not saved as a take."""
        self.release()
        for solved in list(self._again):
            solved.discard()
        self._again.clear()


def free_name(path: Path) -> Path:
    """`<take>_solved.mcap` beside a take, or the next name that is free."""
    target, number = path.with_name(f"{path.stem}_solved{EXTENSION}"), 1
    while target.exists():
        number += 1
        target = path.with_name(f"{path.stem}_solved{number}{EXTENSION}")
    return target


# For jobs: each opens the file for itself; those that would take long in this process run in one of their own.


def read_analysis(path: Path, solved: Solved, report: Report) -> Analysis | None:
    """Analyse the solution that the take at `path` holds. None if stopped."""
    with open_take(path) as take:
        known = take.account
        analysis = analyse(take.solved, solved.matched, solved.cast, report, take.holes, known.missing)
        return analysis and replace(analysis, left_out=known.left_out)


def solve_again(path: Path, profiles: Profile | Sequence[Profile], report: Report, live_labels: bool = False) -> Solved:
    """Solve every raw frame of a take anew, its points named from the whole take or as live. Raises TakeError,
    CancelledError."""
    cast, began_s = cast_of(profiles), time.monotonic()
    try:
        draft = Draft(SOLVED)
    except OSError as error:
        raise TakeError(
            f"There is no room for a solution in {tempfile.gettempdir()} ({error.strerror or error}).",
            "Free some space on its disk.",
        ) from error
    target = draft.path / path.name
    try:
        arguments = {
            "path": str(path), "target": str(target), "profiles": [profile.to_json() for profile in cast],
            "live_labels": live_labels,
        }  # fmt: skip
        run("solve", arguments, report)
        take = open_take(target, check=False)
    except BaseException:
        draft.close()
        raise
    weakref.finalize(take, draft.close)  # should nobody be left to show it to
    matched = match_solved(take.raw.times_s, take.solved.times_s)
    solved = Solved("Solved again", cast, matched, take, time.monotonic() - began_s)
    if report.stopped:
        solved.discard()
        raise CancelledError
    return solved


def _discard(path: Path) -> None:
    shutil.rmtree(path.parent, ignore_errors=True)


def save_info(path: Path, info: TakeInfo, marks: Sequence[Mark], report: Report | None = None) -> None:
    """Write notes, rating and marks into the take's file. Raises TakeError and leaves the file as it was."""
    update_info(path, info, marks, stopping(report, "Saving") if report else None)


def save_and_open(path: Path, info: TakeInfo, marks: Sequence[Mark], report: Report) -> Take:
    """As save_info; returns the take, open. Raises FormatError and TakeError."""
    save_info(path, info, marks, report)
    return open_take(path)


def save_solved(path: Path, target: Path, info: TakeInfo, marks: Sequence[Mark], report: Report) -> Path:
    """Write the take at `path` as a new one, with the words given. Raises TakeError; never overwrites."""
    arguments = {"path": str(path), "target": str(target), "name": info.name, **_plain(info, marks)}
    copy = target.with_name(target.name + COPY_SUFFIX)
    run("save", arguments, report, lambda pid: copy.unlink(missing_ok=True))
    return target


def _plain(info: TakeInfo, marks: Sequence[Mark]) -> dict[str, Any]:
    """What an operator says of a take, as another process is told it."""
    said = [(mark.time_s, mark.text) for mark in marks]
    return {"notes": info.notes, "rating": info.rating, "marks": said}


def export_part(
    path: Path, first: int, last: int, formats: Sequence[str], folder: Path, options: ExportOptions, report: Report,
    overwrite: bool = False, words: tuple[TakeInfo, Sequence[Mark]] | None = None,
) -> Exported:  # fmt: skip
    """Export raw frames `first` to `last`, both included, of a take. words: what is said of it now; None: as its file
    has it. Raises ExportError for what concerns all formats, and CancelledError."""
    arguments = {
        "path": str(path), "first": first, "last": last, "formats": list(formats), "folder": str(folder),
        "overwrite": overwrite, "options": asdict(options),
        "words": None if words is None else _plain(*words),
    }  # fmt: skip
    told = run("export", arguments, report, lambda pid: clear_drafts(folder, pid))
    return Exported(
        [Path(file) for file in told["files"]],
        {name: ExportError(what, action) for name, (what, action) in told["failed"].items()},
        list(told["notes"]),
        list(told["warnings"]),
        list(told["neutral"]),
        Path(told["record"]) if told["record"] else None,
    )


def import_recording(
    path: Path, folder: Path, cast: Cast, live_labels: bool, report: Report
) -> tuple[Path, dict[str, Any]]:
    """Solve a recording of another program into a new take of the folder, by the name of its file. Returns the take
    and what tasks.import_take told. Raises FormatError, TakeError and CancelledError; never overwrites."""
    wanted = free_path(folder, file_stem(path.stem))
    with contextlib.ExitStack() as stack:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            clear_import_drafts(folder)
            draft = stack.enter_context(draft_folder(folder)) / wanted.name
        except OSError as error:
            raise TakeError(
                f"Nothing can be written to the takes' folder {folder} ({error.strerror or error}).",
                "Choose another folder for takes in the recorder.",
            ) from error
        arguments = {
            "path": str(path), "target": str(draft), "profiles": [profile.to_json() for profile in cast],
            "live_labels": live_labels,
        }  # fmt: skip
        try:
            told: dict[str, Any] = run("import", arguments, report)
            if wanted.exists():  # since then
                wanted = free_path(folder, wanted.stem)
            draft.rename(wanted)
        except OSError as error:
            raise TakeError(f"Take {wanted} cannot be written ({error.strerror or error}).", remedy(error)) from error
    return wanted, told


def free_path(folder: Path, stem: str) -> Path:
    """`<stem>.mcap` in a folder, or the next name that is free."""
    target, number = folder / f"{stem}{EXTENSION}", 1
    while target.exists():
        number += 1
        target = folder / f"{stem}_{number}{EXTENSION}"
    return target


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
