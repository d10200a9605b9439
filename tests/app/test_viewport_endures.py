"""The viewport lives through much use, windows that change, drivers that fail and machines without OpenGL."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
from PySide6.QtWidgets import QLabel, QMainWindow

from core.frames import HandState
from core.hand.shape import HandShape
from tests.app.drawn import SIZE, pixel_at, pixels, show
from tests.app.hand_frames import hand_frame, profile, sample
from tests.data import ROOT


def test_an_empty_view_says_what_to_do(viewport, qtbot):
    assert "Devices panel" in viewport.message
    viewport.show_empty("No frames yet", "Check the cameras.")
    assert viewport.message == "No frames yet\nCheck the cameras."
    show(viewport, qtbot, *sample(hand_frame("left")))
    assert viewport.message == ""


def test_shaders_are_linked_once(viewport, qtbot, monkeypatch):
    from vispy.gloo import gl

    viewport.set_skeleton_shown(True)
    show(viewport, qtbot, *sample(hand_frame("right"), hand_frame("left")))
    links = []
    link = gl.glLinkProgram
    monkeypatch.setattr(gl, "glLinkProgram", lambda program: (links.append(program), link(program)))
    states = [HandState.TRACKED, HandState.LOST, HandState.SEARCHING]
    for i in range(30):
        hands = (
            hand_frame("right", state=states[i % 3], scale=1 + i / 100),
            hand_frame("left", hidden=tuple(range(i % 9))),
        )
        with qtbot.waitSignal(viewport.drawn):
            worn = replace(profile(), shape=HandShape.uniform(1 + (i % 3) / 10))
            viewport.show_frame(*sample(*hands, extra_m=np.ones((i * 7, 3))), worn)
        viewport.set_skeleton_shown(bool(i % 2))
        viewport.camera.orbit(0.1, 0.05)
    viewport.resize(500, 400)
    pixels(viewport)
    assert links == []


def test_five_thousand_updates(viewport, qtbot, qapp):
    frames = [sample(hand_frame("right"), hand_frame("left"), extra_m=np.ones((n, 3)), sequence=n) for n in range(7)]
    drawings = []
    viewport.drawn.connect(lambda: drawings.append(1))
    for i in range(5000):
        viewport.show_frame(*frames[i % 7], profile())
        viewport.update()
        if i % 10 == 0:
            qapp.processEvents()
    show(viewport, qtbot, *sample(hand_frame("right")))
    assert viewport.failure == "" and drawings
    assert viewport.legend_text.splitlines()[1] == "Labelled 19"


def test_it_draws_on_after_a_move_to_another_window(viewport, qtbot):
    show(viewport, qtbot, *sample(hand_frame("right")))
    window = QMainWindow()
    qtbot.addWidget(window)
    window.setCentralWidget(viewport)
    window.resize(*SIZE)
    with qtbot.waitExposed(window):
        window.show()
    qtbot.waitUntil(lambda: viewport.width() == SIZE[0])
    hand = hand_frame("left")
    show(viewport, qtbot, *sample(hand, sequence=2))
    viewport.view_fit()
    viewport.view_top()
    assert pixel_at(viewport, hand.joints_world[[0, 7], :3, 3].mean(axis=0)).mean() > 110
    assert viewport.failure == ""
    window.takeCentralWidget()


def test_a_driver_that_fails_leaves_a_reason_and_a_living_application(viewport, qtbot, monkeypatch, caplog):
    def broken(*args):
        raise RuntimeError("out of texture memory")

    monkeypatch.setattr("app.viewport.scene.Scene.draw", broken)
    viewport.show_frame(*sample(hand_frame("right")), profile())
    qtbot.waitUntil(lambda: bool(viewport.failure))
    assert "out of texture memory" in viewport.findChild(QLabel).text()
    viewport.show_frame(*sample(hand_frame("left")), profile())
    viewport.view_fit()
    viewport.set_names_shown(True)


WITHOUT_GL = """
from PySide6.QtWidgets import QApplication, QLabel
from app.viewport.viewport import Viewport
from tests.app.hand_frames import hand_frame, profile, sample
application = QApplication([])
viewport = Viewport()
viewport.show()
viewport.show_frame(*sample(hand_frame("right")), profile())
viewport.view_fit(); viewport.view_top(); viewport.set_names_shown(True); viewport.show_empty("a", "b")
application.processEvents()
print(viewport.findChild(QLabel).text())
"""


def test_without_opengl_it_says_so():
    result = subprocess.run(
        [sys.executable, "-c", WITHOUT_GL],
        cwd=ROOT,
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stderr
    assert "No 3D view" in result.stdout and "no OpenGL" in result.stdout
