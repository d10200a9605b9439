from __future__ import annotations

import numpy as np
from scipy.spatial.distance import pdist

from core.calibration.keyframes import farthest_points


def test_corners_are_farthest() -> None:
    random = np.random.default_rng(0)
    corners = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
    cloud = np.concatenate([0.2 + 0.6 * random.random((200, 2)), corners])
    assert set(farthest_points(cloud, 4)) == {200, 201, 202, 203}


def test_spread_is_wider_than_that_of_chance() -> None:
    random = np.random.default_rng(1)
    cloud = random.normal(0.0, 1.0, (500, 20))
    chosen = farthest_points(cloud, 30)
    assert len(chosen) == len(set(chosen)) == 30
    assert np.array_equal(chosen, np.sort(chosen))
    by_chance = max(pdist(cloud[random.choice(500, 30, replace=False)]).min() for _ in range(200))
    assert pdist(cloud[chosen]).min() > by_chance


def test_few_are_all() -> None:
    assert np.array_equal(farthest_points(np.zeros((5, 20)), 10), np.arange(5))
    assert len(farthest_points(np.zeros((5, 20)), 3)) == 3
