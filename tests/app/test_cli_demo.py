"""`phalanx demo` on a machine without a display: what `make run` does there."""

from __future__ import annotations

from pathlib import Path

import pytest

from core.takes.reader import open_take
from tests.app.command import phalanx


def test_without_a_display_the_tour_leaves_a_take_exports_and_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    ran = phalanx("demo", "--out", tmp_path / "demo", "--seconds", 3, "--json")
    figures = ran.figures
    assert figures["folder"] == str(tmp_path / "demo")
    assert str(tmp_path / "demo") in ran.out.splitlines()[-2]
    assert figures["received"] == figures["written"] + sum(figures["dropped"].values())
    assert "marks.csv" in [Path(path).name for path in figures["exports"]]
    for path in [*figures["exports"], *figures["pictures"]]:
        few_lines = Path(path).name.endswith(("_held.csv", "_holes.csv", "marks.csv"))
        assert Path(path).stat().st_size > (20 if few_lines else 1000), path
    assert {Path(path).suffix for path in figures["exports"]} == {".c3d", ".trc", ".csv", ".bvh", ".glb"}
    assert all(Path(path).read_bytes().startswith(b"\x89PNG") for path in figures["pictures"])
    with open_take(figures["take"]) as take:
        assert take.complete
        assert ran.code == (0 if take.verdict.whole else 3), ran.err  # a busy machine may leave a hole
        assert len(take.raw) == figures["written"]
    assert set(figures["rms_m"]) == {"left", "right"}


def test_no_window_without_a_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":60998")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    for words in ([], ["--demo"], ["window"]):
        ran = phalanx(*words)
        assert ran.code == 1
        assert "no display" in ran.err
