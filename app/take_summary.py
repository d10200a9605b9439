"""A take in figures: while it is written, while it is finished, and when it has ended."""

from __future__ import annotations

import errno
import logging
from dataclasses import dataclass, field
from pathlib import Path

from app.stream_figures import OfStreams, StreamFigures
from core.errors import PhalanxError, TakeError
from core.frames import stood_still
from core.level import Level
from core.takes.holes import NO_HOLES
from core.takes.place import DisplacedError
from core.takes.safekeeping import Notice
from core.takes.take import TakeCounts
from core.takes.verdict import Account, Finding, Verdict, verdict_of

LOG = logging.getLogger("phalanx")


@dataclass(frozen=True)
class RecordingNumbers(OfStreams):
    """A take while it is written. seconds_left: what the disk still holds at the present rate, infinite if unknown.

    stalled_s: since the disk was given what it has not taken yet [s]. trouble: what is wrong with the file or its disk
    now, in a few words; level: how bad that is.
    """

    name: str
    path: Path
    elapsed_s: float
    solved: int
    bytes_written: int
    bytes_per_s: float
    disk_free: int
    seconds_left: float
    queue_depth: int
    marks: int
    stalled_s: float = 0.0
    trouble: str = ""
    level: Level = Level.GOOD


@dataclass(frozen=True)
class SealingNumbers:
    """A take that is being finished. part: 0 to 1. stalled_s: since the disk has not answered [s]. written: frames
    of all streams that the operating system has, of those received. solving: its frames are being solved first."""

    name: str
    part: float
    stalled_s: float = 0.0
    received: int = 0
    written: int = 0
    solving: bool = False

    @property
    def doing(self) -> str:
        """What is being done with it."""
        return "Solving" if self.solving else "Finishing"

    @property
    def on_disk(self) -> str:
        """What there is of the take if it is left now: the same words wherever that can be done."""
        return f"{self.written:,} of its {self.received:,} frames are on the disk and can be recovered"


@dataclass(frozen=True)
class TakeSummary(OfStreams):
    """What became of a take. unsolved: frames on disk without a pose, by reason.

    duration_s: from the start of the recording to its end. tracked: as in TakeCounts. bytes: 0 where no file is left.
    sealed: the file is complete and indexed. problem: why the recording failed, "" if it did not. befallen: what became
    of the file besides: not sealed, moved, rescued, ended before the operator did. looked_back: it was saved after it
    had happened.
    """

    name: str
    path: Path
    duration_s: float
    solved: int
    unsolved: dict[str, int] = field(default_factory=dict)
    marks: int = 0
    bytes: int = 0
    sealed: bool = False
    problem: str = ""
    tracked: dict[str, int] = field(default_factory=dict)
    befallen: tuple[Finding, ...] = ()
    looked_back: bool = False

    @property
    def _counts(self) -> TakeCounts:
        """Of the stream that is solved, with its poses."""
        main = self.main if self.solving is not None else StreamFigures(0, 0)
        return TakeCounts(
            main.received, main.written, main.dropped, main.lost, main.rejected, self.solved, self.unsolved,
            self.tracked, standstills=main.standstills, untimed=main.untimed,
        )  # fmt: skip

    @property
    def verdict(self) -> Verdict:
        """What is to be thought of it: the same as of its file."""
        counts, holes = self._counts, self.holes if self.solving is not None else NO_HOLES
        return verdict_of(
            Account(
                counts.written, self.solved, counts, holes, self.duration_s, self.sealed, problem=self.problem,
                befallen=self.befallen, untimed=counts.untimed, solves=self.solving is not None,
                beside={key: self._account_of(one) for key, one in self.beside.items()},
            )
        )  # fmt: skip

    def _account_of(self, one: StreamFigures) -> Account:
        """Of a stream that was not to be solved: no pose of it is missing."""
        counts = TakeCounts(one.received, one.written, one.dropped, one.lost, one.rejected, standstills=one.standstills)
        return Account(one.written, one.written, counts, one.holes, self.duration_s, self.sealed, untimed=one.untimed)

    @property
    def line(self) -> str:
        """The figures in one line for people."""
        parts = []
        if self.solving is not None:
            parts += [*_parts(self.main), f"solved {self.solved:,}"]
            parts += [f"not solved, {reason}: {n:,}" for reason, n in self._counts.poseless.items()]
        for key, one in self.beside.items():
            first, *rest = _parts(one)
            parts += [f"{key}: {first[0].lower()}{first[1:]}", *rest]
        return "; ".join(parts)


