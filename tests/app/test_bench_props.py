"""`phalanx bench props` measures what it says."""

from __future__ import annotations

from tests.app.command import phalanx


def test_figures_of_a_short_performance() -> None:
    ran = phalanx("bench", "props", "--frames", 120, "--performances", 1, "--json")
    assert ran.code == 0, ran.err
    cases = ran.figures["cases"]
    assert [(case["hidden"], case["ghosts"]) for case in cases] == [(0.0, 0.0), (0.05, 2.0), (0.1, 2.0), (0.2, 4.0)]
    for case in cases:
        assert case["near"] == 1.0 and case["wrong_points"] == 0.0
    assert cases[0]["tracked"] == 1.0 - 2 / 120  # three frames prove five markers, and the third counts
