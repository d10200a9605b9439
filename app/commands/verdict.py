"""The verdict on a take as the command line gives it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from app.commands.result import Exit

if TYPE_CHECKING:
    from core.takes.verdict import Verdict

COLOURS = {"good": "green", "warning": "amber", "problem": "red"}


def status_of(verdict: Verdict) -> Exit:
    """The exit status of every command that says what a take is: 0 whole, 3 something is lost or not as it should be, 1
    no frame can be read. Poses that are missing can be made again, and change nothing."""
    if not verdict.readable:
        return Exit.FAILED
    return Exit.DONE if verdict.whole else Exit.LOSS


def verdict_line(verdict: Verdict) -> str:
    """'red: 34.4 s without frames, about 3,440'."""
    return f"{COLOURS[verdict.level.value]}: {verdict.headline}"


def verdict_figures(verdict: Verdict) -> dict[str, Any]:
    """What `--json` says of it."""
    return {"level": verdict.level.value, "headline": verdict.headline, "findings": verdict.texts}
