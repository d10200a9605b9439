"""How much memory a process holds, as the system counts it."""

from __future__ import annotations

import ctypes
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from core.errors import PhalanxError


@dataclass(frozen=True)
class Memory:
    """resident: in memory now, shared libraries and all. own: of that, what no other process shares [byte]."""

    resident: int
    own: int


def memory_of(pid: int) -> Memory:
    """Of a running process. Raises PhalanxError where the system does not say (it is asked on Linux only), or the
    process has ended."""
    try:
        text = Path(f"/proc/{pid}/smaps_rollup").read_text()
    except OSError as error:
        why = error.strerror or str(error)
        raise PhalanxError(
            f"The memory of process {pid} cannot be read ({why}).", "Memory is measured on Linux, while it runs."
        ) from error
    kilobytes = {
        words[0].rstrip(":"): int(words[1])
        for line in text.splitlines()[1:]
        if len(words := line.split()) > 1 and words[1].isdecimal()
    }
    own = sum(kilobytes.get(name, 0) for name in ("Private_Clean", "Private_Dirty"))
    return Memory(kilobytes.get("Rss", 0) << 10, own << 10)


def trim() -> None:
    """Give the system back what this process has freed, where the C library can: only what is in use is left."""
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):
            ctypes.CDLL("libc.so.6").malloc_trim(0)
