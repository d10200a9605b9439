"""Commands as somebody who may not write everywhere: root may, whatever a folder's permissions say."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


def restricted() -> list[str]:
    """What goes before a command so that permissions count for it. The test is skipped where there is no way."""
    if sys.platform == "win32":
        pytest.skip("permissions of folders are another matter on Windows")
    if os.geteuid() != 0:
        return []
    if shutil.which("setpriv") is None:
        pytest.skip("root may write everywhere, and there is no setpriv to give that up")
    return ["setpriv", "--bounding-set=-all", "--inh-caps=-all"]


@contextmanager
def read_only(folder: Path) -> Iterator[Path]:
    """Nobody may write into it while this lasts."""
    folder.mkdir(parents=True, exist_ok=True)
    before = folder.stat().st_mode
    folder.chmod(0o555)
    try:
        yield folder
    finally:
        folder.chmod(before)
