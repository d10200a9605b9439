"""A synthetic performer: two hands that move as a person's do, for trying a setup without one.

Every movement is a sum of minimum-jerk submovements (Flash and Hogan 1985) between named poses and wrist
positions, with a small lead or lag per digit, over a slow sway. The motion is a function of time alone:
the same seed gives the same motion at any frame rate, and after PERIOD_S it begins again without a seam.

World: Y up, floor at 0, the performer stands at the origin and faces -Z.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from core.frames import SIDES, FloatArray, Side
from core.hand.mirror import mirror_points, mirror_theta, mirror_transforms
from core.hand.poses import POSE_NAMES, pose
from core.hand.skeleton import DIGITS, N_DOFS, N_ROOT_DOFS
from core.kinematics import forward
from core.profile import Profile

PERIOD_S = 60.0
START_STILL_S = 1.5
"""The performer begins with relaxed open hands and holds them for this long."""

MAX_WRIST_SPEED_MPS = 1.4
MAX_DIGIT_SPEED_RADPS = 7.5
_PEAK = 1.875  # peak speed of a minimum-jerk movement, in mean speeds
_LAST_MOVE_S = 57.0  # by then everything is on its way back to the start

_START_POSITION_M = np.array([0.17, 1.05, -0.30])  # right wrist
_START_ROTATION = np.array([0.05, 0.15, -0.25])
_POSES = tuple(name for name in POSE_NAMES if name != "rest")


@dataclass(frozen=True, slots=True)
class PerformerFrame:
    """What is true at one instant, per hand of the performer.

    theta_rad: (26,) float64 as in core.frames.HandFrame. joints_world: (16, 4, 4) float64.
    markers_world_m: (m, 3) float64 [m], in the order of the layout.
    """

    time_s: float
    theta_rad: dict[Side, FloatArray]
    joints_world: dict[Side, FloatArray]
    markers_world_m: dict[Side, FloatArray]


class Performer:
    """Both hands of `profile`, wearing its layout at its scale (1 if the profile leaves it open)."""

    def __init__(self, profile: Profile, seed: int = 0) -> None:
        self.profile = profile
        self.scale = 1.0 if profile.scale is None else profile.scale
        self.labels = tuple(f"{side}_{name}" for side in profile.sides for name in profile.layout.marker_names)
        self._skeleton = profile.hand.skeleton.scaled(self.scale)
        self._markers_m = profile.worn.positions_m * self.scale
        self._limits = profile.hand.skeleton.limits_rad
        # Both hands are always choreographed, so that one hand moves alike whether or not the other is asked for.
        random = np.random.default_rng(seed)
        wrists = _wrist_moves(random)
        self._moves: dict[Side, _Moves] = {
            side: _joined(wrist, _digit_moves(random, self._limits)) for side, wrist in zip(SIDES, wrists, strict=True)
        }
        self._sway = {side: _Sway(random) for side in self._moves}

    def theta(self, side: Side, time_s: float) -> FloatArray:
        """(26,) float64, the true parameters of one hand at a time [s]."""
        phase_s = time_s % PERIOD_S
        theta = self._moves[side].at(phase_s) + self._sway[side].at(phase_s)
        np.clip(theta[N_ROOT_DOFS:], self._limits[:, 0], self._limits[:, 1], out=theta[N_ROOT_DOFS:])
        return mirror_theta(theta) if side == "left" else theta

    def at(self, time_s: float) -> PerformerFrame:
        """Everything that is true at a time [s]."""
        frame = PerformerFrame(time_s, {}, {}, {})
        layout = self.profile.layout
        for side in self.profile.sides:
            theta = self.theta(side, time_s)
            right = mirror_theta(theta) if side == "left" else theta
            joints = forward.joints_world(self._skeleton, right)
            markers = forward.markers_world(self._skeleton, right, layout.joints, self._markers_m)
            frame.theta_rad[side] = theta
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


@dataclass(frozen=True)
class _Moves:
    """Submovements of d degrees of freedom that add up: start (d,), and per move begin_s, duration_s, change (k, d)."""

    start: FloatArray
    begin_s: FloatArray
    duration_s: FloatArray
    change: FloatArray

    def at(self, time_s: float) -> FloatArray:
        x = np.clip((time_s - self.begin_s) / self.duration_s, 0.0, 1.0)
        sum_: FloatArray = self.start + (self.change * (x**3 * (10.0 + x * (6.0 * x - 15.0)))).sum(axis=0)
        return sum_


class _Sway:
    """Breathing and unrest: a few slow waves per degree of freedom, each a whole number of times per period."""

    _WAVES = 3

    def __init__(self, random: np.random.Generator) -> None:
        shape = (self._WAVES, N_DOFS)
        amplitude = np.concatenate([np.full(3, 0.004), np.full(3, 0.02), np.full(N_DOFS - N_ROOT_DOFS, 0.012)])
        cycles = random.integers(9, 49, shape)  # 0.15 to 0.8 Hz
        self._frequency = 2.0 * np.pi * cycles / PERIOD_S
        self._phase = random.uniform(0.0, 2.0 * np.pi, shape)
        self._amplitude = amplitude / np.sqrt(self._WAVES) * random.uniform(0.5, 1.0, shape)

    def at(self, time_s: float) -> FloatArray:
        """(26,) float64, what to add to the parameters."""
        waves: FloatArray = (self._amplitude * np.sin(self._frequency * time_s + self._phase)).sum(axis=0)
        return waves


def _joined(wrist: _Moves, digits: _Moves) -> _Moves:
    """One movement of all 26 parameters; a move of the wrist does not change the digits, and the reverse."""
    k, n = len(wrist.begin_s), len(digits.begin_s)
    moves = [np.ones((k + n, N_DOFS)), np.ones((k + n, N_DOFS)), np.zeros((k + n, N_DOFS))]
    for whole, first, second in zip(
        moves,
        (wrist.begin_s, wrist.duration_s, wrist.change),
        (digits.begin_s, digits.duration_s, digits.change),
        strict=True,
    ):
        whole[:k, :N_ROOT_DOFS] = first
        whole[k:, N_ROOT_DOFS:] = second
    return _Moves(np.concatenate([wrist.start, digits.start]), *moves)


def _wrist_moves(random: np.random.Generator) -> tuple[_Moves, _Moves]:
    """Left (in the mirror) and right wrist: positions and rotation vectors."""
    start = np.concatenate([_START_POSITION_M, _START_ROTATION])
    now = [start.copy(), start.copy()]
    rows: list[list[tuple[FloatArray, FloatArray, FloatArray]]] = [[], []]
    time_s = START_STILL_S
    while time_s < PERIOD_S - 1.0:
        returning = time_s >= _LAST_MOVE_S - 2.0
        swift = random.random() < 0.25
        targets = [start, start] if returning else _wrist_targets(random)
        pace_s = random.uniform(0.25, 0.4) if swift else random.uniform(0.7, 1.6)
        longest_s = 0.0
        for hand in (0, 1):
            change = targets[hand] - now[hand]
            reach_s = _PEAK * float(np.linalg.norm(change[:3])) / MAX_WRIST_SPEED_MPS
            turn_s = _PEAK * float(np.linalg.norm(change[3:])) / 5.0
            duration_s = max(pace_s, reach_s, turn_s) * random.uniform(1.0, 1.15)
            begin = np.full(6, time_s + random.uniform(0.0, 0.06))
            begin[3:] += random.uniform(0.0, 0.12)  # the wrist turns a little after it sets off
            rows[hand].append((begin, np.full(6, duration_s), change))
            now[hand] = targets[hand]
            longest_s = max(longest_s, duration_s + 0.2)
        if returning:
            break
        time_s += longest_s + random.uniform(0.1, 0.9)
    left, right = (_Moves(start, *(np.stack([row[column] for row in hand]) for column in range(3))) for hand in rows)
    return left, right


def _wrist_targets(random: np.random.Generator) -> list[FloatArray]:
    """Where the two wrists go next: each in its own right-handed terms, (6,) position [m] and rotation vector."""
    centre = np.array([random.uniform(-0.08, 0.08), random.uniform(0.93, 1.17), random.uniform(-0.42, -0.24)])
    close = random.random() < 0.2
    apart_m = random.uniform(0.24, 0.28) if close else random.uniform(0.28, 0.45)
    tilt = random.uniform(-0.05, 0.05, 2)
    targets = []
    for sign in (-1.0, 1.0):  # left, right
        position = np.array([sign * centre[0] + apart_m / 2.0, centre[1] + sign * tilt[0], centre[2] + sign * tilt[1]])
        low, high = ((-0.3, -0.1, -0.5), (0.3, 0.2, 0.1)) if close else ((-0.5, -0.15, -1.3), (0.5, 0.6, 0.35))
        targets.append(np.concatenate([position, random.uniform(low, high)]))
    return targets


def _digit_moves(random: np.random.Generator, limits_rad: FloatArray) -> _Moves:
    """A sequence of named poses, each a little different every time, that begins and ends relaxed."""
    start = pose("relaxed")
    now, name = start, "relaxed"
    rows: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    time_s = START_STILL_S
    while True:
        returning = time_s >= _LAST_MOVE_S - 1.5
        if returning:
            name, target = "relaxed", start
        else:
            name = str(random.choice([other for other in _POSES if other != name]))
            varied = pose(name) * random.uniform(0.93, 1.03, 20) + random.normal(0.0, 0.015, 20)
            target = np.clip(varied, limits_rad[:, 0], limits_rad[:, 1])
        change = target - now
        slowest_s = _PEAK * float(np.abs(change).max()) / MAX_DIGIT_SPEED_RADPS
        duration_s = max(slowest_s, random.uniform(0.3, 0.9))
        lag_s = np.repeat(_lags(random, closing=float(change[[5, 9, 13, 17]].sum()) > 0.0), 4)
        rows.append((time_s + lag_s, np.full(20, duration_s), change))
        now = target
        if returning:
            break
        time_s += duration_s + float(lag_s.max()) + random.choice([0.05, 0.3, 0.8]) * random.uniform(0.7, 1.3)
    begin, duration, changes = (np.stack([row[column] for row in rows]) for column in range(3))
    return _Moves(start, begin, duration, changes)


def _lags(random: np.random.Generator, closing: bool) -> FloatArray:
    """(5,) float64 [s], when each digit sets off: the thumb closes last and opens first, and now and then the
    fingers follow one another as in a wave."""
    wave_s = random.choice([0.0, 0.02, 0.09]) * np.arange(len(DIGITS))
    lags: FloatArray = random.uniform(0.0, 0.04, len(DIGITS)) + (wave_s if random.random() < 0.5 else wave_s[::-1])
    lags[0] = lags[1:].max() + 0.1 if closing else 0.0
    if not closing:
        lags[1:] += 0.06
    return lags
