"""Records frames and says after each how many are acknowledged, until it is killed: run by test_kill."""

from __future__ import annotations

import sys
from pathlib import Path

from core.profile import load_profile
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.core.takes.frames import plain_frame, plain_solved


def main(path: Path, frames: int) -> None:
    writer = TakeWriter(path, TakeInfo(path.stem, rate_hz=120), load_profile("han19"))
    for i in range(frames):
        writer.raw("", plain_frame(i, n=40))
        writer.solved(plain_solved(i))
        sys.stdout.write(f"{writer.acknowledged} {writer.acknowledged_solved}\n")
        sys.stdout.flush()
    sys.stdout.write("sealing\n")
    sys.stdout.flush()
    writer.seal(TakeCounts(frames, frames, solved=frames))
    sys.stdout.write("sealed\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
