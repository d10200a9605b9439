"""The picture of the axes shows the axes about which the hand turns."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.viewport.axes_sheet import COLUMNS, axes_sheet, axis_world_m, caption, turned_rad
from app.viewport.contact_sheet import CAPTION_PX, FINGERS_UP_RAD, WRIST_M
from core.hand.model import template
from core.hand.skeleton import DIGIT_DOF_NAMES, DOF_JOINTS
from core.kinematics.forward import joints_world
from tests.app.drawn import need_opengl

TILE_PX = 96


@pytest.mark.parametrize("k", range(20), ids=DIGIT_DOF_NAMES)
def test_the_hand_turns_about_the_line_that_is_drawn(k):
    skeleton = template().skeleton
    rest = np.concatenate([WRIST_M, FINGERS_UP_RAD, np.zeros(20)])
    moved = rest.copy()
    moved[6 + k] = turned_rad(k)
    before, after = joints_world(skeleton, rest), joints_world(skeleton, moved)
    joint, axis = axis_world_m(k)
    turn = Rotation.from_rotvec(turned_rad(k) * axis)
    own = DOF_JOINTS[k]
    last = own - (own - 1) % 3 + 2  # of the digit
    np.testing.assert_allclose(after[last, :3, 3], joint + turn.apply(before[last, :3, 3] - joint), atol=1e-12)
    np.testing.assert_allclose(after[last, :3, :3], turn.as_matrix() @ before[last, :3, :3], atol=1e-12)


def test_every_angle_has_a_tile(qtbot):
    need_opengl()
    sheet = axes_sheet(TILE_PX)
    assert (sheet.width(), sheet.height()) == (COLUMNS * TILE_PX, 5 * (TILE_PX + CAPTION_PX))
    assert caption(5) == "index_mcp_flexion +40°"
    for k in range(20):
        tile = sheet.copy(
            (k % COLUMNS) * TILE_PX, (k // COLUMNS) * (TILE_PX + CAPTION_PX) + CAPTION_PX, TILE_PX, TILE_PX
        )
        colours = {tile.pixelColor(x, y).name() for x in range(TILE_PX) for y in range(TILE_PX)}
        assert {"#4a9eff", "#f0b13c"} <= colours, caption(k)
