"""Names in the deck: how they begin and how they end is seen, and the tooltip has the whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.demo import DemoDevice
from app.stream_figures import StreamFigures
from app.take_summary import TakeSummary

LONG = "Volume B, stage seven, north wall: motion capture of hands and tools, day two"


@pytest.mark.parametrize("size", [(1280, 720), (1920, 1080)])
def test_a_long_name_keeps_its_beginning_and_its_end(window, qtbot, size: tuple[int, int]) -> None:
    window.resize(*size)
    window.show()
    deck, worker = window.deck, window.worker
    stream = worker.add_device(DemoDevice, {}, LONG)
    worker.connect_device(stream)
    qtbot.waitUntil(lambda: LONG in deck.device.text() and "Hz" in deck.device.text(), timeout=60_000)
    streams = {"": StreamFigures(100, 100)}
    name = f"{LONG}_017".replace(":", "")
    deck.show_summary(TakeSummary(name, Path("a.mcap"), 9.0, 100, sealed=True, streams=streams))
    window.plan.set_shot(LONG)
    qtbot.wait(200)
    for line, begin, end in ((deck.device, "Volume", "Hz"), (deck.frames, "Volume", ""), (deck.take, "perf", "001")):
        shown = line.shown
        assert shown.startswith(begin) and shown.endswith(end) and shown[-3:] == line.text()[-3:], shown
        assert not line.elided or line.toolTip().startswith(line.text())
    worker.disconnect_device(stream)
