"""The best names of all tracklets together, against every other way to name them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from core.relabel import choice
from core.relabel.choice import best_names
from core.relabel.names import NOBODY


def allowed(begin: np.ndarray, end: np.ndarray, name: np.ndarray) -> bool:
    """No two of one name share a frame."""
    return not any(
        name[a] == name[b] != NOBODY and begin[a] <= end[b] and begin[b] <= end[a]
        for a, b in itertools.combinations(range(len(name)), 2)
    )


def worth(gain: np.ndarray, name: np.ndarray) -> float:
    return float(sum(gain[t, k] for t, k in enumerate(name) if k != NOBODY))


def drawn(random: np.random.Generator, n: int, names: int, frames: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    begin = random.integers(0, frames, n)
    return begin, begin + random.integers(0, frames // 2, n), random.normal(0.5, 1.0, (n, names))


@pytest.mark.parametrize("seed", range(30))
def test_none_is_better(seed: int) -> None:
    begin, end, gain = drawn(np.random.default_rng(seed), 6, 3, 12)
    name = best_names(begin, end, gain)
    ways = (np.array(way) for way in itertools.product(range(-1, 3), repeat=6))
    best = max(worth(gain, way) for way in ways if allowed(begin, end, way))
    assert allowed(begin, end, name)
    assert worth(gain, name) == pytest.approx(best)
    assert all(gain[t, k] > 0.0 for t, k in enumerate(name) if k != NOBODY)


@pytest.mark.parametrize("most", [1500, 12])
def test_many_at_once_and_in_parts(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(choice, "MOST_AT_ONCE", most)
    begin, end, gain = drawn(np.random.default_rng(1), 60, 3, 120)
    name = best_names(begin, end, gain)
    assert allowed(begin, end, name)
    assert all(gain[t, k] > 0.0 for t, k in enumerate(name) if k != NOBODY)
    assert np.array_equal(name, best_names(begin, end, gain))
    for t in range(60 if most == 1500 else 0):  # nobody could simply be given a better name that is free
        now = gain[t, name[t]] if name[t] != NOBODY else 0.0
        for k in np.flatnonzero(gain[t] > now + 1e-9):
            others = np.flatnonzero(name == k)
            assert ((begin[others] <= end[t]) & (end[others] >= begin[t])).any()


def test_what_is_fixed_stays_and_keeps_its_frames() -> None:
    begin, end = np.array([0, 3, 6]), np.array([4, 7, 9])
    gain = np.array([[0.0, 0.0], [9.0, 1.0], [9.0, 2.0]])
    fixed = np.array([0, NOBODY, NOBODY])
    assert best_names(begin, end, gain, fixed).tolist() == [0, 1, 0]
    assert best_names(begin, end, gain).tolist()[1:] in ([0, 1], [1, 0])


def test_the_order_of_time_and_of_tracklets_does_not_count() -> None:
    begin, end, gain = drawn(np.random.default_rng(3), 60, 4, 60)
    name = best_names(begin, end, gain)
    order = np.random.default_rng(4).permutation(60)
    assert np.array_equal(best_names(begin[order], end[order], gain[order]), name[order])
    assert np.array_equal(best_names(99 - end, 99 - begin, gain), name)


def test_nothing_to_name() -> None:
    nobody = np.empty(0, dtype=np.int64)
    assert len(best_names(nobody, nobody, np.empty((0, 3)))) == 0
    assert best_names(np.array([0]), np.array([5]), np.array([[-1.0, 0.0]])).tolist() == [NOBODY]
