"""The window's first size, and a remembered one, on screens of several sizes: each in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from app.virtual_display import virtual_display

CHILD = """
import json, sys
from PySide6.QtCore import QEventLoop, QTimer
from PySide6.QtWidgets import QApplication
from app import theme
from app.main_window import MainWindow
from app.session import Session
from app.settings import Settings
from app.worker import SessionWorker
from core.profile import load_profile
from pathlib import Path
settings = Settings(Path(sys.argv[1]))
application = QApplication([])
theme.apply(application)
session = Session(load_profile("han19"), warm_up=lambda: None)
window = MainWindow(SessionWorker(session, 30), settings)
session.start()
window.show()
if len(sys.argv) > 2:
    window.setGeometry(*map(int, sys.argv[2:]))
loop = QEventLoop()
QTimer.singleShot(300, loop.quit)
loop.exec()
screen, held = application.primaryScreen().availableGeometry(), window.geometry()
inside = {}
for widget in (window.deck, window.strip, window.viewport, *(dock.widget() for dock in window.docks.values())):
    low = widget.mapTo(window, widget.rect().bottomRight())
    inside[type(widget).__name__] = [widget.width(), widget.height(), low.x() < held.width(), low.y() < held.height()]
least = window.minimumSizeHint()
print(json.dumps({
    "window": [held.x(), held.y(), held.width(), held.height()], "contained": screen.contains(held), "inside": inside,
    "least": [least.width(), least.height()], "maximised": window.isMaximized(),
}))
window.stop_and_close()
"""


def opened(screen: str, settings, *geometry: int) -> dict:
    """What the window says of itself on a screen. geometry: given to it before it is closed and remembered."""
    with virtual_display(f"{screen}x24"):
        run = subprocess.run(
            [sys.executable, "-c", CHILD, str(settings), *map(str, geometry)],
            capture_output=True, text=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}, timeout=120, check=False,
        )  # fmt: skip
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout.splitlines()[-1])


@pytest.mark.parametrize("screen", ["1366x768", "1280x720", "1920x1080"])
def test_the_first_size_comes_from_the_screen(tmp_path, screen):
    width, height = map(int, screen.split("x"))
    told = opened(screen, tmp_path / "settings.json")
    assert told["contained"], told["window"]
    w, h = told["window"][2:]
    assert w == min(width, 1600) and h >= min(height - 60, 950)
    assert told["maximised"] == (width < 1600)
    assert told["least"][0] <= width and told["least"][1] <= height - 60
    for name, (shown_w, shown_h, in_width, in_height) in told["inside"].items():
        if name != "MessagesPanel":  # behind the plots
            assert in_width and in_height and shown_w >= 60 and shown_h >= 25, name
    assert told["inside"]["Viewport"][0] >= 500 and told["inside"]["Viewport"][1] >= 250


def test_a_window_remembered_from_a_larger_screen_is_brought_into_this_one(tmp_path):
    path = tmp_path / "settings.json"
    large = opened("2560x1440", path, 900, 300, 1650, 1100)
    assert large["window"] == [900, 300, 1650, 1100]
    again = opened("2560x1440", path)
    assert again["window"] == [900, 300, 1650, 1100], "on the same screen it is where it was"
    small = opened("1366x768", path)
    assert small["contained"] and small["window"][2] <= 1366 and small["window"][3] <= 768
    aside = tmp_path / "aside.json"
    opened("2560x1440", aside, 1300, 600, 1200, 760)
    assert opened("2000x1200", aside)["contained"]
