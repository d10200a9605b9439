"""How much memory a process took."""

from __future__ import annotations

import re
from pathlib import Path


def most_bytes() -> int:
    """The most that this process ever had in memory, since it was started; 0 where the system does not say.

    What `resource` says counts the process that it was started by, too."""
    try:
        found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"))
    except OSError:
        return 0
    return 1024 * int(found[1]) if found else 0
