"""The view is turned, moved and fitted, by keys, by the mouse and by itself."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt

from tests.app.drawn import SIZE, show
from tests.app.hand_frames import hand_frame, sample


def test_the_view_is_fitted_to_the_first_hands_until_somebody_turns_it(viewport, qtbot):
    nobody = sample(extra_m=[(3.0, 0.0, 0.0), (-3.0, 2.0, 0.0)])
    show(viewport, qtbot, *nobody)
    far = viewport.camera.distance_m
    show(viewport, qtbot, *sample(hand_frame("right")))
    near = viewport.camera.distance_m
    assert near < far / 2
    viewport.view_top()
    drag(qtbot, viewport, Qt.MouseButton.LeftButton)
    target = viewport.camera.target_m
    show(viewport, qtbot, *nobody)
    show(viewport, qtbot, *sample(hand_frame("left")))
    assert (viewport.camera.target_m == target).all()


def test_keys_turn_the_camera(viewport, qtbot):
    show(viewport, qtbot, *sample(hand_frame("right")))
    looks = {}
    for key in (Qt.Key.Key_1, Qt.Key.Key_3, Qt.Key.Key_7):
        qtbot.keyClick(viewport, key)
        looks[key] = (viewport.camera.azimuth_rad, viewport.camera.elevation_rad)
    assert looks[Qt.Key.Key_1] == (0.0, 0.0)
    assert looks[Qt.Key.Key_3] == pytest.approx((np.pi / 2, 0.0))
    assert looks[Qt.Key.Key_7] == pytest.approx((0.0, np.pi / 2))
    viewport.camera.target_m = np.array([9.0, 9.0, 9.0])
    qtbot.keyClick(viewport, Qt.Key.Key_F)
    x, y, _ = viewport.points_on_screen(hand_frame("right").joints_world[:, :3, 3]).T
    assert x.min() > 0 and x.max() < SIZE[0] and y.min() > 0 and y.max() < SIZE[1]


def drag(qtbot, widget, button, modifier=Qt.KeyboardModifier.NoModifier):
    qtbot.mousePress(widget, button, modifier, QPoint(100, 100))
    # pytest-qt's mouseMove holds no button
    from PySide6.QtGui import QMouseEvent
    from PySide6.QtWidgets import QApplication

    move = QMouseEvent(
        QMouseEvent.Type.MouseMove, QPointF(150, 120), widget.mapToGlobal(QPointF(150, 120)), button, button, modifier
    )
    QApplication.sendEvent(widget, move)
    qtbot.mouseRelease(widget, button, modifier, QPoint(150, 120))


def test_the_mouse_orbits_and_pans(viewport, qtbot):
    camera = viewport.camera
    azimuth, target = camera.azimuth_rad, camera.target_m
    drag(qtbot, viewport, Qt.MouseButton.LeftButton)
    assert camera.azimuth_rad != azimuth and (camera.target_m == target).all()
    for button, modifier in (
        (Qt.MouseButton.MiddleButton, Qt.KeyboardModifier.NoModifier),
        (Qt.MouseButton.LeftButton, Qt.KeyboardModifier.ShiftModifier),
    ):
        azimuth = camera.azimuth_rad
        # what was under the pointer goes with it
        x, y, _ = viewport.points_on_screen(camera.target_m[None])[0]
        target = camera.target_m
        drag(qtbot, viewport, button, modifier)
        assert viewport.points_on_screen(target[None])[0, :2] == pytest.approx((x + 50, y + 20), abs=1e-6)
        assert camera.azimuth_rad == azimuth


def test_following_keeps_the_hand_in_the_middle(viewport, qtbot):
    viewport.set_follow_hand(True)
    hand = hand_frame("right")
    for i in range(60):
        show(viewport, qtbot, *sample(hand, sequence=i))
    x, y, _ = viewport.points_on_screen(hand.joints_world[:, :3, 3].mean(axis=0)[None])[0]
    assert abs(x - SIZE[0] / 2) < 40 and abs(y - SIZE[1] / 2) < 40
