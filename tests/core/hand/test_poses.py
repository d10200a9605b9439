"""Named poses."""

from __future__ import annotations

import numpy as np
import pytest

from core.hand.poses import POSE_NAMES, pose


def test_rest_is_zero_and_all_differ() -> None:
    assert not pose("rest").any()
    table = np.stack([pose(name) for name in POSE_NAMES])
    assert table.shape == (len(POSE_NAMES), 20)
    apart = np.abs(table[:, None] - table[None]).max(axis=2) + np.eye(len(table))
    assert apart.min() > np.radians(4.0)


def test_an_unknown_pose_is_named() -> None:
    with pytest.raises(KeyError, match="salute"):
        pose("salute")


def test_a_pose_is_ones_own_copy() -> None:
    pose("fist")[:] = 0.0
    assert pose("fist").any()
