"""Frames with known hands for tests of what is drawn: han19 on hands held over the floor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from core.frames import NO_POINT, HandFrame, HandState, MarkerFrame, RigidBody, Side, Times, TrackedFrame
from core.hand.mirror import mirror_points, mirror_transforms
from core.kinematics.forward import joints_world, markers_world
from core.profile import Profile, load_profile

PLACE_M = {"right": (0.14, 1.0, 0.05), "left": (-0.14, 1.05, 0.0)}
CURLED = np.array([0.2, 0.1, 0.2, 0.2] + [0.05, 0.5, 0.6, 0.3] * 4)


def profile() -> Profile:
    """A generic pair of hands with the dense layout."""
    return load_profile("han19")


def hand_frame(
    side: Side,
    *,
    state: HandState = HandState.TRACKED,
    hidden: tuple[int, ...] = (),
    scale: float = 1.0,
    curl=CURLED,
    worn: Profile | None = None,
) -> HandFrame:
    """One hand of `worn` (None: `profile`); its marker k comes from point k of a frame that holds only it."""
    performer = worn or profile()
    layout = performer.worn
    skeleton = performer.hand.skeleton.scaled(scale)
    theta = np.zeros(26)
    x, y, z = PLACE_M[side]
    theta[:3] = (abs(x), y, z)
    theta[3:6] = (0.2, -0.3, 0.1)
    theta[6:] = curl
    joints = joints_world(skeleton, theta)
    markers = markers_world(skeleton, theta, layout.joints, layout.positions_m * scale)
    if side == "left":
        joints, markers = mirror_transforms(joints), mirror_points(markers)
    point = np.arange(len(markers))
    point[list(hidden)] = NO_POINT
    m = len(markers)
    return HandFrame(
        side, state, theta, joints, markers, point, np.ones(m), np.full(26, np.nan), np.full(m, np.nan), 0.0012, scale
    )


def sample(
    *hands: HandFrame,
    extra_m: object = (),
    bodies: tuple[RigidBody, ...] = (),
    sequence: int = 0,
) -> tuple[MarkerFrame, TrackedFrame]:
    """A frame of all observed markers of all hands, in order, then `extra_m` (n, 3); and what the engine says."""
    points: list[np.ndarray] = []
    renumbered = []
    for hand in hands:
        point = np.full_like(hand.point, NO_POINT)
        for k in np.flatnonzero(hand.observed):
            point[k] = len(points)
            points.append(hand.markers_world_m[k])
        renumbered.append(replace(hand, point=point))
    points_m = np.concatenate([np.reshape(points, (-1, 3)), np.reshape(np.asarray(extra_m, float), (-1, 3))])
    times = Times(sequence / 100, sequence / 100, sequence / 100)
    n = len(points_m)
    frame = MarkerFrame(sequence, times, points_m, np.arange(n), np.full(n, np.nan), bodies)
    return frame, TrackedFrame(sequence, times, tuple(renumbered))
