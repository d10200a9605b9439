"""docs/architecture.md names what is there, and its numbers are those of the code."""

from __future__ import annotations

import re

from app import look_back, recording, solver_thread
from devices.common import udp
from tests.data import ROOT
from tests.some import some

PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
SOURCES = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "app").rglob("*.py")))


def test_its_files_are_there() -> None:
    for name in some(re.findall(r"`([\w/]+\.py)`", PAGE)):
        assert (ROOT / name).is_file(), name


def test_its_threads_are_called_so() -> None:
    for name in some(re.findall(r"`(phalanx-[a-z-]*[a-z])", PAGE)):
        assert f'"{name}' in SOURCES, name


def test_its_queues_hold_what_it_says() -> None:
    assert f"{solver_thread.QUEUE_FRAMES} frames of the stream that is solved" in PAGE
    poses = int(recording.QUEUE_FRAMES * recording.SOLVED_SHARE)
    assert f"{recording.QUEUE_FRAMES} frames of each stream, {poses} poses" in PAGE
    assert f"{look_back.LOOK_BACK_S:.0f} s of all streams, up to {look_back.MOST_BYTES >> 20} MiB" in PAGE
    assert f"receive buffer, {udp.RECEIVE_BUFFER >> 20} MiB asked for" in PAGE
    for reason in (solver_thread.SKIPPED, recording.QUEUE_FULL):
        assert f"*{reason}*" in PAGE
