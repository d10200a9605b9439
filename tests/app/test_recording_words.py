"""The line of a take that runs says whose figures are whose."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.recording_words import recording_words
from app.stream_figures import StreamFigures
from app.take_summary import RecordingNumbers

SOLVED, OTHER = "natnet-1/markers", "natnet-2/markers"


def of(frames: int, silent_s: float = 0.0) -> StreamFigures:
    return StreamFigures(frames, frames, {}, 0, 0, silent_s=silent_s)


def recording(**streams: StreamFigures) -> RecordingNumbers:
    named = dict(zip((SOLVED, OTHER), streams.values(), strict=False))
    return RecordingNumbers("take", Path("take.mcap"), 10.0, 0, 0, 0.0, 0, 0.0, 0, 0, streams=named, solving=SOLVED)


@pytest.mark.parametrize(
    ("solved", "other", "ended", "text", "level"),
    [
        (of(1453), None, (), "1,453 frames", ""),
        (of(480, 9.8), None, (), "480 frames, none for 10 s", "problem"),
        (of(1453), of(500), (), "1,453 frames", ""),
        (of(1453), of(500, 8.0), (), f"1,453 frames; {OTHER}: none for 8 s", "problem"),
        (of(480, 9.8), of(1453), (), f"480 frames; {SOLVED}: none for 10 s", "problem"),
        (of(1453), of(500, 8.0), (OTHER,), f"1,453 frames; {OTHER}: ended", "warning"),
        (of(480, 3.0), of(500, 8.0), (OTHER,), f"480 frames; {SOLVED}: none for 3 s; {OTHER}: ended", "problem"),
    ],
)
def test_what_a_stream_lacks_has_its_name_where_there_are_several(solved, other, ended, text, level):
    numbers = recording(solved=solved, **({"other": other} if other is not None else {}))
    words = recording_words(numbers, ended)
    assert (words.text, words.level) == (text, level)
    assert other is None or words.tip.splitlines()[1].startswith(f"{SOLVED}: {solved.received:,} frames")
