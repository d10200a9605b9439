import json
import subprocess
import sys

from tests.data import ROOT


def test_the_benchmark_draws_and_says_what_it_drew_with():
    command = [
        sys.executable,
        "-m",
        "app",
        "bench",
        "viewport",
        "--seconds",
        "0.5",
        "--width",
        "320",
        "--height",
        "240",
    ]
    ran = subprocess.run([*command, "--json"], cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    figures = json.loads(ran.stdout.splitlines()[-1])
    if not figures["reason"]:
        assert figures["frames"] > 0 and figures["paint_median_ms"] > 0 and figures["renderer"] in ran.stdout
