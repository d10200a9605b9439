"""Every angle of a hand on one picture: the axis that it turns about, and the hand with this angle alone.

    python -m app.viewport.axes_sheet docs/images/joint_axes.png

Without a display a virtual one is used.
"""

from __future__ import annotations

import argparse
import math
from contextlib import nullcontext
from pathlib import Path

import numpy as np
from PySide6.QtCore import QPointF, QRect, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import QApplication
from scipy.spatial.transform import Rotation

from app import theme
from app.viewport.camera import OrbitCamera
from app.viewport.contact_sheet import CAPTION_PX, FINGERS_UP_RAD, TILE_PX, WRIST_M, camera_of, contact_sheet
from app.virtual_display import has_display, virtual_display
from core.frames import FloatArray
from core.hand.model import template
from core.hand.shape import HandShape
from core.hand.skeleton import DIGIT_DOF_NAMES, DIGITS, DOF_JOINTS

COLUMNS = 4
"""Angles of a digit."""

BENT_RAD, SPREAD_RAD = math.radians(40.0), math.radians(20.0)
ZOOM = 1.15
BEHIND_M, AHEAD_M, ROUND_M = 0.022, 0.034, 0.014
"""Of the line about which an angle turns, from the joint; and the radius of the arrow that goes round it."""
ARROW_PX = 9.0


def axes_sheet(tile_px: int = TILE_PX) -> QImage:
    """One row per digit, one column per angle, of a right hand. Needs a QApplication and OpenGL."""
    high = tile_px + CAPTION_PX
    sheet = QImage(COLUMNS * tile_px, len(DIGITS) * high, QImage.Format.Format_RGB32)
    painter = QPainter(sheet)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    for view in {view_of(name) for name in DIGIT_DOF_NAMES}:
        seen = [k for k, name in enumerate(DIGIT_DOF_NAMES) if view_of(name) == view]
        poses = {caption(k): turned_rad(k) * np.eye(len(DIGIT_DOF_NAMES))[k] for k in seen}
        tiles = contact_sheet({"": HandShape.generic()}, poses, view, tile_px=tile_px, zoom=ZOOM)
        for column, k in enumerate(seen):
            place = QRect((k % COLUMNS) * tile_px, (k // COLUMNS) * high, tile_px, high)
            painter.drawImage(place, tiles, QRect(column * tile_px, 0, tile_px, high))
            painter.fillRect(QRect(place.x(), place.y(), tile_px, CAPTION_PX), QColor(theme.WINDOW))
            painter.setPen(QColor(theme.TEXT))
            painter.drawText(QRect(place.x(), place.y(), tile_px, CAPTION_PX), Qt.AlignmentFlag.AlignCenter, caption(k))
            painter.save()
            painter.translate(place.x(), place.y() + CAPTION_PX)
            _draw_axis(painter, camera_of(view, ZOOM), k, tile_px)
            painter.restore()
    painter.end()
    return sheet


def view_of(name: str) -> str:
    """From where an angle is seen best: a view of the contact sheet."""
    if name.startswith("thumb"):
        return "thumb" if name.endswith("_abduction") else "palm"
    if name.endswith("_abduction"):
        return "above"
    return "little" if name.startswith(("ring", "pinky")) else "aslant"


def turned_rad(k: int) -> float:
    """By how much the angle k is turned on the picture [rad]."""
    return SPREAD_RAD if DIGIT_DOF_NAMES[k].endswith("_abduction") else BENT_RAD


def caption(k: int) -> str:
    """What stands above the angle k."""
    return f"{DIGIT_DOF_NAMES[k]} +{math.degrees(turned_rad(k)):.0f}°"


def axis_world_m(k: int) -> tuple[FloatArray, FloatArray]:
    """(3,) [m] the joint, and (3,) the unit axis, of angle k on a right hand with its fingers up."""
    skeleton = template().skeleton
    up = Rotation.from_rotvec(FINGERS_UP_RAD)
    joint: FloatArray = WRIST_M + up.apply(skeleton.joint_positions_m[DOF_JOINTS[k]])
    return joint, up.apply(skeleton.axes[k])


def _draw_axis(painter: QPainter, camera: OrbitCamera, k: int, tile_px: int) -> None:
    joint, axis = axis_world_m(k)
    line = joint + np.outer(np.linspace(-BEHIND_M, AHEAD_M, 2), axis)
    side = np.cross(axis, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side)
    turns = Rotation.from_rotvec(np.outer(np.linspace(0.0, math.radians(290.0), 40), axis))
    ring = joint + 0.5 * AHEAD_M * axis + ROUND_M * turns.apply(side)
    for points, colour in ((line, theme.ACCENT), (ring, theme.WARNING)):
        px = camera.project(points, (tile_px, tile_px))[:, :2]
        painter.setPen(QPen(QColor(colour), 2.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(QPolygonF([QPointF(*point) for point in px.tolist()]))
        _draw_head(painter, px[-1], px[-1] - px[-3 if len(px) > 2 else 0], QColor(colour))


def _draw_head(painter: QPainter, tip: FloatArray, way: FloatArray, colour: QColor) -> None:
    length = float(np.linalg.norm(way))
    if length < 1e-3:
        return  # it points at the viewer
    along = way / length * ARROW_PX
    across = np.array([-along[1], along[0]]) * 0.45
    painter.setBrush(colour)
    painter.drawPolygon(
        QPolygonF([QPointF(*point) for point in (tip + along * 0.4, tip - along + across, tip - along - across)])
    )


def main() -> None:
    """The command line of this module."""
    parser = argparse.ArgumentParser(description="Draw every angle of a hand with its axis.")
    parser.add_argument("out", metavar="PNG", type=Path)
    arguments = parser.parse_args()
    with nullcontext() if has_display() else virtual_display():
        application = QApplication([])
        axes_sheet().save(str(arguments.out))
        application.shutdown()


if __name__ == "__main__":
    main()
