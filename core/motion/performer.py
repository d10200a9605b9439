"""A synthetic performer: two hands that move as a person's do, for trying a setup without one.

A performance is a score of minimum-jerk submovements (Flash and Hogan 1985) that one person plays: acts of an activity
(core.motion.activities), each posture taken in this person's way (core.motion.person), over sway and tremor; what would
pass through each other is eased apart (core.motion.easing). It is written once, sampled, and read as a uniform cubic
B-spline, so the motion is a function of time alone: the same seed gives the same motion at any frame rate, twice
differentiable, and after PERIOD_S it begins again without a seam.

World: Y up, floor at 0, the performer stands at the origin and faces -Z.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from core.errors import PhalanxError
from core.frames import SIDES, FloatArray, Side
from core.hand.mirror import mirror_points, mirror_theta, mirror_transforms
from core.hand.model import template
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS, Skeleton
from core.kinematics import forward
from core.motion.activities import ACTIVITIES
from core.motion.acts.free import postures
from core.motion.capsules import Flesh, Posed
from core.motion.easing import PropPath, eased
from core.motion.library import Prop
from core.motion.person import Person
from core.motion.stage import LEFT, RIGHT, Hold, OverTime, Stage, in_terms_of, names_of, transform_of
from core.motion.unrest import unrest
from core.profile import Profile

PERIOD_S = 60.0
START_STILL_S = 1.5
"""The performer begins with relaxed open hands and holds them for this long."""

DEFAULT_ACTIVITY = "free"
KNOTS_HZ = 60.0
_N_KNOTS = round(PERIOD_S * KNOTS_HZ)
_LAST_ACT_S = 57.4  # by then everything is on its way back to the start
_SHORTEST_ACT_S = 4.0
_PERSON = 77  # sets a person's random numbers apart from those of any choreography
_EASED_EVERY = 2  # knots
_OWN_LIMITS_RAD = np.radians(0.5)
_TEMPLATE_BONE_M = float(np.mean(template().skeleton.bone_lengths_m[1:]))


@dataclass(frozen=True, slots=True)
class PerformerFrame:
    """What is true at one instant, per hand of the performer.

    theta_rad: (26,) float64 as in core.frames.HandFrame. joints_world: (16, 4, 4) float64.
    markers_world_m: (m, 3) float64 [m], in the order of the layout. props_world: (4, 4) float64 of every prop, by name.
    """

    time_s: float
    theta_rad: dict[Side, FloatArray]
    joints_world: dict[Side, FloatArray]
    markers_world_m: dict[Side, FloatArray]
    props_world: dict[str, FloatArray] = field(default_factory=dict)


@dataclass(frozen=True)
class Performance:
    """knots: (2, _N_KNOTS, 26), left (in the mirror) and right. props: by name. holds: of every prop, in the order of
    time, the first from time 0 on."""

    knots: FloatArray
    props: Mapping[str, Prop]
    holds: tuple[tuple[Hold, ...], ...]


class Performer:
    """Both hands of `profile`, wearing its layout at its scale (1 if the profile leaves it open).

    activity: one of core.motion.activities.ACTIVITIES. person: seed of who moves, by default `seed` itself; with
    another `seed` the same person does the same kind of thing again. props: what there is to hold, by name; its size
    in proportion to the hand. flesh: of either hand. Raises PhalanxError for an unknown activity.
    """

    def __init__(
        self, profile: Profile, seed: int = 0, activity: str = DEFAULT_ACTIVITY, person: int | None = None
    ) -> None:
        if activity not in ACTIVITIES:
            raise PhalanxError(f"No activity {activity!r}.", "Choose one of " + ", ".join(ACTIVITIES) + ".")
        self.profile, self.seed, self.activity = profile, seed, activity
        self.scale = 1.0 if profile.scale is None else profile.scale
        self.labels = tuple(f"{side}_{name}" for side in profile.sides for name in profile.layout.marker_names)
        self._skeleton = profile.hand.skeleton.scaled(self.scale)
        self.flesh = Flesh(self._skeleton, _size(self._skeleton))
        self._markers_m = profile.worn.positions_m * self.scale
        lengths = self._skeleton.joint_positions_m.tobytes() + self._skeleton.tip_positions_m.tobytes()
        self.performance = _performed(
            seed if person is None else person, seed, activity, lengths, _Hashed(self._skeleton)
        )
        self.props = self.performance.props
        self._hold_begins = [[hold.begin_s for hold in holds] for holds in self.performance.holds]

    def theta(self, side: Side, time_s: float) -> FloatArray:
        """(26,) float64, the true parameters of one hand at a time [s]."""
        theta = self._right(SIDES.index(side), time_s)
        return mirror_theta(theta) if side == "left" else theta

    def props_world(self, time_s: float) -> dict[str, FloatArray]:
        """(4, 4) float64 [m] of every prop, by name, at a time [s]."""
        phase_s, placed = time_s % PERIOD_S, {}
        for name, holds, begins in zip(self.props, self.performance.holds, self._hold_begins, strict=True):
            hold = holds[bisect_right(begins, phase_s) - 1]
            if hold.holder is None:
                placed[name] = hold.transform
            else:
                wrist = transform_of(self._right(hold.holder, time_s)[:N_ROOT_DOFS])
                placed[name] = in_terms_of(hold.holder, wrist @ hold.transform)
        return placed

    def flesh_world(self, side: Side, times_s: FloatArray) -> Posed:
        """The capsules of one hand in the world at times (n,) [s]."""
        posed = self.flesh.posed(np.stack([self._right(SIDES.index(side), time_s) for time_s in times_s]))
        return posed.mirrored() if side == "left" else posed

    def at(self, time_s: float) -> PerformerFrame:
        """Everything that is true at a time [s]."""
        frame = PerformerFrame(time_s, {}, {}, {}, self.props_world(time_s))
        layout = self.profile.layout
        for side in self.profile.sides:
            right = self._right(SIDES.index(side), time_s)
            joints = forward.joints_world(self._skeleton, right)
            markers = forward.markers_world(self._skeleton, right, layout.joints, self._markers_m)
            frame.theta_rad[side] = mirror_theta(right) if side == "left" else right
            frame.joints_world[side] = mirror_transforms(joints) if side == "left" else joints
            frame.markers_world_m[side] = mirror_points(markers) if side == "left" else markers
        return frame

    def frames(self, rate_hz: float) -> Iterator[PerformerFrame]:
        """Without end, one frame every 1 / rate_hz seconds from time zero."""
        i = 0
        while True:
            yield self.at(i / rate_hz)
            i += 1

    def positions(self, rate_hz: float) -> Iterator[tuple[float, FloatArray]]:
        """Motion time [s] and (len(labels), 3) float64 marker positions [m], without end."""
        for frame in self.frames(rate_hz):
            yield frame.time_s % PERIOD_S, np.concatenate(list(frame.markers_world_m.values()))

    def _right(self, hand: int, time_s: float) -> FloatArray:
        """(26,) of a hand in its right-handed terms: a cubic B-spline whose control points are the knots. It stays
        inside their hull, so limits that the knots keep are kept in between."""
        place = (time_s % PERIOD_S) * KNOTS_HZ
        before = int(place)
        u = place - before
        v = 1.0 - u
        weights = np.array([v * v * v, 3.0 * u * u * (u - 2.0) + 4.0, 3.0 * v * v * (v - 2.0) + 4.0, u * u * u]) / 6.0
        rows = self.performance.knots[hand].take((before - 1, before, before + 1, before + 2), axis=0, mode="wrap")
        theta: FloatArray = weights @ rows
        return theta


class _Hashed:
    """A skeleton that does not count in a cache's key: the bytes beside it do."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Hashed)

    def __hash__(self) -> int:
        return 0


