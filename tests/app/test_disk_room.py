"""Room on a disk in words: never more than there is, and something where there is something."""

from __future__ import annotations

import pytest

from app.disk_room import free_text, recording_left
from app.status_strip import StatusStrip
from core.takes.disk import RESERVE


@pytest.mark.parametrize(
    ("free", "words"),
    [
        (0, "0 MB"), (1, "under 1 MB"), (999_999, "under 1 MB"), (1_500_000, "1 MB"), (48_700_000, "48 MB"),
        (999_999_999, "999 MB"), (10**9, "1.0 GB"), (12_390_000_000, "12.3 GB"), (2 * 10**12, "2,000.0 GB"),
    ],
)  # fmt: skip
def test_free_bytes_in_words(free: int, words: str) -> None:
    assert free_text(free) == words


def test_how_long_that_is_of_recording_where_the_rate_is_known() -> None:
    assert recording_left(2 * 10**9, 0.0) == ""
    # A byte recorded takes two, for the copy that sealing makes; 1 GB stays.
    assert recording_left(RESERVE + 600_000_000, 1e6) == "At the rate of the last take that is 5 min of recording."
    assert recording_left(10**6, 1e6) == "At the rate of the last take that is 0 s of recording."


def test_the_strip_and_the_recorder_never_say_that_there_are_no_gigabytes(window) -> None:
    window.worker._disk_free = 48_700_000
    window.strip._refresh(window.worker.session.numbers())
    window.recorder._refresh(window.worker.session.numbers())
    strip: StatusStrip = window.strip
    assert strip.disk.value.text() == "48 MB free" and "Recording needs 1 GB" in strip.disk.toolTip()
    assert window.recorder.figures["Disk left"].text() == "48 MB"
