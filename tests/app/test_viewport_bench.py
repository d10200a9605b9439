"""`phalanx bench viewport` draws, on the display of the tests."""

import json
import subprocess
import sys

from tests.app.drawn import need_opengl
from tests.data import ROOT


def test_the_benchmark_draws_and_says_what_it_drew_with():
    need_opengl()
    options = ["--seconds", "1", "--width", "320", "--height", "240", "--json"]
    command = [sys.executable, "-m", "app", "bench", "viewport", *options]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    figures = json.loads(ran.stdout.splitlines()[-1])
    assert figures["reason"] == ""
    assert figures["frames"] > 0 and figures["paint_median_ms"] > 0
    assert figures["named_frames"] > 0 and figures["names"] > 0
    assert figures["renderer"] and figures["renderer"] in ran.stdout
