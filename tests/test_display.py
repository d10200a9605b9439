"""The display that tests open their windows on, and the application where there is none."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from app.virtual_display import _is_served
from tests.data import ROOT

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="displays of others are not Xvfb")

WAITS = "import time\nfrom app.virtual_display import virtual_display\nwith virtual_display() as name:\n"


def without_display() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}


def test_a_display_goes_with_a_process_that_is_killed() -> None:
    script = WAITS + "    print(name, flush=True)\n    time.sleep(600)"
    process = subprocess.Popen(
        [sys.executable, "-c", script], cwd=ROOT, env=without_display(), stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    display = process.stdout.readline().strip()
    assert _is_served(display)
    process.send_signal(signal.SIGKILL)
    process.wait()
    end_s = time.monotonic() + 60.0
    while _is_served(display) and time.monotonic() < end_s:
        time.sleep(0.05)
    assert not _is_served(display)


LATE = """
import atexit
from pathlib import Path
from PySide6.QtWidgets import QWidget

def test_it(qapp):
    shown = QWidget()
    shown.show()
    qapp.processEvents()

    def late():
        shown.resize(300, 300)
        for _ in range(50):
            qapp.processEvents()
        Path(__file__).with_suffix(".ended").touch()

    atexit.register(late)
"""


def test_what_qt_does_after_the_last_test_finds_its_display(tmp_path: Path) -> None:
    test = tmp_path / "test_late.py"
    test.write_text(LATE, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "tests.conftest", "-p", "no:cacheprovider", str(test)]
    done = subprocess.run(command, cwd=ROOT, env=without_display(), capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "1 passed" in done.stdout, done.stdout + done.stderr
    assert "broke" not in done.stderr and test.with_suffix(".ended").exists(), done.stderr