@lru_cache(maxsize=16)
def _performed(who: int, seed: int, activity: str, _lengths: bytes, hashed: _Hashed) -> Performance:
    """Written, sampled and eased. The person depends on `who` alone, the choreography on `seed` and the activity."""
    skeleton = hashed.skeleton
    limits = skeleton.limits_rad
    person = Person(np.random.default_rng([_PERSON, who]), limits)
    random = np.random.default_rng([list(ACTIVITIES).index(activity), seed])
    stage = Stage(person, random, skeleton, _size(skeleton))
    _choreograph(stage, activity)

    times_s = np.arange(_N_KNOTS) / KNOTS_HZ
    calmness = np.stack([score.calmness(times_s) for score in stage.scores])
    low, high = limits.T + np.array([[_OWN_LIMITS_RAD], [-_OWN_LIMITS_RAD]])
    knots = np.stack([score.sampled(times_s) for score in stage.scores])
    for hand in (LEFT, RIGHT):
        knots[hand] += unrest(person, random, times_s, PERIOD_S, calmness[hand])
    np.clip(knots[..., N_ROOT_DOFS:], low, high, out=knots[..., N_ROOT_DOFS:])
    holds = tuple(
        (Hold(0.0, k, None, thing.home), *(hold for hold in stage.holds if hold.prop == k))
        for k, thing in enumerate(stage.things)
    )
    added = np.zeros_like(knots)
    for every in (_EASED_EVERY, 1):  # roughly everywhere, then finely where something was in the way
        step = slice(None, None, every)
        paths = [prop_path(thing.prop, own, times_s[step]) for thing, own in zip(stage.things, holds, strict=True)]
        active = None if every > 1 else np.abs(added).max(axis=(0, 2)) > 1e-3
        free = 1.0 - calmness[:, step]
        added = eased(stage.flesh, knots[:, step], free, paths, every / KNOTS_HZ, low, high, active)
        added = added if every == 1 else _between(added)
        knots += added
    props = {thing.name: thing.prop for thing in stage.things}
    knots.flags.writeable = False
    return Performance(knots, props, holds)


