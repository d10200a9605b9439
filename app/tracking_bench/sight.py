"""Which markers of a performance the cameras of a studio see, past both hands and what they hold."""

from __future__ import annotations

import numpy as np

from core.frames import SIDES, FloatArray, IntArray
from core.motion.library import Prop
from core.motion.performer import Performer
from core.training import kernels
from core.training.clouds import prop_capsules

STUDIO = 16
"""Cameras around the volume (Han 2018, 4.1 and Fig. 5)."""

_ROOM_M = (1.9, 1.6)  # to the side and forward of the hands
_HEIGHTS_M = (2.3, 1.5)  # every other one hangs high
_MIDDLE_M = np.array([0.0, 0.0, -0.33])

_RING_PARTS, _RING_M, _RING_TUBE_M, _RING_BEYOND_M = 8, 0.055, 0.007, 0.01

Capsules = tuple[FloatArray, FloatArray, FloatArray]
"""Ends (f, c, 3), (f, c, 3) and radii (f, c) [m] at f times, in the world."""


def studio(n: int = STUDIO) -> FloatArray:
    """(n, 3) [m]: cameras all around where the performer's hands are."""
    turn = 2.0 * np.pi * (np.arange(n) + 0.5) / n
    heights = np.resize(np.asarray(_HEIGHTS_M), n)
    return _MIDDLE_M + np.stack([_ROOM_M[0] * np.cos(turn), heights, _ROOM_M[1] * np.sin(turn)], axis=1)


def sightings(markers_m: FloatArray, in_the_way: Capsules, cameras_m: FloatArray) -> IntArray:
    """(f, n) int64: how many cameras see each of n points at f times. markers_m: (f, n, 3) [m], NaN where there is
    none."""
    counts = np.zeros(markers_m.shape[:2], dtype=np.int64)
    seen = np.empty(markers_m.shape[:2], dtype=np.bool_)
    ones = np.ones(len(markers_m), dtype=np.int64)
    for camera in cameras_m:
        view = np.ascontiguousarray(np.broadcast_to(camera, (len(markers_m), 1, 3)))
        kernels.seen(markers_m, view, ones, *in_the_way, ones, seen)
        counts += seen
    return counts


def in_the_way(performer: Performer, times_s: FloatArray, ring: bool = False) -> Capsules:
    """What stands in for both hands and every prop at times (f,) [s]. ring: the props are controllers with a ring."""
    parts: list[Capsules] = []
    for side in SIDES:
        posed = performer.flesh_world(side, times_s)
        radii = np.broadcast_to(performer.flesh.radii_m, posed.starts_m.shape[:2])
        parts.append((posed.starts_m, posed.ends_m, radii))
    placed = [performer.props_world(time_s) for time_s in times_s]
    for name, prop in performer.props.items():
        world = np.stack([props[name] for props in placed])
        shape = [prop_capsules(prop), _ring(prop)] if ring else [prop_capsules(prop)]
        starts, ends, radii = (np.concatenate(one) for one in zip(*shape, strict=True))
        moved = [np.einsum("fab,kb->fka", world[:, :3, :3], own) + world[:, None, :3, 3] for own in (starts, ends)]
        parts.append((moved[0], moved[1], np.broadcast_to(radii, (len(times_s), len(radii)))))
    starts, ends, radii = (np.ascontiguousarray(np.concatenate(one, axis=1)) for one in zip(*parts, strict=True))
    return starts, ends, radii


def _ring(prop: Prop) -> Capsules:
    """The ring about the thumb's end of a controller's handle, open in the middle, in the prop's frame."""
    turn = 2.0 * np.pi * np.arange(_RING_PARTS + 1) / _RING_PARTS
    end_m = -0.5 * prop.size_m[1] - _RING_BEYOND_M
    circle = np.stack([_RING_M * np.cos(turn), _RING_M * np.sin(turn), np.full(len(turn), end_m)], axis=1)
    return circle[:-1], circle[1:], np.full(_RING_PARTS, _RING_TUBE_M)
