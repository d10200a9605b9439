"""A disk that hangs: once it is told to, a take's writes block for good in the operating system, in a full pipe, until
somebody drains it. Run as a program it is the `phalanx` command on such a disk:

    python -m tests.hanging_disk TRIGGER record ...

The disk hangs while the file TRIGGER exists when a write comes.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from io import FileIO
from pathlib import Path
from typing import Any

from core.takes import record_file


class HangingDisk:
    """Puts itself under every take that is begun from now on."""

    def __init__(self, hangs: Callable[[], bool]) -> None:
        self.hangs = hangs
        self._out, self._in = os.pipe()
        os.set_blocking(self._out, False)
        os.set_blocking(self._in, False)
        try:
            while True:
                os.write(self._in, bytes(1 << 16))
        except BlockingIOError:
            os.set_blocking(self._in, True)  # it is full: the next write does not come back

        disk = self

        class File(FileIO):
            def write(self, data: Any) -> int:
                if disk.hangs():
                    os.write(disk._in, b"x")
                return super().write(data)

        record_file.FileIO = File  # type: ignore[misc,attr-defined]

    def answer(self) -> None:
        """Let the writes through."""
        self.hangs = lambda: False
        with suppress(BlockingIOError):
            os.read(self._out, 1 << 20)

    def restore(self) -> None:
        """Leave takes alone."""
        self.answer()
        record_file.FileIO = FileIO  # type: ignore[misc,attr-defined]


if __name__ == "__main__":
    trigger = Path(sys.argv[1])
    HangingDisk(trigger.exists)
    from app.cli import main

    sys.exit(main(sys.argv[2:]))
