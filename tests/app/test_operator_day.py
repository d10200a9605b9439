"""A whole capture day by keys and mouse, on a small and on a large screen (operator_day says what is done)."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from app.virtual_display import virtual_display
from tests.data import ROOT


@pytest.mark.parametrize("screen", ["1366x768", pytest.param("1920x1080", marks=pytest.mark.long)])
def test_an_operators_day(tmp_path, screen):
    with virtual_display(f"{screen}x24"):
        run = subprocess.run(
            [sys.executable, "-m", "tests.app.operator_day", str(tmp_path)],
            cwd=ROOT, capture_output=True, text=True, timeout=900, check=False,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        )  # fmt: skip
    assert run.returncode == 0 and run.stdout.endswith("OK\n"), run.stderr[-4000:]
