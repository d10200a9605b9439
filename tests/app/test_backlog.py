"""When what waits is skipped: by a clock that is set by hand, with the real queue of the real solver thread."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest

from app.live_numbers import SKIPPED, LiveFrame
from app.notifications import NotificationCentre
from app.solver_thread import SolverThread
from core.cast import Cast
from core.frames import HandKey, MarkerFrame, Times, TrackedFrame
from core.profile import load_profile
from tests.app.stage import until

HZ = 120.0
PROFILE = load_profile("han19")


@dataclass
class Stream:
    """Frames that come at known times while an engine takes known times over each: the engine moves the clock on.

    shown: (when, which frame, how old it was) of every frame shown.
    """

    arrivals_s: list[float]
    steps_s: Iterator[float]
    now_s: float = 0.0
    came: int = 0
    skipped_before: dict[int, int] = field(default_factory=dict)
    shown: list[tuple[float, int, float]] = field(default_factory=list)
    said: list[object] = field(default_factory=list)
    commands: dict[int, Callable[[], None]] = field(default_factory=dict)
    solver: SolverThread | None = None
    _unseen: int = 0

    def step(self, frame: MarkerFrame) -> TrackedFrame:
        self.skipped_before[frame.sequence], self._unseen = self._unseen, 0
        self.said.append(frame.sequence)
        self._advance(self.now_s + next(self.steps_s))
        return TrackedFrame(frame.sequence, frame.times, ())

    def skip(self, frames: int) -> None:
        self._unseen += frames

    def pass_over(self, frame: MarkerFrame) -> None:
        self._unseen += 1

    def reset(self) -> None:
        self.said.append("reset")

    def search(self, hand: HandKey) -> None:
        self.said.append("search")

    def change(self, profiles: Cast) -> None:
        self.said.append("change")

    def show(self, frame: LiveFrame) -> None:
        self.shown.append((self.now_s, frame.raw.sequence, self.now_s - frame.raw.times.host_s))

    def _advance(self, to_s: float) -> None:
        assert self.solver is not None
        while self.came < len(self.arrivals_s) and self.arrivals_s[self.came] <= to_s:
            at_s, number = self.arrivals_s[self.came], self.came
            self.now_s, self.came = max(at_s, self.now_s), number + 1
            if number in self.commands:
                self.commands[number]()
            times = Times(number / HZ, at_s, at_s)
            self.solver.offer(MarkerFrame(number, times, np.empty((0, 3)), np.empty(0), np.empty(0)), None)
        self.now_s = to_s
        if not self.solver.queue_depth and self.came < len(self.arrivals_s):
            self._advance(self.arrivals_s[self.came])

    def play(self, monkeypatch: pytest.MonkeyPatch) -> Stream:
        monkeypatch.setattr("app.solver_thread.host_clock", lambda: self.now_s)
        self.solver = SolverThread(
            (PROFILE,), lambda _: self, lambda: None, self.show, NotificationCentre(), queue_frames=100_000
        )
        self.solver.start()
        assert self.solver.ready.wait(60)
        self.solver._queue.command(lambda: self._advance(self.arrivals_s[0]))
        until(lambda: self.came == len(self.arrivals_s) and not self.solver.queue_depth)
        assert self.solver.close(60)
        return self

    @property
    def skipped(self) -> int:
        assert self.solver is not None
        return self.solver.meter.numbers().dropped.get(SKIPPED, 0)

    @property
    def ages_s(self) -> list[float]:
        return [age_s for _, _, age_s in self.shown]


def regular(n: int, jitter_s: float = 0.0, bunch: int = 1) -> list[float]:
    rng = np.random.default_rng(3)
    times = (np.arange(n) // bunch * bunch + bunch - 1) / HZ + rng.uniform(0.0, jitter_s, n)
    return np.sort(times).tolist()


def each(step_s: float, jitter_s: float = 0.0, first_s: float | None = None) -> Iterator[float]:
    rng = np.random.default_rng(4)
    if first_s is not None:
        yield first_s
    while True:
        yield step_s + rng.uniform(-jitter_s, jitter_s)


@pytest.mark.parametrize("bunch", [1, 4, 12])
@pytest.mark.parametrize("step_s", [2.0 / HZ, 1.2 / HZ, 1.05 / HZ])
def test_an_engine_that_is_too_slow_shows_what_happens_now(monkeypatch, step_s: float, bunch: int) -> None:
    stream = Stream(regular(3000, bunch=bunch), each(step_s, 0.3 / HZ)).play(monkeypatch)
    late = [age_s for when_s, _, age_s in stream.shown if when_s > 1.0]
    assert max(late) < 0.2 + bunch / HZ
    assert len(stream.shown) + stream.skipped == 3000 and stream.skipped > 0
    assert [number for _, number, _ in stream.shown] == sorted({number for _, number, _ in stream.shown})
    if bunch == 1:  # no more than must be; of a bunch all but the newest are
        assert stream.skipped < 1.2 * 3000 * (1.0 - 1.0 / (step_s * HZ)) + 24
    numbers = [number for _, number, _ in stream.shown]
    assert [stream.skipped_before[n] for n in numbers[1:]] == [b - a - 1 for a, b in itertools.pairwise(numbers)]


@pytest.mark.parametrize("bunch", [1, 4])
@pytest.mark.parametrize(("share", "jitter"), [(1 / 3, 0.0), (1 / 3, 0.3), (0.8, 0.3), (0.9, 0.1)])
def test_a_hiccup_is_worked_off_without_loss(monkeypatch, share: float, jitter: float, bunch: int) -> None:
    stream = Stream(regular(2400, 0.002, bunch), each(share / HZ, jitter * share / HZ, first_s=0.5)).play(monkeypatch)
    assert stream.skipped == 0 and len(stream.shown) == 2400
    assert max(stream.ages_s) > 0.49 and stream.ages_s[-1] < (bunch + 1) / HZ


def test_a_second_hiccup_while_the_first_is_worked_off_costs_nothing_either(monkeypatch) -> None:
    steps = itertools.chain([0.5], [0.6 / HZ] * 40, [0.3], [0.6 / HZ] * 4000)
    stream = Stream(regular(1200), steps).play(monkeypatch)
    assert stream.skipped == 0 and stream.ages_s[-1] < 2 / HZ


@pytest.mark.parametrize("jitter_s", [0.0, 1.0 / HZ])
def test_a_backlog_that_neither_grows_nor_shrinks_is_skipped(monkeypatch, jitter_s: float) -> None:
    stream = Stream(regular(2400, jitter_s), each(1.0 / HZ, first_s=0.5)).play(monkeypatch)
    assert 50 <= stream.skipped <= 70
    assert all(age_s < 0.1 for when_s, _, age_s in stream.shown if when_s > 3.0)


def test_what_is_left_when_the_stream_ends_is_solved_however_long_it_takes(monkeypatch) -> None:
    stream = Stream(regular(20), each(0.09)).play(monkeypatch)
    assert stream.skipped == 0 and len(stream.shown) == 20 and stream.ages_s == sorted(stream.ages_s)


def test_an_engine_slower_than_patience_shows_the_newest(monkeypatch) -> None:
    stream = Stream(regular(2400), each(0.3)).play(monkeypatch)
    assert max(age_s for when_s, _, age_s in stream.shown if 2.0 < when_s < 20.0) < 1.3


def test_commands_stay_between_the_frames_they_came_between(monkeypatch) -> None:
    stream = Stream(regular(240), each(2.0 / HZ))
    stream.commands = {n: lambda: stream.solver.reset() for n in range(10, 240, 10)}
    stream.play(monkeypatch)
    assert stream.skipped > 0 and stream.said.count("reset") == 23
    resets = 0
    for said in stream.said:
        if said == "reset":
            resets += 1
        else:  # frames 10 to 19 come after the first of them and before the second
            assert said // 10 == resets
