"""The contact sheet shows every shape in every pose, each where it belongs and as large as it is."""

from __future__ import annotations

import numpy as np
from PySide6.QtGui import QImage

from app.viewport.contact_sheet import CAPTION_PX, EIGHT_POSES, contact_sheet
from core.hand.poses import pose
from core.hand.shape import HandShape
from tests.app.drawn import need_opengl

TILE_PX = 160


def test_rows_are_shapes_and_columns_are_poses(qtbot):
    need_opengl()
    shapes = {"small": HandShape.uniform(0.8), "large": HandShape.uniform(1.0)}
    names = EIGHT_POSES[:4]
    sheet = contact_sheet(shapes, {name: pose(name) for name in names}, tile_px=TILE_PX)
    assert (sheet.width(), sheet.height()) == (4 * TILE_PX, 2 * (TILE_PX + CAPTION_PX))
    raw = sheet.convertToFormat(QImage.Format.Format_RGB888)
    pixels = np.frombuffer(raw.constBits(), np.uint8).reshape(raw.height(), raw.bytesPerLine())[:, : 3 * raw.width()]
    rows = pixels.reshape(2, TILE_PX + CAPTION_PX, 4, TILE_PX, 3)[:, CAPTION_PX:].astype(int)
    covered = (rows.min(axis=-1) > 75).sum(axis=(1, 3))  # skin is brighter than the background
    assert (covered[:, names.index("fist")] < 0.8 * covered[:, names.index("spread")]).all()
    np.testing.assert_allclose(covered[0] / covered[1], 0.64, atol=0.05)  # areas
