"""What strip and panels say of the live stream: one latency, counts of what was lost, nothing that is over."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from app.live_latency import NO_LATENCY, latency_parts, latency_value
from app.live_numbers import SolverNumbers
from app.panels.tracking import LOOK_AHEAD_MS
from core.engine import Engine
from core.frames import MarkerFrame, TrackedFrame
from devices.device import Health, Level
from tests.app.stage import RATE_HZ, server
from tests.app.test_window import Desk


@pytest.fixture
def stage():
    with server() as simulator:
        yield simulator


@pytest.fixture
def desk(qtbot, tmp_path):
    made = Desk(qtbot, tmp_path / "takes")
    yield made
    made.close()


def use(monkeypatch: pytest.MonkeyPatch, share: float) -> None:
    """An engine that takes so many frames' time for one."""
    step = Engine.step

    def slow(self: Engine, frame: MarkerFrame) -> TrackedFrame:
        until_s = time.perf_counter() + share / RATE_HZ
        solved = step(self, frame)
        time.sleep(max(until_s - time.perf_counter(), 0.0))
        return solved

    monkeypatch.setattr(Engine, "step", slow)


def test_one_latency_wherever_it_stands_with_its_parts_in_the_tooltip(desk, stage) -> None:
    pairs: list[tuple[str, str]] = []
    desk.worker.numbers.connect(  # after strip and panel
        lambda _: pairs.append((desk.window.strip.latency.value.text(), desk.card._figures["Latency"].text()))
    )
    desk.connected(stage)
    desk.until(lambda: desk.window.strip.latency.value.text() != NO_LATENCY, "a latency")
    chosen = desk.window.tracking.look_ahead
    chosen.setFocus()
    for _ in range(len(LOOK_AHEAD_MS) - 1):
        QTest.keyClick(chosen, Qt.Key.Key_Down, delay=100)
    assert desk.session.look_ahead_s == LOOK_AHEAD_MS[-1] / 1000.0
    pairs.clear()
    desk.until(lambda: len(pairs) > 5 and len({strip for strip, _ in pairs}) > 2, "figures that change")
    assert all(strip == panel for strip, panel in pairs)
    assert float(desk.card._figures["Latency"].text().removesuffix(" ms")) >= LOOK_AHEAD_MS[-1]
    for shown in (desk.window.strip.latency, desk.card._figures["Latency"]):
        tip = shown.toolTip()
        assert "From exposure to the solved pose: median" in tip and "until the frame arrived" in tip
        assert f"{LOOK_AHEAD_MS[-1]} ms is the look-ahead" in tip
    desk.click(desk.card.toggle)
    desk.until(lambda: not any(one.active for one in desk.session.receivers))
    desk.until(lambda: pairs[-1] == (NO_LATENCY, NO_LATENCY), "no latency without frames")


def test_latency_is_not_known_without_frames() -> None:
    flowing = Health(Level.GOOD, connected=True, rate_hz=120.0, latency_s=0.0034)
    solver = SolverNumbers(latency_s=0.1123, latency_p99_s=0.12, look_ahead_s=0.1)
    assert latency_value(solver, flowing) == "112.3 ms"
    assert latency_parts(solver, flowing).splitlines() == [
        "From exposure to the solved pose: median 112.3 ms, 99 % under 120.0 ms.",
        "Of that 3.4 ms until the frame arrived on this machine.",
        "Of that 100 ms is the look-ahead chosen in Tracking.",
    ]
    for solved, health in ((SolverNumbers(), flowing), (solver, Health()), (solver, replace(flowing, rate_hz=0.0))):
        assert latency_value(solved, health) == NO_LATENCY and "Shown while" in latency_parts(solved, health)


def test_a_solver_that_skips_is_amber_and_its_count_begins_anew_with_the_profile(desk, stage, monkeypatch) -> None:
    use(monkeypatch, 2.0)
    desk.connected(stage)
    strip = desk.window.strip
    desk.until(lambda: strip.solver.light.level is Level.WARNING, "amber")
    assert "were skipped, so that you see what happens now" in strip.solver.toolTip()
    assert "close other programs or lower the camera rate" in strip.solver.toolTip().lower()
    assert "Solve again in review" in strip.solver.toolTip()
    count = lambda: int(strip.dropped.value.text().split(", ")[0].replace(",", ""))  # noqa: E731
    desk.until(lambda: count() > 100, "poses that were skipped")
    assert strip.dropped.light.level is Level.WARNING and "skipped to stay live" in strip.dropped.toolTip()
    monkeypatch.undo()
    desk.until(lambda: strip.solver.light.level is Level.GOOD, "green again")
    before = count()
    desk.window.tracking.performers.blocks[0].profile.setFocus()
    QTest.keyClick(desk.window.tracking.performers.blocks[0].profile, Qt.Key.Key_Q)
    desk.until(lambda: desk.session.profile.layout.name == "qualisys13", "another layout")
    desk.until(lambda: count() < before)
    told = strip.dropped.toolTip().partition("Before the last change of profile: ")[2]
    skipped, _, rest = told.partition(" ")
    assert int(skipped.replace(",", "")) >= before  # a busy machine skips more until the profile is changed
    assert rest.startswith("poses not solved, skipped to stay live")


def test_hands_of_another_profile_go_at_once_everywhere(desk, stage) -> None:
    desk.connected(stage)
    desk.until(lambda: desk.window.strip.fit.light.level is Level.GOOD, "hands")
    desk.until(lambda: desk.window.viewport.shown[1] is not None and desk.window.viewport.shown[1].hands)
    desk.worker._frames.stop()  # nothing newer is looked at
    desk.qtbot.wait(100)
    desk.worker.set_profile(replace(desk.session.profile, performer="Anna"))
    frame, tracked, cast = desk.window.viewport.shown
    assert frame is not None and tracked.hands == () and cast == desk.session.profiles
    desk.qtbot.wait(300)
    assert desk.window.strip.fit.value.text() == "–"
    assert all(light.level is Level.IDLE for light in desk.window.deck.hand_lights.values())
    assert desk.window.viewport.shown[1].hands == ()
