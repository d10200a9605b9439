"""How a take is coming on, in a line: what has come, and what does not come. Knows no window."""

from __future__ import annotations

from dataclasses import dataclass

from app.stream_figures import StreamFigures
from app.take_summary import RecordingNumbers
from core.takes.holes import seconds_text

SILENT_S = 1.0
"""A stream of which no frames come for so long says so [s]."""


@dataclass(frozen=True)
class Words:
    """level: "" while all is well."""

    text: str
    tip: str
    level: str = ""


def recording_words(recording: RecordingNumbers) -> Words:
    """Of the stream that is solved, and of the others what they lack."""
    beside = recording.beside
    lacks = _lacks(recording.main) if recording.solving is not None else []
    text = ", ".join([f"{recording.received:,} frames", *lacks])
    tip = "Frames of this take that have come, and the time in which none came."
    if beside:
        every = ((key, [f"{of.received:,} frames", *_lacks(of)]) for key, of in recording.streams.items())
        tip = "\n".join([tip, *(f"{key}: {', '.join(words)}" for key, words in every)])
    amiss = [f"{key}: {', '.join(lacking)}" for key, of in beside.items() if (lacking := _lacks(of))]
    if amiss:
        text = "; ".join([*amiss, text])
    level = "problem" if lacks or amiss else ""
    if recording.trouble:
        text, tip = recording.trouble, f"{recording.trouble}.\n{text}"
        level = level or recording.level.value
    return Words(text, tip, level)


def _lacks(of: StreamFigures) -> list[str]:
    lacks = [f"none for {of.silent_s:.0f} s"] if of.silent_s >= SILENT_S else []
    return [*lacks, *([f"{seconds_text(of.holes.seconds)} without"] if of.holes.seconds else [])]
