"""Records frames and says after each how many are acknowledged, until it is killed: run by test_kill."""

from __future__ import annotations

import sys
from pathlib import Path

from core.profile import load_profile
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.core.takes import several
from tests.core.takes.frames import plain_frame, plain_solved


def say(words: object) -> None:
    sys.stdout.write(f"{words}\n")
    sys.stdout.flush()


def one_stream(path: Path, frames: int) -> None:
    writer = TakeWriter(path, TakeInfo(path.stem, rate_hz=120), load_profile("han19"))
    for i in range(frames):
        writer.raw("", plain_frame(i, n=40))
        writer.solved(plain_solved(i))
        say(f"{writer.acknowledged} {writer.acknowledged_solved}")
    say("sealing")
    writer.seal(TakeCounts(frames, frames, solved=frames))
    say("sealed")


def several_streams(path: Path, frames: int) -> None:
    """Says how many records of all kinds there are."""
    writer = several.begin(path)
    for k, (stream, one) in enumerate(several.events(frames), 1):
        several.write(writer, stream, one)
        say(k)
    say("sealing")
    writer.seal(several.first_of(several.n_events(frames)).counts)
    say("sealed")


if __name__ == "__main__":
    {"one": one_stream, "several": several_streams}[sys.argv[1]](Path(sys.argv[2]), int(sys.argv[3]))
