"""Draw poses of the library on sheets, with the application's own hand: python -m resources.motion.draw_poses DIR

Every pose is seen from the palm's thumb side and from the back. Needs a screen with OpenGL.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QColor, QImage, QPainter
from PySide6.QtWidgets import QApplication
from vispy import app as vispy_app
from vispy import gloo

from app.viewport.camera import OrbitCamera
from app.viewport.hand_visual import HandVisual
from core.frames import FloatArray
from core.hand.model import HandModel, template
from core.kinematics.forward import joints_world
from core.motion.library import ACTIVITIES, LIBRARY, LibraryPose, Prop

VIEWS_RAD = (math.radians(222.0), math.radians(-28.0))
CELL_PX = (148, 176)
COLUMNS, ROWS = 6, 5
HAND_COLOR, PROP_COLOR = (0.80, 0.62, 0.52), (0.35, 0.55, 0.75)
_UP = math.radians(90.0)


def main() -> None:
    """Write sheet_1.png and so on into a folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", metavar="NAME|ACTIVITY", help="these poses or activities")
    parser.add_argument("--columns", type=int, default=COLUMNS)
    parser.add_argument("--cell", type=float, default=1.0, help="size of a picture, 1 = 148 x 176 pixels")
    arguments = parser.parse_args()
    wanted = arguments.only or ACTIVITIES
    poses = [pose for pose in LIBRARY.values() if pose.name in wanted or pose.activity in wanted]
    arguments.folder.mkdir(parents=True, exist_ok=True)
    application = QApplication.instance() or QApplication([])
    cell = (round(CELL_PX[0] * arguments.cell), round(CELL_PX[1] * arguments.cell))
    count = arguments.columns * ROWS
    easel = Easel(arguments.columns, cell)
    for i in range(0, len(poses), count):
        path = arguments.folder / f"sheet_{i // count + 1}.png"
        easel.sheet(poses[i : i + count]).save(str(path))
        print(path)
    application.processEvents()


class Easel:
    """A canvas on which one sheet after the other is drawn."""

    def __init__(self, columns: int, cell: tuple[int, int]) -> None:
        self._columns, self._cell = columns, cell
        self._poses: Sequence[LibraryPose] = ()
        size = (columns * cell[0] * len(VIEWS_RAD), ROWS * cell[1])
        self._canvas = vispy_app.Canvas(app="pyside6", size=size, show=True, config={"depth_size": 24})
        self._hand: HandVisual | None = None
        self._canvas.events.draw.connect(self._draw)

    def _places(self) -> list[tuple[int, int]]:
        width, height = self._cell
        columns = self._columns
        return [(k % columns * len(VIEWS_RAD) * width, k // columns * height) for k in range(len(self._poses))]

    def sheet(self, poses: Sequence[LibraryPose]) -> QImage:
        """One picture of poses, in rows."""
        self._poses = poses
        image = QImage(self._canvas.native.grabFramebuffer()).convertToFormat(QImage.Format.Format_RGB888)
        rows = -(-len(poses) // self._columns)
        image = image.copy(0, 0, image.width(), rows * self._cell[1])
        painter = QPainter(image)
        painter.setPen(QColor(225, 228, 232))
        for pose, (left, top) in zip(poses, self._places(), strict=True):
            box = QRect(left + 4, top + 3, self._cell[0] * len(VIEWS_RAD) - 8, 20)
            painter.drawText(box, Qt.AlignmentFlag.AlignHCenter, pose.name.replace("_", " "))
        painter.end()
        return image

    def _draw(self, event: object) -> None:
        hand = self._hand = self._hand or HandVisual(template())
        width, height = self._cell
        gloo.clear(color=(0.13, 0.14, 0.16, 1.0), depth=True)
        for pose, (left, top) in zip(self._poses, self._places(), strict=True):
            for view, azimuth in enumerate(VIEWS_RAD):
                gloo.set_viewport(left + view * width, self._canvas.physical_size[1] - top - height, width, height)
                _draw_pose(hand, pose, azimuth, width / height)


def _draw_pose(hand: HandVisual, pose: LibraryPose, azimuth_rad: float, aspect: float) -> None:
    theta = np.concatenate([(0.0, 0.0, 0.0, _UP, 0.0, 0.0), pose.angles_rad])  # fingers up, back to the front
    joints = joints_world(template().skeleton, theta)
    camera = OrbitCamera(np.array([0.002, 0.088, -0.012]), 0.44, azimuth_rad, math.radians(12.0))
    visuals = [hand]
    hand.set_pose("right", joints, 1.0, np.zeros(16))
    hand.set_look(HAND_COLOR, 1.0)
    if pose.prop is not None:
        visuals.append(prop_visual(pose.prop, joints[0]))
    for visual in visuals:
        visual.visible = True
        visual.set_camera(camera.view(), camera.projection(aspect))
        visual.draw()


def prop_visual(prop: Prop, wrist_world: FloatArray) -> HandVisual:
    """A prop drawn as a hand of one bone."""
    mesh = prop_mesh(prop)
    n = len(mesh.vertices)
    of_one_bone = np.zeros((n, 4), np.int64), np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
    model = HandModel(template().skeleton, np.asarray(mesh.vertices), np.asarray(mesh.faces), *of_one_bone)
    visual = HandVisual(model)
    joints = np.tile(np.eye(4), (16, 1, 1))
    joints[0] = wrist_world @ prop.transform_hand
    visual.set_pose("right", joints, 1.0, np.zeros(16))
    visual.set_look(PROP_COLOR, 1.0)
    return visual


def prop_mesh(prop: Prop) -> trimesh.Trimesh:
    """The surface of a prop in its own frame, with sharp edges kept."""
    if prop.shape == "sphere":
        return trimesh.creation.icosphere(subdivisions=3, radius=prop.size_m[0] / 2)
    if prop.shape == "box":
        mesh = trimesh.creation.box(extents=prop.size_m)
    else:
        mesh = trimesh.creation.cylinder(radius=prop.size_m[0] / 2, height=prop.size_m[1], sections=48)
    mesh.unmerge_vertices()
    return mesh


if __name__ == "__main__":
    main()
