"""Hands in the air: both wrists wander, and the digits of each hand go from posture to posture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.frames import FloatArray
from core.motion.stage import LEFT, RIGHT, START_WRIST, Act, Stage, names_of

_SETTLE_S = 1.7  # the last movement of an act begins so long before its end


def postures(names: Sequence[str], seconds: tuple[float, float] = (5.0, 11.0), lively: float = 1.0) -> Act:
    """An act: the digits take the postures `names`, the wrists wander. lively: how far the wrists go, 1 = freely."""

    def act(stage: Stage, begin_s: float, until_s: float) -> float:
        end_s = min(until_s, begin_s + stage.random.uniform(*seconds))
        ends = [_wander(stage, begin_s, end_s, lively)]
        ends += [_take(stage, hand, names, begin_s, end_s) for hand in (LEFT, RIGHT)]
        return max(ends)

    return act


def idle(stage: Stage, hand: int, begin_s: float, until_s: float) -> None:
    """A hand that has nothing to do is not still: it settles, a finger stirs, the wrist shifts a little."""
    random, score = stage.random, stage.scores[hand]
    names = names_of("rest")
    time_s = begin_s + random.uniform(0.3, 1.5)
    while time_s < until_s - _SETTLE_S:
        now, rest = score.now[6:], stage.again(str(random.choice(names)), hand)
        target = now + random.uniform(0.15, 0.6) * (rest - now)
        if random.random() < 0.4:
            target = now + 0.3 * (_one_finger(stage, hand, now) - now)
        end_s = stage.take(hand, time_s, target)
        if random.random() < 0.5:
            moved = score.now[:6] + np.concatenate([random.normal(0.0, 0.012, 3), random.normal(0.0, 0.05, 3)])
            end_s = max(end_s, score.wrist(time_s, moved))
        time_s = end_s + random.exponential(1.2)


def apart(stage: Stage, time_s: float) -> float:
    """Both wrists to where they started: away from each other."""
    ends = [stage.scores[hand].wrist(time_s, _near(stage, START_WRIST, 0.03, 0.15)) for hand in (LEFT, RIGHT)]
    return max(ends)


def wrist_targets(stage: Stage, lively: float) -> list[FloatArray]:
    """Where the two wrists go next: each in its own right-handed terms, (6,) position [m] and rotation vector."""
    random = stage.random
    middle, spread = np.array([0.0, 1.05, -0.33]), lively * stage.person.reach
    centre = middle + np.clip(random.uniform(-1.0, 1.0, 3) * (0.08, 0.12, 0.09) * spread, -0.12, 0.12)
    close = random.random() < 0.2
    apart_m = random.uniform(0.25, 0.29) if close else random.uniform(0.29, 0.44)
    tilt = random.uniform(-0.05, 0.05, 2)
    targets = []
    for sign in (-1.0, 1.0):  # left, right
        position = np.array([sign * centre[0] + apart_m / 2.0, centre[1] + sign * tilt[0], centre[2] + sign * tilt[1]])
        low, high = ((-0.3, -0.1, -0.5), (0.3, 0.2, 0.1)) if close else ((-0.5, -0.15, -1.3), (0.5, 0.6, 0.35))
        turn = START_WRIST[3:] + lively * (random.uniform(low, high) - START_WRIST[3:])
        targets.append(np.concatenate([position, turn]))
    return targets


def _wander(stage: Stage, begin_s: float, until_s: float, lively: float) -> float:
    random, time_s, end_s = stage.random, begin_s, begin_s
    while time_s < until_s - _SETTLE_S:
        swift = random.random() < 0.2
        targets = wrist_targets(stage, lively)
        duration_s = random.uniform(0.3, 0.45) if swift else None
        ends = [
            stage.scores[hand].wrist(time_s + random.uniform(0.0, 0.06), targets[hand], duration_s)
            for hand in (LEFT, RIGHT)
        ]
        end_s = max(ends)
        time_s = end_s + random.uniform(0.0, 0.9) * stage.person.tempo
    return end_s


def _take(stage: Stage, hand: int, names: Sequence[str], begin_s: float, until_s: float) -> float:
    """Posture after posture: held, returned from, repeated, halted on the way to."""
    random, person, score = stage.random, stage.person, stage.scores[hand]
    time_s = begin_s + random.uniform(0.0, 0.3)
    end_s, before = time_s, score.now[6:].copy()
    while time_s < until_s - _SETTLE_S:
        chance = random.random()
        if chance < 0.12:
            target = stage.again("relaxed", hand)
        elif chance < 0.22:
            target = before
        elif chance < 0.34:
            target = _one_finger(stage, hand, score.now[6:])
        else:
            target = stage.again(str(random.choice(names)), hand)
        before = score.now[6:].copy()
        if random.random() < person.hesitancy:
            halfway = before + random.uniform(0.3, 0.65) * (target - before)
            time_s = stage.take(hand, time_s, halfway) + random.uniform(0.1, 0.35)
        end_s = stage.take(hand, time_s, target)
        if random.random() < 0.1:
            end_s = _repeat(stage, hand, end_s, before, target)
        time_s = end_s + random.choice([0.03, 0.25, 0.8]) * random.uniform(0.6, 1.4) * person.tempo
    return end_s


def _one_finger(stage: Stage, hand: int, now: FloatArray) -> FloatArray:
    """One digit bends or stretches, its neighbours follow a little."""
    digit = int(stage.random.integers(0, 5))
    target = now.copy()
    bend = stage.random.uniform(0.3, 1.1) * (1.0 if now[4 * digit + 1] < 0.5 else -1.0)
    share = np.array([0.4, 0.0, 0.5, 0.7]) if digit == 0 else np.array([0.0, 1.0, 0.8, 0.5])
    target[4 * digit : 4 * digit + 4] += bend * share
    for other in (digit - 1, digit + 1):
        if digit and 1 <= other < 5:
            target[4 * other : 4 * other + 4] += 0.25 * bend * share
    return stage.person.within(target)


def _repeat(stage: Stage, hand: int, time_s: float, before: FloatArray, target: FloatArray) -> float:
    """Some of the way back and there again, a few times: waving, beckoning, squeezing."""
    back = target + stage.random.uniform(0.3, 0.7) * (before - target)
    for _ in range(int(stage.random.integers(1, 4))):
        time_s = stage.take(hand, time_s, back)
        time_s = stage.take(hand, time_s, target)
    return time_s


def _near(stage: Stage, wrist: FloatArray, position_m: float, turn_rad: float) -> FloatArray:
    random = stage.random
    moved: FloatArray = wrist + np.concatenate(
        [random.uniform(-position_m, position_m, 3), random.uniform(-turn_rad, turn_rad, 3)]
    )
    return moved
