"""Things in the hands: reached for, taken, carried, passed on and set down again where they were.

A prop never moves but with the hand that holds it, and hands are still against the world when one is taken or left, so
its path is as smooth as theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import FloatArray
from core.hand.poses import pose
from core.motion.acts.free import apart, idle
from core.motion.capsules import prop_touches
from core.motion.library import LIBRARY, LibraryPose, Prop
from core.motion.stage import (
    LEFT,
    RIGHT,
    START_WRIST,
    Hold,
    OverTime,
    Stage,
    Thing,
    in_proportion,
    in_terms_of,
    transform_of,
    wrist_at,
    wrist_of,
)

_OPEN = 0.6
"""How far a hand opens before it closes: from the grasp (0) to the open hand (1)."""

_WITHDRAWALS_M: FloatArray = 0.085 * np.array(
    [[0.0, 0.6, 0.8], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.8, 0.0], [0.6, 0.0, 0.8]]
)
"""Where the hand may be before and after, against the grasp, in its own frame: behind, above, to the little finger."""

_BARRED_M = 0.004
"""A way to a prop that leads so deep through it is none: fingers give way, palms do not."""

_BAR_M = 0.22
"""Length of a cylinder that fills the hand: two hands can hold it."""

_BARS = 0.4  # share of things that are one at least

_TWO_HANDS_M = 0.115
"""From hand to hand on a bar."""

_BOX = Prop("box", (0.17, 0.11, 0.14), np.eye(4))
"""What both palms hold between them."""


Use = Callable[[Stage, Thing, int, float, float], tuple[float, float]]
"""What a hand does with the thing that it has taken: plays from a time [s], with the other hand free from another one,
and returns when it has ended, and from when on the other hand is free again."""


def lay_out(stage: Stage) -> None:
    """Puts a thing before either hand, and a box for both."""
    random = stage.random
    known = [one for one in LIBRARY.values() if one.activity == "grasp" and one.prop is not None]
    for hand in (LEFT, RIGHT):
        order = [known[int(number)] for number in random.permutation(len(known))]
        if random.random() < _BARS:
            order.sort(key=lambda one: not _is_bar(_in_proportion(one, 1.0)))
        lay(stage, hand, order)
    home = np.eye(4)
    home[:3, 3] = 0.0, random.uniform(0.70, 0.73), random.uniform(-0.50, -0.46)
    box = Prop(_BOX.shape, tuple(length * stage.size for length in _BOX.size_m), np.eye(4))
    stage.things.append(Thing("box", box, home, "flat", START_WRIST, np.zeros(3)))


def lay(stage: Stage, hand: int, grasps: Sequence[LibraryPose]) -> None:
    """Puts what the first of the grasps holds before a hand; the first that the hand can reach into."""
    random = stage.random
    for one in grasps:
        prop = _in_proportion(one, stage.size)
        back_m = _way_out(stage, prop, stage.posture(one.name, hand), hand)
        if back_m is not None:
            break
    assert back_m is not None, "the library holds no prop that a hand can reach"
    wrist = wrist_at(
        np.array([random.uniform(0.36, 0.40), random.uniform(0.77, 0.81), random.uniform(-0.46, -0.40)]),
        yaw=random.uniform(0.0, 0.3), pitch=random.uniform(-0.25, 0.1), roll=random.uniform(-0.45, 0.05),
    )  # fmt: skip
    home = in_terms_of(hand, transform_of(wrist) @ prop.transform_hand)
    name = f"{one.name}_{'left' if hand == LEFT else 'right'}"
    stage.things.append(Thing(name, prop, home, one.name, wrist, back_m))


def take_up(stage: Stage, begin_s: float, until_s: float) -> float:
    """One hand takes its thing, carries it about, perhaps to the other hand and back, and sets it down where it was."""
    hand = int(stage.random.integers(2))
    return with_thing(stage, hand, hand, _carry_about, begin_s, until_s)


def with_thing(stage: Stage, number: int, hand: int, use: Use, begin_s: float, until_s: float) -> float:
    """A hand takes a thing by its number, uses it, and sets it down where it was. Raises OverTime."""
    random, tempo = stage.random, stage.person.tempo
    score, thing = stage.scores[hand], stage.things[number]
    closed = stage.posture(thing.posture, hand)
    opened = _opened(stage, closed, hand)
    aside_s = step_aside(stage, 1 - hand, begin_s)

    time_s = score.wrist(max(begin_s, aside_s - 0.4), _before(thing))
    time_s = max(score.wrist(time_s - 0.15, _withdrawn(thing, thing.wrist)), stage.take(hand, begin_s, opened))
    calm_s = time_s
    time_s = score.wrist(time_s, thing.wrist, tempo * random.uniform(0.4, 0.6), exact=True)
    time_s = stage.take(hand, time_s, closed, tempo * random.uniform(0.3, 0.5)) + random.uniform(0.05, 0.2)
    stage.holds.append(Hold(time_s, number, hand, thing.prop.transform_hand))
    score.calm(calm_s, time_s)
    time_s, free_s = use(stage, thing, hand, aside_s, time_s)
    time_s = score.wrist(time_s, thing.wrist) + 0.6
    stage.holds.append(Hold(time_s, number, None, thing.home))
    calm_s = time_s - 0.1
    time_s = stage.take(hand, time_s, opened, tempo * random.uniform(0.35, 0.5))
    time_s = score.wrist(time_s, _withdrawn(thing, thing.wrist), tempo * random.uniform(0.4, 0.6), exact=True)
    score.calm(calm_s, time_s)
    time_s = score.wrist(time_s, _before(thing))
    idle(stage, 1 - hand, free_s + 1.0, time_s)
    stage.take(hand, time_s, stage.again("relaxed", hand))
    time_s = apart(stage, time_s - 0.1)
    if time_s > until_s:
        raise OverTime
    return time_s


def _carry_about(stage: Stage, thing: Thing, hand: int, aside_s: float, time_s: float) -> tuple[float, float]:
    """Somewhere, and somewhere else; what fills the hand perhaps to the other hand and back."""
    random, score = stage.random, stage.scores[hand]
    for _ in range(int(random.integers(1, 4))):
        time_s = score.wrist(time_s, _carried(stage, thing.wrist)) + random.uniform(0.0, 0.7)
    idle(stage, 1 - hand, aside_s, time_s)
    free_s = time_s
    if _is_bar(thing.prop) and random.random() < 0.75:
        time_s = free_s = _pass_and_back(stage, hand, time_s)
    return time_s, free_s


def between_palms(stage: Stage, begin_s: float, until_s: float) -> float:
    """Both palms take a box between them, carry it about and set it down."""
    random, tempo, number = stage.random, stage.person.tempo, 2
    thing = stage.things[number]
    wrist = wrist_at(np.zeros(3), yaw=0.0, pitch=random.uniform(-0.1, 0.15), roll=-np.pi / 2.0)
    wrist[:3] = thing.home[:3, 3] + (0.0, random.uniform(-0.02, 0.01), 0.105 * stage.size)
    flat = [stage.posture("flat", hand) for hand in (LEFT, RIGHT)]
    touching = []
    for hand in (LEFT, RIGHT):
        posed = stage.flesh.posed(np.concatenate([wrist, flat[hand]])[None])
        shifts = np.linspace(0.05, 0.20, 151)
        moved = posed[np.zeros(len(shifts), dtype=np.int64)].moved(shifts[:, None] * (1.0, 0.0, 0.0))
        home = np.broadcast_to(in_terms_of(hand, thing.home), (len(shifts), 4, 4))
        gaps = prop_touches(moved, stage.flesh.radii_m, thing.prop, home).gap_m.min(axis=1)
        near = shifts[int(np.argmax(gaps > -0.0005))]
        touching.append(wrist + np.array([near, 0.0, 0.0, 0.0, 0.0, 0.0]))

    clear = [one + np.array([0.06, 0.1, 0.06, 0.0, 0.0, 0.0]) for one in touching]
    beside = [one + np.array([0.06, 0.0, 0.0, 0.0, 0.0, 0.0]) for one in touching]
    time_s = stage.both(begin_s, clear)
    for hand in (LEFT, RIGHT):
        time_s = max(time_s, stage.take(hand, begin_s + 0.2, flat[hand]))
    calm_s = time_s
    time_s = stage.both(time_s, beside)
    time_s = stage.both(time_s, touching, tempo * random.uniform(0.3, 0.5)) + random.uniform(0.05, 0.2)
    grip = np.linalg.inv(transform_of(touching[RIGHT])) @ thing.home
    stage.holds.append(Hold(time_s, number, RIGHT, grip))
    for _ in range(int(random.integers(1, 4))):
        shift = random.uniform((-0.08, 0.02, -0.03), (0.08, 0.15, 0.1))
        mirrored = shift * (-1.0, 1.0, 1.0)
        targets = [
            np.concatenate([one[:3] + way, one[3:]]) for one, way in zip(touching, (mirrored, shift), strict=True)
        ]
        time_s = stage.both(time_s, targets) + random.uniform(0.0, 0.6)
    time_s = stage.both(time_s, touching) + random.uniform(0.1, 0.3)
    stage.holds.append(Hold(time_s, number, None, thing.home))
    time_s = stage.both(time_s, beside, tempo * random.uniform(0.3, 0.5))
    time_s = stage.both(time_s, clear, tempo * random.uniform(0.3, 0.5))
    for hand in (LEFT, RIGHT):
        stage.scores[hand].calm(calm_s, time_s)
    time_s = apart(stage, time_s)
    if time_s > until_s:
        raise OverTime
    return time_s


def _pass_and_back(stage: Stage, hand: int, time_s: float) -> float:
    """A bar goes upright to the middle, the other hand takes it below, carries it and gives it back."""
    random, tempo, other = stage.random, stage.person.tempo, 1 - hand
    giver, taker, thing = stage.scores[hand], stage.scores[other], stage.things[hand]
    grip = thing.prop.transform_hand
    base = Rotation.from_rotvec(wrist_at(np.zeros(3), yaw=0.35, pitch=0.25, roll=-np.pi / 2.0)[3:])
    axis = base.apply(grip[:3, 2])
    upright = Rotation.align_vectors([[0.0, np.sign(axis[1]) or 1.0, 0.0]], [axis])[0] * base
    held = np.eye(4)
    held[:3, :3] = upright.as_matrix()
    held[:3, 3] = np.array([0.0, random.uniform(1.06, 1.12), -0.38]) - held[:3, :3] @ grip[:3, 3]
    give = wrist_of(held)
    take = give - np.array([0.0, _TWO_HANDS_M * stage.size, 0.0, 0.0, 0.0, 0.0])
    bar = in_terms_of(other, in_terms_of(hand, held @ grip))  # where it then is, in the terms of the other hand
    closed = stage.posture(thing.posture, other)
    opened = _opened(stage, closed, other)

    ready_s = max(taker.wrist(time_s, _withdrawn(thing, take)), stage.take(other, time_s, opened))
    time_s = max(giver.wrist(time_s, give, exact=True), ready_s) + 0.1
    calm_s = time_s - 0.2
    time_s = taker.wrist(time_s, take, tempo * random.uniform(0.4, 0.6), exact=True)
    time_s = stage.take(other, time_s, closed, tempo * random.uniform(0.3, 0.45)) + random.uniform(0.05, 0.2)
    stage.holds.append(Hold(time_s, hand, other, np.linalg.inv(transform_of(take)) @ bar))
    time_s = stage.take(hand, time_s, _opened(stage, stage.posture(thing.posture, hand), hand))
    time_s = giver.wrist(time_s, _withdrawn(thing, give), tempo * random.uniform(0.4, 0.6), exact=True)
    for score in (giver, taker):
        score.calm(calm_s, time_s)
    time_s = taker.wrist(time_s, _carried(stage, take)) + random.uniform(0.0, 0.5)
    time_s = taker.wrist(time_s, take, exact=True) + 0.6
    calm_s = time_s - 0.1
    time_s = giver.wrist(time_s, give, tempo * random.uniform(0.4, 0.6), exact=True)
    time_s = stage.take(hand, time_s, stage.posture(thing.posture, hand)) + random.uniform(0.05, 0.2)
    stage.holds.append(Hold(time_s, hand, hand, grip))
    time_s = stage.take(other, time_s, opened)
    time_s = taker.wrist(time_s, _withdrawn(thing, take), tempo * random.uniform(0.4, 0.6), exact=True)
    for score in (giver, taker):
        score.calm(calm_s, time_s)
    step_aside(stage, other, time_s)
    return time_s


def _in_proportion(known: LibraryPose, size: float) -> Prop:
    """What a pose holds, in proportion to the hand; a cylinder that fills it is a bar."""
    assert known.prop is not None
    prop = in_proportion(known.prop, size)
    if prop.shape == "cylinder" and len(known.contacts) >= 4 and prop.size_m[0] > 0.02:
        return Prop(prop.shape, (prop.size_m[0], max(prop.size_m[1], _BAR_M)), prop.transform_hand)
    return prop


def _is_bar(prop: Prop) -> bool:
    return prop.shape == "cylinder" and prop.size_m[1] >= _BAR_M


def _opened(stage: Stage, closed: FloatArray, hand: int) -> FloatArray:
    """The hand before it closes about something."""
    wide = stage.person.posture(0.5 * (pose("spread") + pose("relaxed")), hand)
    return stage.person.within(closed + _OPEN * (wide - closed))


def _withdrawn(thing: Thing, wrist: FloatArray) -> FloatArray:
    back = Rotation.from_rotvec(wrist[3:]).apply(thing.back_m)
    return np.concatenate([wrist[:3] + back, wrist[3:]])


def _before(thing: Thing) -> FloatArray:
    """Twice as far out on that way, and higher: from here nothing is in the way."""
    far = _withdrawn(thing, _withdrawn(thing, thing.wrist))
    return np.concatenate([far[:3] + (0.0, 0.05, 0.0), far[3:]])


def _way_out(stage: Stage, prop: Prop, closed: FloatArray, hand: int) -> FloatArray | None:
    """(3,) [m], where the open hand leaves a prop to, in its own frame; None where every way leads through it."""
    opened = _opened(stage, closed, hand)
    shares = np.linspace(0.0, 1.0, 9)
    theta = np.zeros((len(_WITHDRAWALS_M), len(shares) + 1, 26))
    theta[:, 0, 6:] = closed
    theta[:, 1:, :3] = _WITHDRAWALS_M[:, None] * shares[:, None]
    theta[:, 1:, 6:] = opened
    posed = stage.flesh.posed(theta.reshape(-1, 26))
    transforms = np.broadcast_to(prop.transform_hand, (len(posed.joints_m), 4, 4))
    gaps = prop_touches(posed, stage.flesh.radii_m, prop, transforms).gap_m.min(axis=1).reshape(theta.shape[:2])
    best = int(gaps.min(axis=1).argmax())
    if gaps[best].min() < -_BARRED_M:
        return None
    back_m: FloatArray = _WITHDRAWALS_M[best].copy()
    return back_m


def _carried(stage: Stage, wrist: FloatArray) -> FloatArray:
    """Somewhere near, a little turned, on the hand's own side."""
    random = stage.random
    moved: FloatArray = wrist + np.concatenate([random.uniform(-0.06, 0.12, 3), random.uniform(-0.35, 0.35, 3)])
    moved[:3] = np.clip(moved[:3] + (-0.05, 0.1, 0.08), (0.19, 0.98, -0.38), (0.30, 1.2, -0.22))
    return moved


def step_aside(stage: Stage, hand: int, time_s: float) -> float:
    """Out of the way, relaxed."""
    aside = START_WRIST + np.concatenate([stage.random.uniform((0.02, -0.03, 0.0), (0.06, 0.03, 0.05)), np.zeros(3)])
    stage.take(hand, time_s + stage.random.uniform(0.0, 0.3), stage.again("relaxed", hand))
    return stage.scores[hand].wrist(time_s, aside)
