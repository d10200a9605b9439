"""What the session measures of itself while it runs: rates, latencies, stage times, and the last seconds of poses."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from app.label_trust import trust
from core.cast import Cast
from core.frames import SIDES, FloatArray, HandKey, HandState, MarkerFrame, TrackedFrame
from core.hand.skeleton import N_DOFS
from core.profile import Profile
from devices.common.clock import host_clock

WINDOW_S = 1.0
SKIPPED = "skipped to stay live"
"""Why a frame was not solved that an engine which is too slow left out."""


@dataclass(frozen=True)
class LiveFrame:
    """What the screen shows: the points of one frame, what the engine made of them, and for which performers."""

    raw: MarkerFrame
    solved: TrackedFrame
    profiles: Cast

    @property
    def profile(self) -> Profile:
        """Of the first performer."""
        return self.profiles[0]


@dataclass(frozen=True)
class SolverNumbers:
    """The engine over the last second.

    rate_hz: frames solved per second. latency_s: exposure to the pose that is handed on, median, NaN if unknown; it
    contains the look-ahead. latency_p99_s: its 99th percentile. step_s: median time of one frame in the solver.
    stage_s: median per stage, in order. dropped: frames not solved since the session began, by reason;
    skipped_hz: of those, what was skipped to stay live in the last second.
    look_ahead_s: how long frames are held back so that gaps can be filled.
    """

    rate_hz: float = 0.0
    latency_s: float = float("nan")
    latency_p99_s: float = float("nan")
    step_s: float = float("nan")
    stage_s: dict[str, float] = field(default_factory=dict)
    solved: int = 0
    dropped: dict[str, int] = field(default_factory=dict)
    look_ahead_s: float = 0.0
    skipped_hz: float = 0.0


class SolverMeter:
    """Counts on the engine thread, is read from any."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._recent: deque[tuple[float, float, dict[str, float]]] = deque(maxlen=2000)
        self._latencies: deque[tuple[float, float]] = deque(maxlen=2000)
        self._solved = 0
        self._dropped: Counter[str] = Counter()
        self._skipped: deque[tuple[float, int]] = deque(maxlen=2000)

    def begin(self) -> None:
        """Another device: what was measured of the one before is over; what was counted stays."""
        with self._lock:
            self._recent.clear()
            self._latencies.clear()
            self._skipped.clear()

    def solved(self, stage_s: dict[str, float], step_s: float) -> None:
        """One frame is done."""
        with self._lock:
            self._solved += 1
            self._recent.append((host_clock(), step_s, stage_s))

    def handed_on(self, frame: TrackedFrame) -> None:
        """One frame goes to whoever is shown it."""
        now = host_clock()
        with self._lock:
            self._latencies.append((now, now - frame.times.host_s))

    def dropped(self, reason: str, frames: int = 1) -> None:
        """Frames are not solved."""
        with self._lock:
            self._dropped[reason] += frames
            if reason == SKIPPED:
                self._skipped.append((host_clock(), frames))

    def numbers(self, look_ahead_s: float = 0.0) -> SolverNumbers:
        """The figures now."""
        since = host_clock() - WINDOW_S
        with self._lock:
            recent = [entry for entry in self._recent if entry[0] >= since]
            latencies = np.array([entry[1] for entry in self._latencies if entry[0] >= since])
            solved, dropped = self._solved, dict(self._dropped)
            skipped_hz = sum(entry[1] for entry in self._skipped if entry[0] >= since) / WINDOW_S
        if not recent:
            return SolverNumbers(solved=solved, dropped=dropped, look_ahead_s=look_ahead_s, skipped_hz=skipped_hz)
        latencies = latencies[np.isfinite(latencies)]
        stages: dict[str, list[float]] = {}
        for entry in recent:
            for name, seconds in entry[2].items():
                stages.setdefault(name, []).append(seconds)
        return SolverNumbers(
            rate_hz=len(recent) / WINDOW_S,
            latency_s=float(np.median(latencies)) if len(latencies) else float("nan"),
            latency_p99_s=float(np.percentile(latencies, 99)) if len(latencies) else float("nan"),
            step_s=float(np.median([entry[1] for entry in recent])),
            stage_s={name: float(np.median(seconds)) for name, seconds in stages.items()},
            solved=solved,
            dropped=dropped,
            look_ahead_s=look_ahead_s,
            skipped_hz=skipped_hz,
        )


@dataclass(frozen=True)
class TrailView:
    """The last seconds, oldest first, for each of `hands`; NaN where a hand was not tracked.

    times_s: (n,) float64, host clock [s]. rms_m: (n, h) float64 [m]. theta_rad, theta_std: (n, h, 26) float64.
    trust: (n, h, 2) float64 in 0..1, mean and least confidence of the labels, NaN where unknown too.
    """

    hands: tuple[HandKey, ...]
    times_s: FloatArray
    rms_m: FloatArray
    theta_rad: FloatArray
    theta_std: FloatArray
    trust: FloatArray


ONE_PERFORMER = tuple(HandKey(0, side) for side in SIDES)


class Trail:
    """A ring of the last poses, for the plots. Rows are overwritten in place: nothing is allocated per frame."""

    def __init__(self, hands: Sequence[HandKey] = ONE_PERFORMER, size: int = 4096) -> None:
        self._lock = threading.Lock()
        self._size = size
        self.begin(hands)

    def begin(self, hands: Sequence[HandKey]) -> None:
        """Forget everything; from now on these hands are remembered."""
        with self._lock:
            self._hands = tuple(hands)
            self._column = {key: i for i, key in enumerate(self._hands)}
            size, h = self._size, len(self._hands)
            self._times = np.full(size, np.nan)
            self._rms = np.full((size, h), np.nan)
            self._theta = np.full((size, h, N_DOFS), np.nan)
            self._std = np.full((size, h, N_DOFS), np.nan)
            self._trust = np.full((size, h, 2), np.nan)
            self._next = self._count = 0

    def add(self, frame: TrackedFrame) -> None:
        """Append one solved frame."""
        with self._lock:
            i = self._next
            self._times[i] = host_clock()
            self._rms[i] = np.nan
            self._theta[i] = np.nan
            self._std[i] = np.nan
            self._trust[i] = np.nan
            for hand in frame.hands:
                column = self._column.get(hand.key)
                if column is not None and hand.state is HandState.TRACKED:
                    self._rms[i, column] = hand.rms_m
                    self._theta[i, column] = hand.theta_rad
                    self._std[i, column] = hand.theta_std
                    self._trust[i, column] = trust(hand)
            self._next = (i + 1) % len(self._times)
            self._count = min(self._count + 1, len(self._times))

    def clear(self) -> None:
        """Forget everything."""
        with self._lock:
            self._next = self._count = 0

    def view(self, last_s: float) -> TrailView:
        """A copy of the last `last_s` seconds."""
        with self._lock:
            size = len(self._times)
            order = (np.arange(self._next - self._count, self._next)) % size
            order = order[self._times[order] >= host_clock() - last_s]
            kept = (self._times, self._rms, self._theta, self._std, self._trust)
            return TrailView(self._hands, *(values[order] for values in kept))
