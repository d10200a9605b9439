"""`phalanx bench soak`: a take over the wire, and the memory of both processes meanwhile."""

from __future__ import annotations

import math
from pathlib import Path

from tests.app.command import phalanx


def test_a_short_soak_gives_the_memory_of_session_and_server(tmp_path: Path) -> None:
    ran = phalanx(
        "bench", "soak", "--minutes", 0.1, "--rate", 60, "--points", 42, "--folder", tmp_path,
        "--trim", "--objects", "--json",
    )  # fmt: skip
    assert ran.code == 0, ran.err
    figures = ran.figures
    assert figures["received"] == figures["written"] + sum(figures["dropped"].values()) > 0
    for name in ("session", "server"):
        growth = figures["growth"][name]
        assert math.isfinite(growth["growth_mb"]) and math.isfinite(growth["own_growth_mb"])
        assert len(growth["minutes"]) == len(growth["resident_mb"]) >= 3
        assert all(0 < own <= resident for own, resident in zip(growth["own_mb"], growth["resident_mb"], strict=True))
    assert "Python objects more than before" in ran.out and "frames/s" in ran.out
    assert list(tmp_path.iterdir()) == []
