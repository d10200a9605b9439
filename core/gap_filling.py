"""Smooths what the engine leaves rough: gaps are filled where their end is known, and eased out of where it was not.

The engine answers every frame at once; of a hidden finger it can only guess. A `GapFiller` stands between it and
whoever is shown the poses. It holds frames back for a chosen time, and so sees gaps end before they are shown:

- A gap that ends within that time is filled with the curve of least angular acceleration (core.kinematics.gaps). All
  of it, as if the whole recording were known.
- Of a longer gap the carried pose is shown until its end comes into sight; from there a curve leads to it.
- Without look-ahead, or where it is too short, the difference between guess and truth is worked off after the gap.

None of them steps: values and velocities are continuous. Only angles that are guesses are ever touched, and a hand
that was lost for no longer than MAX_LOST_S; points and their labels never are.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.cast import cast_of, hands_of
from core.confidence import confidence
from core.frames import BoolArray, FloatArray, HandFrame, HandState, IntArray, TrackedFrame
from core.guesses import POINT_NOISE_M, Guesses
from core.hand.mirror import mirror_points, mirror_theta, mirror_transforms
from core.hand.skeleton import N_DOFS, N_ROOT_DOFS
from core.kinematics import kernels
from core.kinematics.gaps import VELOCITY_FRAMES, WRIST_JERK_PER_SPEED2, bridge
from core.kinematics.prior import NO_PRIOR, MotionPrior
from core.kinematics.solver import HandPose, HandSolver
from core.profile import Profile
from core.track import tracking_solver

OFFLINE_S = 4.0
"""How far filling looks ahead where nobody waits. The ends of a longer gap do not tell of its middle."""

MAX_LOST_S = 0.5
"""A hand lost for longer may have been anywhere."""

WRIST_PER_ANGLE = 0.1
"""Metres that a wrist strays from a curve while a joint angle strays a radian."""

BEFORE_FRAMES = 8
"""Frames before a gap that tell how sure its end is as a rule: more than a marker that slides off takes for it."""

EASE_S = 0.12
"""Time in which the difference between a guess and the truth is worked off: short of what the eye takes for lag."""

_NONE = np.zeros(N_DOFS, dtype=np.bool_)
_ALL = np.ones(N_DOFS, dtype=np.bool_)
_TURN = slice(3, 6)  # the root's rotation vector
_SMALL = 1e-5


@dataclass(slots=True)
class _Sample:
    """One hand in one frame, on its way.

    theta, std (26,): as they will be shown, the engine's own arrays until they are changed. guessed, filled (26,) bool;
    unsure: anything is guessed.
    """

    time_s: float
    hand: HandFrame
    guessed: BoolArray
    unsure: bool
    filled: BoolArray
    theta: FloatArray
    std: FloatArray

    @property
    def tracked(self) -> bool:
        return self.hand.state is HandState.TRACKED

    @property
    def known(self) -> bool:
        """There is a pose to show: tracked, or on its way between two that were."""
        return self.tracked or bool(self.filled[0])


class GapFiller:
    """Frames in, in order; the same frames out, smoothed, `look_ahead_s` later.

    A clock that stands still or runs back ends what is smooth, and so does a frame of other hands: all frames held back
    come out, and it begins anew.
    """

    def __init__(self, profiles: Profile | Sequence[Profile], look_ahead_s: float) -> None:
        """profiles: of each performer, as the engine has them."""
        self.look_ahead_s = look_ahead_s
        cast = cast_of(profiles)
        self._hands = hands_of(cast)
        solvers = [tracking_solver(profile) for profile in cast]
        self._fillers = [_HandFiller(solvers[hand.performer]) for hand in self._hands]
        self._held: deque[tuple[float, TrackedFrame]] = deque()
        self._newest_s = float("nan")

    def push(self, frame: TrackedFrame) -> list[TrackedFrame]:
        """Take one frame; what is due by now, oldest first."""
        now_s = frame.times.device_s if np.isfinite(frame.times.device_s) else frame.times.host_s
        due: list[TrackedFrame] = []
        known = tuple(hand.key for hand in frame.hands) == self._hands
        if not (known and now_s > self._newest_s):
            due = self.flush()
        self._newest_s = now_s
        if not known:
            return [*due, frame]
        self._held.append((now_s, frame))
        for filler, hand in zip(self._fillers, frame.hands, strict=True):
            filler.push(now_s, hand)
        while self._held and not now_s - self._held[0][0] < self.look_ahead_s:
            due.append(self._next(last=False))
        return due

    def flush(self) -> list[TrackedFrame]:
        """What is still held back; the next frame begins anew."""
        due = [self._next(last=True) for _ in range(len(self._held))]
        for filler in self._fillers:
            filler.reset()
        return due

    def _next(self, last: bool) -> TrackedFrame:
        _, frame = self._held.popleft()
        hands = tuple(filler.next(last) for filler in self._fillers)
        return frame if all(a is b for a, b in zip(hands, frame.hands, strict=True)) else replace(frame, hands=hands)


def filled(frames: Iterable[TrackedFrame], profiles: Profile | Sequence[Profile]) -> Iterator[TrackedFrame]:
    """The frames of a whole recording with their gaps filled."""
    filler = GapFiller(profiles, OFFLINE_S)
    for frame in frames:
        yield from filler.push(frame)
    yield from filler.flush()


class _HandFiller:
    """One hand of the stream. Parameters are those of its own side: only kinematics mirrors."""

    def __init__(self, solver: HandSolver) -> None:
        self._solver = solver
        self._limits = np.concatenate([np.tile([-np.inf, np.inf], (N_ROOT_DOFS, 1)), solver.skeleton.limits_rad])
        self._guesses = Guesses(solver)
        # What is usual is in the deviations of the angles already, as far as the curves follow it.
        self._told = HandSolver(solver.skeleton, solver.layout, NO_PRIOR)
        self._joints = solver.layout.joints
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self._guesses.reset()
        self._queue: deque[_Sample] = deque()
        self._pushed = self._shown = 0
        self._last_known = np.full(N_DOFS, -1)  # number of the newest sample that knew each parameter
        self._before: deque[_Sample] = deque(maxlen=BEFORE_FRAMES)  # shown last
        self._ease = _Ease()
        self._seen_s = -np.inf

    def push(self, time_s: float, hand: HandFrame) -> None:
        """One more sample."""
        guessed = _ALL
        if hand.state is HandState.TRACKED:
            seen = hand.observed
            guessed = _NONE
            if not seen.all():
                guessed = np.concatenate([_NONE[:N_ROOT_DOFS], self._guesses.of(right_pose(hand), seen)])
        self._last_known[~guessed] = self._pushed
        self._pushed += 1
        self._queue.append(_Sample(time_s, hand, guessed, bool(guessed.any()), _NONE, hand.theta_rad, hand.theta_std))

    def next(self, last: bool) -> HandFrame:
        """The oldest sample as it is to be shown. last: no more will come."""
        sample = self._queue[0]
        if not sample.tracked and sample.time_s - self._seen_s > MAX_LOST_S:
            self._before.clear()  # from here on nothing leads anywhere
            self._ease = _Ease()
        if self._before and sample.unsure:
            pending = sample.guessed & ~sample.filled & (self._last_known > self._shown)
            if pending.any():
                self._fill(pending, last)
        self._queue.popleft()
        self._shown += 1
        shown = self._finished(sample)
        if sample.known:
            self._seen_s = sample.time_s
        if self._before or sample.tracked:
            self._before.append(sample)
        return shown

    def _fill(self, pending: BoolArray, last: bool) -> None:
        """Lay curves over the parameters whose gap is seen to end; those of one end together."""
        queue = list(self._queue)
        guessed = np.array([sample.guessed for sample in queue])[:, pending]
        columns = np.flatnonzero(pending)
        ends = np.argmin(guessed, axis=0)
        afters = np.array([_run(~guessed[end:, k]) for k, end in enumerate(ends)])
        whole = last | (afters == VELOCITY_FRAMES) | (ends + afters < len(queue))
        for end, after in sorted(set(zip(ends[whole].tolist(), afters[whole].tolist(), strict=True))):
            together = columns[whole & (ends == end) & (afters == after)]
            lost = any(not sample.tracked for sample in queue[:end])
            if lost and queue[end].time_s - self._seen_s > MAX_LOST_S:
                continue
            self._bridge(together, queue[: end + after], end)

    def _bridge(self, columns: IntArray, after: list[_Sample], end: int) -> None:
        rows = [*self._before, *after]
        times_s = np.array([sample.time_s for sample in rows])
        theta = np.array([sample.theta for sample in rows])
        here = len(self._before) - 1
        start = theta[here].copy()
        if columns[0] < N_ROOT_DOFS:
            theta[:, _TURN] = [_step(start, row)[_TURN] for row in theta]
        std = np.array([sample.std for sample in rows])
        std[here + 1 : here + 1 + end][[not sample.tracked for sample in after[:end]]] = np.nan
        curve = bridge(
            times_s,
            theta[:, columns],
            std[:, columns],
            here + 1,
            len(after) - end,
            limits=self._limits[columns],
            unit=np.where(columns < 3, WRIST_PER_ANGLE, 1.0),
            jerk_per_speed2=np.where(columns < N_ROOT_DOFS, WRIST_JERK_PER_SPEED2, 0.0),
        )
        for sample, values, values_std in zip(after[:end], curve.values, curve.std, strict=True):
            if not sample.filled.any():
                std_before = sample.std if sample.tracked else rows[here].std
                sample.theta, sample.std, sample.filled = sample.theta.copy(), std_before.copy(), _NONE.copy()
            sample.theta[columns] = values
            if columns[0] < N_ROOT_DOFS:
                sample.theta[_TURN] = _moved(start, sample.theta)[_TURN]
            sample.filled[columns] = True
            sample.std[columns] = values_std

    def _finished(self, sample: _Sample) -> HandFrame:
        """The sample's public record: the engine's own where nothing is changed."""
        if not sample.known:
            return sample.hand
        if self._before:
            self._ease.apply(sample, self._before, self._limits)
        if sample.theta is sample.hand.theta_rad or np.array_equal(sample.theta, sample.hand.theta_rad):
            return sample.hand
        return self._rebuilt(sample)

    def _rebuilt(self, sample: _Sample) -> HandFrame:
        """The hand in another pose: joints, and the markers that no point holds, go with their bones."""
        hand, left = sample.hand, sample.hand.side == "left"
        pose = HandPose.at_rest(len(hand.point))
        pose.scale = hand.scale
        pose.theta_rad[:] = mirror_theta(sample.theta) if left else sample.theta
        self._solver.place(pose)
        joints = mirror_transforms(pose.joints_world) if left else pose.joints_world
        seen = hand.observed
        markers = hand.markers_world_m.copy()
        on = self._joints[~seen]
        local = np.einsum("mba,mb->ma", hand.joints_world[on, :3, :3], markers[~seen] - hand.joints_world[on, :3, 3])
        markers[~seen] = np.einsum("mab,mb->ma", joints[on, :3, :3], local) + joints[on, :3, 3]
        std_m = self._marker_std_m(pose, sample)
        marker_std_m = np.where(seen, hand.marker_std_m, std_m)
        sure = np.where(seen, hand.confidence, confidence(std_m, np.zeros(len(seen))))
        return replace(
            hand,
            state=HandState.TRACKED,
            theta_rad=sample.theta,
            joints_world=joints,
            markers_world_m=markers,
            confidence=sure,
            theta_std=sample.std,
            marker_std_m=marker_std_m,
            why=hand.why if sample.tracked else "",
            filled=sample.filled | (sample.theta != hand.theta_rad),
        )

    def _marker_std_m(self, pose: HandPose, sample: _Sample) -> FloatArray:
        """(m,) of the hand: what its angles leave open, each known as well as it is said to be."""
        if not sample.tracked:
            return _spread(self._solver, pose, sample.std)
        seen, angles = sample.hand.observed, slice(N_ROOT_DOFS, None)
        stiffness = np.square(POINT_NOISE_M / np.maximum(sample.std[angles], 1e-6))
        noise_m = float(sample.hand.marker_std_m[seen].mean()) / np.sqrt(3.0)
        weights = np.where(seen, (POINT_NOISE_M / noise_m) ** 2, 0.0)
        _, marker_std_m = self._told.uncertainty(
            pose, weights, POINT_NOISE_M, MotionPrior(pose.theta_rad[angles], stiffness)
        )
        return marker_std_m


class _Ease:
    """The way from where a hand was shown to where it is: a cubic, from the difference and its velocity to none.

    It begins anew in every frame in which a step may be, and in the one after, when the velocity is known.
    """

    def __init__(self) -> None:
        self._offset, self._speed = np.zeros(N_DOFS), np.zeros(N_DOFS)
        self._since_s = np.full(N_DOFS, -np.inf)
        self._again = _NONE
        self._raw = np.zeros(N_DOFS)
        self._until_s = -np.inf  # when all is worked off

    def apply(self, sample: _Sample, before: Sequence[_Sample], limits: FloatArray) -> None:
        """Move `sample.theta` on from what was shown before, the last of which is `before[-1]`."""
        last, raw = before[-1], sample.theta
        if not (sample.unsure or last.unsure or self._again is not _NONE) and sample.time_s >= self._until_s:
            self._raw = raw
            return
        dt_s = sample.time_s - last.time_s
        others = sample.tracked != last.tracked or not np.array_equal(sample.hand.observed, last.hand.observed)
        smooth = sample.filled | last.filled
        steps = (sample.guessed | last.guessed) & ~smooth & others
        begins = steps | (self._again & ~smooth)
        self._since_s[smooth] = -np.inf
        if begins.any():
            first = before[-min(VELOCITY_FRAMES, len(before))]
            shown = _step(first.theta, last.theta) / max(last.time_s - first.time_s, 1e-9)
            speed = np.where(steps, shown, _step(self._raw, raw) / dt_s)
            offset = _step(_moved(raw, -speed * dt_s), last.theta)
            self._offset[begins], self._speed[begins] = offset[begins], (shown - speed)[begins]
            self._since_s[begins] = last.time_s
            self._until_s = last.time_s + EASE_S
        s = np.minimum((sample.time_s - self._since_s) / EASE_S, 1.0)
        left = (1.0 - s) ** 2 * (self._offset * (1.0 + 2.0 * s) + self._speed * EASE_S * s)
        if left.any():
            sample.theta = np.clip(_moved(raw, left), limits[:, 0], limits[:, 1])
            sample.std = np.hypot(sample.std, left)
        self._again, self._raw = steps if steps.any() else _NONE, raw


def _spread(solver: HandSolver, pose: HandPose, std: FloatArray) -> FloatArray:
    """(m,) float64 [m]: what independent errors of all parameters, std (26,), do to the markers."""
    variance = np.zeros(len(pose.markers_world_m))
    for parameter in range(N_DOFS):
        moved = pose.copy()
        moved.theta_rad[parameter] += _SMALL
        solver.place(moved)
        change = (moved.markers_world_m - pose.markers_world_m) * (std[parameter] / _SMALL)
        variance += np.square(change).sum(axis=1)
    spread: FloatArray = np.sqrt(variance)
    return spread


def _run(known: BoolArray) -> int:
    """Known samples in a row at the beginning of (n,), as far as they matter."""
    return next((i for i, here in enumerate(known[:VELOCITY_FRAMES]) if not here), min(len(known), VELOCITY_FRAMES))


def _step(before: FloatArray, after: FloatArray) -> FloatArray:
    """(26,) what leads from one pose to another, the rotation in the world."""
    step = np.empty(N_DOFS)
    kernels.pose_step(before, after, step)
    return step


def _moved(theta: FloatArray, step: FloatArray) -> FloatArray:
    """(26,) the pose after such a step; a rotation that does not change keeps its bits."""
    moved = theta.copy()
    kernels.pose_moved(moved, step)
    if not step[_TURN].any():
        moved[_TURN] = theta[_TURN]
    return moved


def right_pose(hand: HandFrame) -> HandPose:
    """A tracked hand as the right hand that the solver knows."""
    if hand.side == "right":
        return HandPose(hand.theta_rad, hand.joints_world, hand.markers_world_m, hand.scale, hand.rms_m)
    return HandPose(
        mirror_theta(hand.theta_rad),
        mirror_transforms(hand.joints_world),
        mirror_points(hand.markers_world_m),
        hand.scale,
        hand.rms_m,
    )
