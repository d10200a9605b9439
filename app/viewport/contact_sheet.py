"""Hands in many shapes and poses on one picture, drawn by the 3D view's own scene: to be looked at.

    python -m app.viewport.contact_sheet docs/images/hand_shapes.png
    python -m app.viewport.contact_sheet sheet.png --shapes XS,L --poses fist,writing_tripod --view palm

Without a display a virtual one is used.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path

import numpy as np
from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QColor, QImage, QPainter
from PySide6.QtWidgets import QApplication, QWidget

from app import theme
from app.viewport.camera import OrbitCamera
from app.viewport.drawing_surface import DrawingSurface
from app.viewport.marker_states import marker_view
from app.viewport.scene import Scene
from app.virtual_display import has_display, virtual_display
from core.frames import FloatArray, HandFrame, HandState, Side, Times, TrackedFrame
from core.hand.mirror import mirror_transforms
from core.hand.model import HandModel, template
from core.hand.poses import POSE_NAMES, pose
from core.hand.shape import HandShape, shaped_hand
from core.hand.sizes import SIZES
from core.kinematics.forward import joints_world
from core.motion.library import LIBRARY

TILE_PX = 240
CAPTION_PX = 20
WRIST_M = np.asarray([0.0, 1.5, 0.0])
CENTRE_M = WRIST_M + (-0.012, 0.082, 0.0)
DISTANCE_M = 0.47
FINGERS_UP_RAD = np.asarray([math.pi / 2, 0.0, 0.0])
VIEWS_RAD = {
    "back": (0.35, 0.15),
    "palm": (math.pi - 0.35, 0.15),
    "thumb": (-math.pi / 2, 0.1),
    "end": (0.3, 1.1),
    "aslant": (-1.0, 0.3),
    "little": (1.15, 0.3),
    "above": (0.75, 0.45),
}
"""Azimuth and elevation of the camera for fingers up, back to the viewer."""

EIGHT_POSES = ("rest", "spread", "relaxed", "fist", "pinch_index", "hook", "thumbs_up", "peace")


def contact_sheet(
    shapes: Mapping[str, HandShape],
    poses: Mapping[str, FloatArray],
    view: str = "back",
    *,
    side: Side = "right",
    tile_px: int = TILE_PX,
    zoom: float = 1.0,
) -> QImage:
    """One row per shape, one column per pose, all at the same magnification. Needs a QApplication and OpenGL.

    poses: (20,) float64 [rad] by name. view: one of VIEWS_RAD.
    """
    camera = camera_of(view, zoom)
    shown: tuple[HandModel, TrackedFrame] | None = None

    def draw(scene: Scene, size_px: tuple[int, int], pixel_ratio: float) -> None:
        if shown is not None:
            scene.set_models((shown[0],))
            scene.set_frame(None, shown[1], marker_view(None, None, None))
        scene.draw(camera, size_px, pixel_ratio)

    parent = QWidget()
    surface = DrawingSurface(parent, lambda: Scene(template()), draw)
    parent.resize(tile_px, tile_px)
    surface.resize(tile_px, tile_px)
    parent.show()
    high = tile_px + CAPTION_PX
    sheet = QImage(tile_px * len(poses), high * len(shapes), QImage.Format.Format_RGB32)
    sheet.fill(QColor(theme.WINDOW))
    painter = QPainter(sheet)
    painter.setPen(QColor(theme.TEXT))
    for row, (shape_name, shape) in enumerate(shapes.items()):
        hand = shaped_hand(template(), shape)
        for column, (pose_name, angles_rad) in enumerate(poses.items()):
            shown = hand, _tracked(hand, angles_rad, side)
            caption = QRect(column * tile_px, row * high, tile_px, CAPTION_PX)
            painter.drawText(caption, Qt.AlignmentFlag.AlignCenter, f"{shape_name}, {pose_name}")
            painter.drawImage(QRect(column * tile_px, row * high + CAPTION_PX, tile_px, tile_px), surface.image())
    painter.end()
    parent.deleteLater()
    return sheet


def camera_of(view: str, zoom: float = 1.0) -> OrbitCamera:
    """What a tile is seen through. view: one of VIEWS_RAD."""
    return OrbitCamera(CENTRE_M, DISTANCE_M / zoom, *VIEWS_RAD[view])


def _tracked(hand: HandModel, angles_rad: FloatArray, side: Side) -> TrackedFrame:
    """A frame of one hand without markers, fingers up."""
    theta_rad = np.concatenate([WRIST_M, FINGERS_UP_RAD, angles_rad])
    joints = joints_world(hand.skeleton, theta_rad)
    if side == "left":
        joints = mirror_transforms(joints)
    none, unknown = np.zeros(0), np.full(26, np.nan)
    state = HandState.TRACKED
    frame = HandFrame(
        side, state, theta_rad, joints, np.zeros((0, 3)), none.astype(np.int64), none, unknown, none, 0.0, 1.0
    )
    return TrackedFrame(0, Times(0.0, 0.0, 0.0), (frame,))


def main() -> None:
    """The command line of this module."""
    parser = argparse.ArgumentParser(description="Draw hands in many shapes and poses.")
    parser.add_argument("out", metavar="PNG", type=Path)
    parser.add_argument("--shapes", default="XS,M,XL", help="sizes, or generic; default %(default)s")
    parser.add_argument(
        "--poses", default=",".join(EIGHT_POSES), help="of core.hand.poses or the pose library; default %(default)s"
    )
    parser.add_argument("--view", choices=tuple(VIEWS_RAD), default="back")
    arguments = parser.parse_args()
    known = {"generic": HandShape.generic(), **SIZES}
    poses = {name: entry.angles_rad for name, entry in LIBRARY.items()} | {name: pose(name) for name in POSE_NAMES}
    with nullcontext() if has_display() else virtual_display():
        application = QApplication([])
        sheet = contact_sheet(
            {name: known[name] for name in arguments.shapes.split(",")},
            {name: poses[name] for name in arguments.poses.split(",")},
            arguments.view,
        )
        sheet.save(str(arguments.out))
        application.shutdown()


if __name__ == "__main__":
    main()
