"""Who is measured: hands whose angles are known, wearing a layout as well as somebody put it on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Protocol

import numpy as np

from app.angle_bench.mapping import zeros_rad
from app.angle_bench.motion import Motion, held_first, independent, performed
from app.angle_bench.put_on import off, places, put_on
from app.angle_bench.rig import read_rig
from app.people import shape_of
from core.frames import FloatArray, IntArray, MarkerFrame, Side
from core.hand.model import HandModel, skin, template
from core.kinematics.forward import joints_world, markers_world
from core.kinematics.prior import N_ANGLES
from core.markers.layout import MarkerLayout
from core.motion.stream import MarkerStream
from core.profile import Profile

SIDE: Side = "right"

_NOTHING = MarkerLayout("none", "", (SIDE,), (), np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
_NOBODY = Profile("", _NOTHING, (SIDE,), 1.0)

Moved = FloatArray
"""(n, m, 3) float64 [m], where the markers truly are."""


@dataclass(frozen=True)
class Setting:
    """How a recording is made: rate [Hz], seconds of each stretch, noise of a coordinate and sliding of skin [m]."""

    rate_hz: float
    seconds: float
    noise_m: float
    skin_m: float


@dataclass(frozen=True)
class Known:
    """A motion, and what is true of it. angles_rad: (n, 20) float64 [rad], from our zeros."""

    motion: Motion
    angles_rad: FloatArray


class Subject(Protocol):
    """A hand with known angles. calibration: how it moves to be calibrated; measured: held flat, then moving."""

    @property
    def calibration(self) -> Known:
        """Another stretch than the one measured."""
        ...

    @property
    def measured(self) -> Known:
        """What the figures are of."""
        ...

    def wear(self, layout: MarkerLayout, off_m: float, random: np.random.Generator) -> Worn:
        """Put the markers on, each `off_m` from its place along the skin."""
        ...

    def true(self, layout: MarkerLayout, off_m: float, random: np.random.Generator) -> Profile | None:
        """What a calibration would find that errs in nothing, the markers put on as by `wear`; None where no hand of
        ours is this one."""
        ...


class Worn(Protocol):
    """Markers on a hand."""

    def moved(self, motion: Motion) -> Moved:
        """Where they go."""
        ...


@dataclass(frozen=True)
class Person:
    """A made person: our own hand in a shape of the population. waves: moves by independent waves of every angle
    instead of as the built-in performer does."""

    seed: int
    size: float
    setting: Setting
    waves: bool = False

    @cached_property
    def profile(self) -> Profile:
        """Who it truly is, with nothing on."""
        return replace(_NOBODY, shape=shape_of(np.random.default_rng([self.seed, 1]), self.size))

    @cached_property
    def calibration(self) -> Known:
        """Every joint through its range, as the pages on calibration ask for."""
        return self._known(2, "range")

    @cached_property
    def measured(self) -> Known:
        """Held flat, then poses of every kind."""
        known = self._known(3, "free")
        motion = held_first(known.motion, np.random.default_rng([self.seed, 4]), self.setting.rate_hz)
        return Known(motion, motion.digits_rad)

    def wear(self, layout: MarkerLayout, off_m: float, random: np.random.Generator) -> Worn:
        """On the template, as layouts are; the shape then carries them to this hand."""
        return _OnBones(self.true(layout, off_m, random))

    def true(self, layout: MarkerLayout, off_m: float, random: np.random.Generator) -> Profile:
        """The shape, and each marker's place on it."""
        spots = [put_on(template(), off(template(), place, off_m, random)) for place in places(layout)]
        return replace(self.profile, layout=replace(layout, positions_m=np.array([spot.point_m for spot in spots])))

    def _known(self, turn: int, activity: str) -> Known:
        s = self.setting
        if self.waves:
            motion = independent(np.random.default_rng([self.seed, turn]), s.seconds, s.rate_hz)
        else:
            motion = performed(self.profile, self.seed, activity, s.seconds, s.rate_hz)
        return Known(motion, motion.digits_rad)


@dataclass(frozen=True)
class _OnBones:
    worn: Profile

    def moved(self, motion: Motion) -> Moved:
        """Each with its bone."""
        skeleton, layout = self.worn.hand.skeleton, self.worn.worn
        return np.array([markers_world(skeleton, t, layout.joints, layout.positions_m) for t in motion.thetas_rad])


