"""What a fault is, and what came of trying it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path


class NotHere(Exception):  # noqa: N818, it is no error
    """This machine cannot try it; the reason in words."""


@dataclass
class Outcome:
    """tried, survived: how often. lost: frames, in words. said: what the operator was told, in the program's words.
    broken: of each try that was not survived, what was wrong."""

    tried: int = 0
    survived: int = 0
    lost: str = "nothing"
    said: str = ""
    broken: list[str] = field(default_factory=list)

    def count(self, wrong: str | None) -> None:
        """One more try. wrong: what was wrong with it, None or "" if nothing."""
        self.tried += 1
        if wrong:
            self.broken.append(wrong)
        else:
            self.survived += 1


@dataclass(frozen=True)
class Fault:
    """One row of the table.

    name: for the command line. what: the fault, for operators. tries: how often it is tried unless told otherwise.
    run: tries it so often, with an empty folder to work in. Raises NotHere. alone: not beside others, for it counts
    what a busy machine loses.
    """

    name: str
    what: str
    tries: int
    run: Callable[[int, Path], Outcome]
    alone: bool = False
