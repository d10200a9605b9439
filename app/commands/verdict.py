"""The verdict on a take as the command line gives it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from core.takes.verdict import Verdict

COLOURS = {"good": "green", "warning": "amber", "problem": "red"}


def verdict_line(verdict: Verdict) -> str:
    """'red: 34.4 s without frames, about 3,440'."""
    return f"{COLOURS[verdict.level.value]}: {verdict.headline}"


def verdict_figures(verdict: Verdict) -> dict[str, Any]:
    """What `--json` says of it."""
    return {"level": verdict.level.value, "headline": verdict.headline, "findings": verdict.texts}
