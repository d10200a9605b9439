"""The view is turned, moved and fitted, by keys, by the mouse and by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QImage, QWheelEvent
from PySide6.QtWidgets import QApplication

from app.viewport.overlay import AxesGizmo
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


def all_in_view(viewport, *hands) -> bool:
    points = np.concatenate([hand.joints_world[:, :3, 3] for hand in hands])
    x, y, depth = viewport.points_on_screen(points).T
    return bool(((x >= 0) & (x <= SIZE[0]) & (y >= 0) & (y <= SIZE[1]) & (depth > 0)).all())


def moved_by(hand, metres: float):
    """The same hand, so far to the side."""
    joints = hand.joints_world.copy()
    joints[:, 0, 3] += metres
    return replace(hand, joints_world=joints, markers_world_m=hand.markers_world_m + (metres, 0.0, 0.0))


def test_a_further_hand_out_of_view_is_brought_in_and_one_in_view_moves_nothing(viewport, qtbot):
    left, right = hand_frame("left"), hand_frame("right")
    show(viewport, qtbot, *sample(left))
    far = moved_by(right, 2.0)
    assert all_in_view(viewport, left) and not all_in_view(viewport, far)
    show(viewport, qtbot, *sample(left, far, sequence=1))
    assert all_in_view(viewport, left, far)
    viewport.view_fit_next()
    show(viewport, qtbot, *sample(left, far, sequence=2))
    show(viewport, qtbot, *sample(far, sequence=3))
    target = viewport.camera.target_m.copy()
    show(viewport, qtbot, *sample(left, far, sequence=4))
    assert (viewport.camera.target_m == target).all()


def test_after_the_device_was_gone_the_next_first_hand_is_fitted(viewport, qtbot):
    left = hand_frame("left")
    show(viewport, qtbot, *sample(left))
    with qtbot.waitSignal(viewport.drawn):
        viewport.show_frame(None, None, None)
    far = moved_by(left, 3.0)
    show(viewport, qtbot, *sample(far, sequence=1))
    assert all_in_view(viewport, far)


@pytest.mark.parametrize("how", ["wheel", "drag", "shift drag"])
def test_whoever_moved_the_camera_before_the_first_hand_keeps_it(viewport, qtbot, how):
    if how == "wheel":
        turn_wheel(viewport, 240)
    else:
        shift = Qt.KeyboardModifier.ShiftModifier
        drag(qtbot, viewport, Qt.MouseButton.LeftButton, shift if "shift" in how else Qt.KeyboardModifier.NoModifier)
    target, distance = viewport.camera.target_m.copy(), viewport.camera.distance_m
    show(viewport, qtbot, *sample(moved_by(hand_frame("left"), 3.0)))
    assert (viewport.camera.target_m == target).all() and viewport.camera.distance_m == distance


def test_fitting_by_key_before_the_first_hand_does_not_keep_it_out_of_view(viewport, qtbot):
    qtbot.keyClick(viewport, Qt.Key.Key_F)
    far = moved_by(hand_frame("left"), 3.0)
    show(viewport, qtbot, *sample(far))
    assert all_in_view(viewport, far)


def test_the_axes_at_the_origin_do_not_run_into_those_of_the_corner(viewport, qtbot):
    """Looked at so that the world's origin lies behind the corner's axes: nothing of it is seen on their plate."""
    gizmo = viewport.findChild(AxesGizmo)
    show(viewport, qtbot, *sample(extra_m=[(0.0, 5.0, 0.0)]))
    drawn = {}
    for axes in (True, False):
        viewport.camera.target_m, viewport.camera.distance_m = np.array([0.0, 0.0, 0.0]), 1.0
        viewport.view_front()
        x, y = gizmo.geometry().center().x(), gizmo.geometry().center().y()
        viewport.camera.pan((SIZE[0] / 2 - x) / SIZE[1], (y - SIZE[1] / 2) / SIZE[1])
        at = viewport.points_on_screen(np.zeros((1, 3)))[0]
        assert abs(at[0] - x) < 3 and abs(at[1] - y) < 3
        viewport._surface._scene.world_axes.visible = axes
        drawn[axes] = whole_picture(viewport, qtbot)
    changed = np.abs(drawn[True] - drawn[False]).sum(axis=2) > 30
    assert changed.any(), "the axes of the origin are drawn"
    yy, xx = np.nonzero(changed)
    ratio = drawn[True].shape[1] / viewport.width()
    radius = np.hypot(xx / ratio - x, yy / ratio - y).min()
    assert radius >= gizmo.width() / 2 - 3


def whole_picture(viewport, qtbot) -> np.ndarray:
    """Scene and overlays, (height, width, 3)."""
    with qtbot.waitSignal(viewport.drawn):
        viewport._refresh()
    image = viewport.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    data = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine() // 4, 4)
    return data[:, : image.width(), :3].astype(int)


def turn_wheel(widget, angle: int) -> None:
    at = QPointF(200, 200)
    event = QWheelEvent(
        at, widget.mapToGlobal(at), QPoint(), QPoint(0, angle), Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(widget, event)


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
