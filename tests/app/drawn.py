"""A viewport that is shown, and what is drawn in it: pixels, not calls."""

from __future__ import annotations

import sys
from ctypes.util import find_library

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QImage, QPainter, QPolygonF
from PySide6.QtWidgets import QApplication

from app.viewport.drawing_surface import DrawingSurface
from app.viewport.gl_support import gl_support
from app.viewport.viewport import Viewport
from core.hand.mirror import mirror_points, mirror_transforms
from core.hand.model import skin, template
from tests.app.hand_frames import profile

SIZE = (640, 480)


def need_opengl() -> None:
    """Skips the test where no OpenGL can be: its library is not there. Where it is, Phalanx has to find it."""
    if sys.platform == "linux" and not (find_library("GL") and find_library("EGL")):
        pytest.skip("needs OpenGL (libgl1, libegl1)")
    if QApplication.platformName() == "offscreen":
        pytest.skip("needs a display; offscreen was asked for (QT_QPA_PLATFORM)")


@pytest.fixture
def viewport(qtbot):
    need_opengl()
    assert gl_support().reason == ""
    widget = Viewport()
    qtbot.addWidget(widget)
    widget.resize(*SIZE)
    with qtbot.waitExposed(widget):
        widget.show()
    return widget


def show(viewport: Viewport, qtbot, *args) -> None:
    with qtbot.waitSignal(viewport.drawn):
        viewport.show_frame(*args, profile())


def pixels(viewport: Viewport) -> np.ndarray:
    """(height, width, 3) int, the scene without what lies over it."""
    image = viewport.findChild(DrawingSurface).image().convertToFormat(QImage.Format.Format_RGB888)
    raw = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    return raw[:, : image.width() * 3].reshape(image.height(), image.width(), 3).astype(int)


def pixel_at(viewport: Viewport, point_m) -> np.ndarray:
    x, y, _ = viewport.points_on_screen(np.asarray(point_m, float)[None])[0]
    return pixels(viewport)[round(y), round(x)]


def surface_m(hand, model=None) -> np.ndarray:
    """What core says the skin of a hand of either side is. model: the template unless given."""
    model = (model or template()).scaled(hand.scale)
    if hand.side == "right":
        return skin(model, hand.joints_world)
    return mirror_points(skin(model, mirror_transforms(hand.joints_world)))


def silhouette(viewport: Viewport, vertices_m: np.ndarray) -> np.ndarray:
    """(height, width) bool: the surface, projected and filled without OpenGL."""
    screen = viewport.points_on_screen(vertices_m)
    width, height = viewport.width(), viewport.height()
    image = QImage(width, height, QImage.Format.Format_Grayscale8)
    image.fill(0)
    painter = QPainter(image)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(Qt.GlobalColor.white)
    for corners in screen[template().faces][:, :, :2]:
        painter.drawPolygon(QPolygonF([QPointF(x, y) for x, y in corners]))
    painter.end()
    return np.frombuffer(image.constBits(), np.uint8).reshape(height, image.bytesPerLine())[:, :width] > 0