def _size(skeleton: Skeleton) -> float:
    """Over the template's."""
    return float(np.mean(skeleton.bone_lengths_m[1:])) / _TEMPLATE_BONE_M


def prop_path(prop: Prop, holds: tuple[Hold, ...], times_s: FloatArray) -> PropPath:
    """Who holds a prop at times (n,) [s], and where."""
    which = np.searchsorted([hold.begin_s for hold in holds], times_s, side="right") - 1
    holder = np.array([-1 if hold.holder is None else hold.holder for hold in holds])[which]
    return PropPath(prop, holder, np.stack([hold.transform for hold in holds])[which])


def _choreograph(stage: Stage, activity: str) -> None:
    """Act after act until the time is up, then home."""
    random, acts = stage.random, ACTIVITIES[activity].acts
    things = ACTIVITIES[activity].things
    if things is not None:
        things(stage)
    shares = np.array(list(acts.values()))
    filler = postures(names_of("rest", "gesture"))
    time_s, refused = START_STILL_S, 0
    while time_s < _LAST_ACT_S - _SHORTEST_ACT_S:
        act = filler if refused > 3 else list(acts)[int(random.choice(len(acts), p=shares / shares.sum()))]
        try:
            with stage.attempt():
                time_s = act(stage, time_s, _LAST_ACT_S)
            refused = 0
        except OverTime:
            refused += 1
    for score in stage.scores:
        score.wrist(min(time_s, _LAST_ACT_S), score.start[:N_ROOT_DOFS])
        score.digits(min(time_s, _LAST_ACT_S), score.start[N_ROOT_DOFS:])


def _between(coarse: FloatArray) -> FloatArray:
    """(2, n, 26), a loop, with a sample set between any two: their mean."""
    fine = np.empty((coarse.shape[0], _EASED_EVERY * coarse.shape[1], N_DOFS))
    fine[:, ::2] = coarse
    fine[:, 1::2] = 0.5 * (coarse + np.roll(coarse, -1, axis=1))
    return fine
