"""Fingers one by one: playing a keyboard, counting, and each joint through its range."""

from __future__ import annotations

import numpy as np

from core.frames import FloatArray
from core.motion.acts.free import idle, postures, wrist_targets
from core.motion.score import finger_lags
from core.motion.stage import LEFT, RIGHT, Act, Stage, names_of, wrist_at

_KEY_M = 0.0232


def piano(stage: Stage, begin_s: float, until_s: float) -> float:
    """Both hands on a keyboard: notes and chords under the hand, now and then a shift along the keys."""
    random = stage.random
    end_s = min(until_s, begin_s + random.uniform(6.0, 12.0))
    wrists = [
        wrist_at(np.array([random.uniform(0.15, 0.2), 1.0, -0.33]), yaw=random.uniform(-0.05, 0.15), pitch=0.08)
        for _ in range(2)
    ]
    ends = []
    for hand in (LEFT, RIGHT):
        score = stage.scores[hand]
        curved = stage.again(str(random.choice(names_of("piano"))), hand)
        time_s = max(score.wrist(begin_s, wrists[hand]), stage.take(hand, begin_s, curved))
        beat_s = stage.person.tempo * random.uniform(0.22, 0.42)
        while time_s < end_s - 2.0:
            if random.random() < 0.12:
                shift = wrists[hand].copy()
                shift[0] = np.clip(shift[0] + _KEY_M * random.integers(-3, 4), 0.13, 0.23)
                time_s = score.wrist(time_s, shift)
                curved = stage.again(str(random.choice(names_of("piano"))), hand)
                time_s = max(time_s, stage.take(hand, time_s, curved, lag_s=np.zeros(5)))
            played = list(random.choice(5, size=random.choice([1, 1, 1, 2, 3]), replace=False))
            time_s = _strike(stage, hand, time_s, curved, played, beat_s)
        ends.append(time_s)
    return max(ends)


def _strike(stage: Stage, hand: int, time_s: float, curved: FloatArray, played: list[int], beat_s: float) -> float:
    """The digits of `played` lift, strike and come back; the key stops the finger, so it comes back faster."""
    score, depth = stage.scores[hand], stage.random.uniform(0.2, 0.38)
    lifted, down = curved.copy(), curved.copy()
    for digit in played:
        part = [0, 2] if digit == 0 else [1, 2]
        for joint, share in zip(part, (1.0, 0.35), strict=True):
            lifted[4 * digit + joint] -= 0.45 * depth * share
            down[4 * digit + joint] += depth * share * (0.6 if digit == 0 else 1.0)
    lags = np.zeros(5)
    time_s = score.digits(time_s, stage.person.within(lifted), 0.5 * beat_s, lags)
    time_s = score.digits(time_s, stage.person.within(down), 0.45 * beat_s, lags)
    held_s = beat_s * stage.random.choice([0.0, 0.5, 1.5])
    return score.digits(time_s + held_s, curved, 0.5 * beat_s, lags)


def counting(stage: Stage, begin_s: float, until_s: float) -> float:
    """One hand or both count, in order, up or down, and begin again from a fist."""
    random = stage.random
    names = list(names_of("counting"))
    upwards = names if random.random() < 0.7 else names[::-1]
    first = int(random.integers(0, max(len(upwards) - 5, 1)))
    hands = [(LEFT, RIGHT), (RIGHT,), (LEFT,)][int(random.choice(3, p=[0.4, 0.4, 0.2]))]
    targets = wrist_targets(stage, 0.6)
    time_s = begin_s
    for hand in hands:
        shown = targets[hand].copy()
        shown[3:] = wrist_at(np.zeros(3), yaw=0.1, pitch=random.uniform(0.7, 1.1), roll=random.uniform(-0.5, 0.2))[3:]
        time_s = max(time_s, stage.scores[hand].wrist(begin_s, shown))
    for name in ["fist", *upwards[first : first + int(random.integers(4, 7))]]:
        if time_s > until_s - 1.5:
            break
        ends = [stage.take(hand, time_s + random.uniform(0.0, 0.04), stage.again(name, hand)) for hand in hands]
        time_s = max(ends) + random.uniform(0.15, 0.6) * stage.person.tempo
    for hand in {LEFT, RIGHT}.difference(hands):
        idle(stage, hand, begin_s, time_s)
    return time_s


def range_of_motion(stage: Stage, begin_s: float, until_s: float) -> float:
    """Spread, flat, every finger bent and stretched in turn, a fist, the thumb across: as before a calibration."""
    random, time_s = stage.random, begin_s
    wrists = wrist_targets(stage, 0.5)
    for hand in (LEFT, RIGHT):
        time_s = max(time_s, stage.scores[hand].wrist(begin_s, wrists[hand]))
    order = list(range(5)) if random.random() < 0.5 else list(range(4, -1, -1))
    rounds = [("flat", 0.0), ("spread", 0.0), ("hook", 0.11), ("flat", 0.11), ("fist", 0.09), ("spread", 0.09)]
    rounds += [("cup", 0.0), ("thumbs_up", 0.0), ("pinch_index", 0.0), ("pinch_middle", 0.0), ("relaxed", 0.0)]
    first = int(random.integers(0, 6))
    for name, wave_s in rounds[first : first + 6]:
        if time_s > until_s - 2.0:
            break
        lags = finger_lags(order, wave_s) if wave_s else None
        ends = [stage.take(hand, time_s, stage.again(name, hand), None, lags) for hand in (LEFT, RIGHT)]
        time_s = max(ends) + random.uniform(0.1, 0.5)
    return time_s


signs: Act = postures(names_of("sign"), lively=0.5)
"""The hand shapes of a fingerspelling, before the body."""