def _parts(of: StreamFigures) -> list[str]:
    """What became of the frames of a stream, in few words each."""
    parts = [of.words]
    parts += [f"{reason}: {n:,}" for reason, n in of.dropped.items()]
    unread, own, silences = of.unread, of.holes.standing, of.holes.silences
    if unread or len(own):
        parts.append(f"{stood_still(of.standstills)}: {f'{unread:,} lost' if unread else own.words}")
    elif of.standstills:
        parts.append(f"{stood_still(of.standstills)}: nothing lost by that")
    if len(silences):
        parts.append(silences.words)
    if lost := of.lost - unread:
        late = f" ({of.late:,} of them came too late)" if of.late else ""
        parts.append(f"lost before this machine: {lost:,}{late}")
    if of.repeated:
        parts.append(f"came twice: {of.repeated:,}")
    if of.rejected:
        parts.append(f"unreadable packets: {of.rejected:,}")
    if of.untimed:
        parts.append(f"of unknown time: {of.untimed:,}")
    if of.clock_dropped:
        parts.append(f"clock samples dropped: {of.clock_dropped:,}")
    return parts


def is_of_disk(error: Exception) -> bool:
    """Whether it is the disk that did not take a record, and not the record that cannot be written."""
    return isinstance(error, OSError) or isinstance(error.__cause__, OSError)


def unwritable(error: Exception, source: str, name: str) -> Notice:
    """Of a record that no take can hold. source: who sent it. name: of the take."""
    why = error.what if isinstance(error, PhalanxError) else str(error) or type(error).__name__
    if not isinstance(error, PhalanxError):
        LOG.error("Take %s: a record of %s", name, source, exc_info=error)
    what = f"A record of {source} cannot be written to take {name}: {why.rstrip('.')}."
    return Notice(Level.PROBLEM, what, "It is left out, and so is every one like it. Please report it.")


def not_written(error: Exception, name: str, path: Path, written: int) -> PhalanxError:
    """Why a take can be recorded no longer. written: frames that were."""
    if isinstance(error, PhalanxError):
        return error
    why = getattr(error, "strerror", None) or str(error) or type(error).__name__
    kept = f"What was written up to now is kept in {path}." if written else "Nothing was written."
    fault = TakeError(f"Take {name} can no longer be written ({why}).", f"{kept} Check the disk, then record again.")
    fault.__cause__ = error
    return fault


def not_sealed(error: Exception, readable: int, lost: int) -> Finding:
    """What befell a take that could not be sealed. readable, lost: of the frames that were written."""
    why = (error.what if isinstance(error, PhalanxError) else str(error) or type(error).__name__).rstrip(".")
    kept = f"{readable:,} frames can be read, {lost:,} are lost" if lost > 0 else "Every frame written can be read"
    if not readable:  # what to do about that is said beside it
        kept, action = f"{lost:,} frames are lost" if lost > 0 else "No frame of it can be read", ""
    elif isinstance(error, DisplacedError):
        action = error.action
    elif _no_room(error):
        action = "Recover seals it once there is room."
    else:
        action = "Check its disk; Recover makes a whole take of what can be read."
    return Finding(Level.PROBLEM, "not sealed", f"It could not be sealed ({why}). {kept}. {action}".rstrip())


def _no_room(error: BaseException) -> bool:
    cause = error.__cause__ if isinstance(error, PhalanxError) else error
    return isinstance(cause, OSError) and cause.errno in (errno.ENOSPC, errno.EDQUOT)


def not_finished(path: Path, stalled_s: float, written: int, waiting: int) -> Finding:
    """What befell a take that was not waited for. stalled_s: for how long its disk had not answered, 0 if it did.
    waiting: frames that were not written yet."""
    why = f"The disk had not answered for {stalled_s:.0f} s" if stalled_s else "It was not waited for"
    rest = f"the last {waiting:,} are not" if waiting > 0 else "all that came"
    text = f"{why}, and the take was not finished: {written:,} frames are in {path}, {rest}."
    once = " once the disk answers" if stalled_s else ""
    return Finding(Level.PROBLEM, "not finished", f"{text} Recover seals what is there{once}.")
