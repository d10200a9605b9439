"""How a take is coming on, in a line: what has come, and what does not come. Knows no window."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from app.stream_figures import StreamFigures
from app.take_summary import RecordingNumbers
from core.takes.holes import seconds_text

SILENT_S = 1.0
"""A stream of which no frames come for so long says so [s]."""

ENDED = "ended"


@dataclass(frozen=True)
class Words:
    """level: "" while all is well."""

    text: str
    tip: str
    level: str = ""


def recording_words(recording: RecordingNumbers, ended: Collection[str] = ()) -> Words:
    """Of the stream that is solved, and what any of them lacks; of several with its name. ended: the keys of those that
    were played to their end."""
    lacks = {key: _lacks(of, key in ended) for key, of in recording.streams.items()}
    text = f"{recording.received:,} frames"
    tip = "Frames of this take that have come, and the time in which none came."
    if recording.beside:
        every = ((key, [f"{of.received:,} frames", *lacks[key]]) for key, of in recording.streams.items())
        tip = "\n".join([tip, *(f"{key}: {', '.join(words)}" for key, words in every)])
        text = "; ".join([text, *(f"{key}: {', '.join(lacking)}" for key, lacking in lacks.items() if lacking)])
    else:
        text = ", ".join([text, *(word for lacking in lacks.values() for word in lacking)])
    said = {word for lacking in lacks.values() for word in lacking}
    level = "problem" if said - {ENDED} else "warning" if said else ""
    if recording.trouble:
        text, tip = recording.trouble, f"{recording.trouble}.\n{text}"
        level = level or recording.level.value
    return Words(text, tip, level)


def _lacks(of: StreamFigures, ended: bool) -> list[str]:
    lacks = [ENDED] if ended else [f"none for {of.silent_s:.0f} s"] if of.silent_s >= SILENT_S else []
    return [*lacks, *([f"{seconds_text(of.holes.seconds)} without"] if of.holes.seconds else [])]
