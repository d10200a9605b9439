"""Takes changed at random under right checksums: results or a clear error, soon, in little memory."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tests.data import ROOT

TAKES = 100


@pytest.mark.parametrize("seed", range(2))
def test_what_is_changed_at_random(seed: int) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.core.takes.mutated", str(seed), str(TAKES)],
        cwd=ROOT, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["wrong"] == []
    assert told["longest_s"] < 10 and told["bytes"] < 500e6
    assert min(told["ended"].get("result", 0), told["ended"].get("FormatError", 0)) > TAKES // 10, told["ended"]
