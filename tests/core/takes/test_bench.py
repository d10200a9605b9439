from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from core.takes.bench import bench_take


def test_figures_of_a_short_take(tmp_path: Path) -> None:
    figures = asdict(bench_take(200, tmp_path))
    assert all(value > 0 for value in figures.values())
    assert 6000 < figures["bytes_per_frame"] < 9000
    assert figures["bytes_per_frame_sealed"] < figures["bytes_per_frame"]
    assert list(tmp_path.iterdir()) == []