@dataclass(frozen=True)
class WebXR:
    """The generic hand of WebXR. True are its own 20 angles, each about its own axis, from our zeros (app.angle_bench.
    mapping). waves: moves by independent waves of every angle; else by the built-in performer's angles, as if they were
    its own."""

    folder: Path
    seed: int
    setting: Setting
    waves: bool = True
    hand: HandModel = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "hand", read_rig(self.folder))

    @cached_property
    def calibration(self) -> Known:
        """Another motion than the one measured."""
        return self._known(self._moving(2, "range"))

    @cached_property
    def measured(self) -> Known:
        """Held as its bones are bound, which is flat, then moving."""
        moving = self._moving(3, "free")
        return self._known(held_first(moving, self._random(4), self.setting.rate_hz, np.zeros(N_ANGLES)))

    def wear(self, layout: MarkerLayout, off_m: float, random: np.random.Generator) -> Worn:
        """On its own skin, by the rule of app.angle_bench.put_on."""
        spots = [put_on(self.hand, off(self.hand, place, off_m, random)) for place in places(layout)]
        return _OnSkin(self.hand, np.array([spot.point_m for spot in spots]), np.array([spot.face for spot in spots]))

    def true(self, layout: MarkerLayout, off_m: float, random: np.random.Generator) -> None:
        """No shape of ours is this hand."""

    def _random(self, turn: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, turn])

    def _moving(self, turn: int, activity: str) -> Motion:
        s = self.setting
        if self.waves:
            return independent(self._random(turn), s.seconds, s.rate_hz)
        return performed(_NOBODY, self.seed, activity, s.seconds, s.rate_hz)

    def _known(self, motion: Motion) -> Known:
        return Known(motion, motion.digits_rad + zeros_rad(self.hand.skeleton))


@dataclass(frozen=True)
class _OnSkin:
    """points_m: (m, 3) float64 [m] at rest. faces: (m,) int64, each marker is fixed to the triangle below it."""

    hand: HandModel
    points_m: FloatArray
    faces: IntArray

    def moved(self, motion: Motion) -> Moved:
        """Each with the skin below it, by linear blend skinning of the corners of its triangle."""
        corners, own = self.hand.faces[self.faces].ravel(), self.hand
        part = replace(
            own, vertices_m=own.vertices_m[corners], skin_joints=own.skin_joints[corners],
            skin_weights=own.skin_weights[corners],
        )  # fmt: skip
        start, axes = _triangles(part.vertices_m)
        local = np.einsum("mab,ma->mb", axes, self.points_m - start)
        moved = np.empty((len(motion.digits_rad), len(self.points_m), 3))
        for i, theta in enumerate(motion.thetas_rad):
            start, axes = _triangles(skin(part, joints_world(own.skeleton, theta)))
            moved[i] = start + np.einsum("mab,mb->ma", axes, local)
        return moved


def _triangles(corners_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centres (m, 3) [m] and frames (m, 3, 3), columns: along an edge, in the face, its normal, of (3 m, 3) corners."""
    a, b, c = corners_m.reshape(-1, 3, 3).transpose(1, 0, 2)
    x, normal = b - a, np.cross(b - a, c - a)
    x, normal = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (x, normal))
    return (a + b + c) / 3.0, np.stack([x, np.cross(normal, x), normal], axis=2)


@dataclass
class _Track:
    """Trajectories for a MarkerStream."""

    labels: tuple[str, ...]
    points_m: Moved

    def positions(self, rate_hz: float) -> Iterator[tuple[float, FloatArray]]:
        """Every frame once."""
        return ((i / rate_hz, points) for i, points in enumerate(self.points_m))


def seen(points_m: Moved, layout: MarkerLayout, setting: Setting, seed: int) -> list[MarkerFrame]:
    """As cameras see the markers: with noise, on skin that slides. The id of a point is the index of its marker."""
    stream = MarkerStream(
        _Track(layout.marker_names, points_m), setting.rate_hz, seed, noise_m=setting.noise_m, skin_m=setting.skin_m
    )
    return [replace(one.frame, ids=one.truth) for one in islice(stream.labelled(), len(points_m))]


def names(layout: MarkerLayout) -> dict[int, tuple[Side, int]]:
    """What the ids of `seen` say."""
    return {k: (SIDE, k) for k in range(len(layout.joints))}
