"""The end of a take: it is sealed with what can be read of it, or it is said why not."""

from __future__ import annotations

from collections.abc import Callable

from app.take_summary import not_sealed
from app.take_tally import TakeTally
from core.errors import PhalanxError, TakeError
from core.takes.verdict import Finding
from core.takes.writer import TakeWriter


def seal(writer: TakeWriter, tally: TakeTally, progress: Callable[[float], None]) -> None:
    """Raises PhalanxError. What another program has cut off is counted first, also where it does so meanwhile."""
    try:
        _seal_what_is_left(writer, tally, progress)
    except PhalanxError:
        if not writer.safety.find_out():
            raise
        _seal_what_is_left(writer, tally, progress)


def _seal_what_is_left(writer: TakeWriter, tally: TakeTally, progress: Callable[[float], None]) -> None:
    if writer.safety.find_out():
        tally.only(writer.readable())
    writer.seal(tally.counts(), progress)


def why_not_sealed(error: Exception, writer: TakeWriter, tally: TakeTally) -> Finding:
    """Why, and what is there all the same: only what can be read is called written from now on."""
    lost = tally.only(writer.readable())
    try:
        writer.close()
    except TakeError as late:
        error = late  # a disk that says only now that it has not taken all of it
    return not_sealed(error, tally.written, lost)
