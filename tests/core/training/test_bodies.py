from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from core.hand.anthropometry import shape_prior
from core.hand.model import template
from core.hand.shape import HandShape, bone_maps, shaped_points, shaped_skeleton
from core.kinematics.forward import joints_world, markers_world
from core.markers.layout import load_layout
from core.motion.capsules import Flesh
from core.training.bodies import posed, shaped_maps
from tests.some import some

SKELETON = template().skeleton
LAYOUT = load_layout("han19")


def some_hands(n: int) -> tuple[np.ndarray, np.ndarray]:
    random, prior = np.random.default_rng(3), shape_prior()
    theta = np.concatenate([random.normal(0.0, 1.0, (n, 6)), random.uniform(*SKELETON.limits_rad.T, (n, 20))], axis=1)
    return theta, np.exp(random.multivariate_normal(prior.mean_log, prior.covariance_log, n))


def test_many_hands_at_once_are_each_the_hand_that_the_solver_knows() -> None:
    theta, ratios = some_hands(6)
    bodies = posed(theta[:, 6:], Rotation.from_rotvec(theta[:, 3:6]).as_matrix(), theta[:, :3], ratios)
    markers = bodies.carried(LAYOUT.joints, LAYOUT.positions_m)
    for i in some(range(len(theta))):
        shape = HandShape(ratios[i])
        skeleton = shaped_skeleton(SKELETON, shape)
        worn = shaped_points(SKELETON, shape, LAYOUT.joints, LAYOUT.positions_m)
        np.testing.assert_allclose(shaped_maps(ratios)[i], bone_maps(SKELETON, shape), atol=1e-14)
        np.testing.assert_allclose(bodies.joints_m[i], joints_world(skeleton, theta[i])[:, :3, 3], atol=1e-13)
        np.testing.assert_allclose(markers[i], markers_world(skeleton, theta[i], LAYOUT.joints, worn), atol=1e-13)


def test_capsules_of_the_template_are_those_of_the_performer() -> None:
    theta, _ = some_hands(5)
    bodies = posed(theta[:, 6:], Rotation.from_rotvec(theta[:, 3:6]).as_matrix(), theta[:, :3], np.ones((5, 23)))
    flesh = Flesh(SKELETON, 1.0)
    expected = flesh.posed(theta)
    np.testing.assert_allclose(bodies.starts_m, expected.starts_m, atol=1e-13)
    np.testing.assert_allclose(bodies.ends_m, expected.ends_m, atol=1e-13)
    np.testing.assert_allclose(bodies.radii_m, np.tile(flesh.radii_m, (5, 1)), atol=1e-15)
