"""Tools: a pen that writes and points at the other hand's markers, a game controller that is aimed and played."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import FloatArray
from core.hand.skeleton import N_ROOT_DOFS
from core.motion.acts.free import idle
from core.motion.acts.handling import lay, step_aside, with_thing
from core.motion.library import LIBRARY
from core.motion.stage import LEFT, RIGHT, Hold, Stage, Thing, in_proportion, in_terms_of, transform_of, wrist_at

_SETTLE_S = 1.5
_LEFT_HANDED = 0.12
_PENS = ("writing_tripod", "tripod_variation")
_CONTROLLER = "pistol_grip"  # index and thumb are free for trigger and stick
_NIB = np.array([0.0, 0.0, -0.5, 1.0])
"""The end of a pen that writes, in its own frame and length."""

_HOVER_M, _TOUCH_M = 0.035, 0.009
"""From the nib to the skin: a marker stands in between."""

_TARGETS = np.array([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 17])
"""Bones that a pen points at: all but two metacarpals."""


def lay_out_pen(stage: Stage) -> None:
    """Puts a pen before the hand that writes."""
    grasps = [LIBRARY[_PENS[int(number)]] for number in stage.random.permutation(len(_PENS))]
    lay(stage, _preferred(stage), grasps)


def hold_controller(stage: Stage) -> None:
    """One hand holds a controller, from beginning to end."""
    known, hand = LIBRARY[_CONTROLLER], _preferred(stage)
    assert known.prop is not None
    prop = in_proportion(known.prop, stage.size)
    score = stage.scores[hand]
    score.begin_with(stage.posture(known.name, hand))
    held = in_terms_of(hand, transform_of(score.start[:N_ROOT_DOFS]) @ prop.transform_hand)
    stage.things.append(Thing(_CONTROLLER, prop, held, known.name, score.start[:N_ROOT_DOFS], np.zeros(3)))
    stage.holds.append(Hold(0.0, 0, hand, prop.transform_hand))


def write(stage: Stage, begin_s: float, until_s: float) -> float:
    """A hand takes the pen, writes, points at the other hand's fingers, and lays the pen down."""
    return with_thing(stage, 0, _hand_of(stage.things[0]), _write_and_point, begin_s, until_s)


def play(stage: Stage, begin_s: float, until_s: float) -> float:
    """The controller is aimed here and there, its trigger pulled and its stick pushed."""
    random = stage.random
    hand = _hand_of(stage.things[0])
    score, closed = stage.scores[hand], stage.posture(stage.things[0].posture, hand)
    time_s = begin_s
    end_s = min(begin_s + random.uniform(6.0, 12.0), until_s - _SETTLE_S)
    while time_s < end_s:
        place = np.array([random.uniform(0.14, 0.28), random.uniform(0.98, 1.2), random.uniform(-0.42, -0.26)])
        yaw, pitch, roll = random.uniform((-0.2, -0.4, -1.4), (0.6, 0.5, -0.3))
        arrives_s = score.wrist(time_s, wrist_at(place, yaw, pitch, roll), 0.35 if random.random() < 0.3 else None)
        time_s = _press(stage, hand, closed, time_s + random.uniform(0.0, 0.4), arrives_s)
    score.digits(time_s, closed, None, np.zeros(5))
    time_s += 0.4
    idle(stage, 1 - hand, begin_s, time_s)
    return time_s


def _preferred(stage: Stage) -> int:
    return LEFT if stage.random.random() < _LEFT_HANDED else RIGHT


def _hand_of(thing: Thing) -> int:
    return LEFT if thing.home[0, 3] < 0.0 else RIGHT


def _write_and_point(stage: Stage, thing: Thing, hand: int, aside_s: float, time_s: float) -> tuple[float, float]:
    free_s = aside_s
    for _ in range(int(stage.random.integers(2, 5))):
        begun_s = time_s
        time_s = _line(stage, hand, time_s)
        idle(stage, 1 - hand, max(free_s, begun_s), time_s)
        free_s = time_s
        if stage.random.random() < 0.8:
            time_s = free_s = _point_out(stage, thing, hand, time_s)
    return time_s, free_s


def _line(stage: Stage, hand: int, time_s: float) -> float:
    """Strokes of some millimetres, from left to right, with lifts in between."""
    random, score, tempo = stage.random, stage.scores[hand], stage.person.tempo
    place = np.array([random.uniform(0.16, 0.22), random.uniform(0.98, 1.04), random.uniform(-0.36, -0.30)])
    base = wrist_at(
        place, yaw=random.uniform(0.1, 0.4), pitch=random.uniform(0.0, 0.2), roll=random.uniform(-0.5, -0.2)
    )
    time_s = score.wrist(time_s, base)
    calm_s = time_s
    onward = 1.0 if hand == RIGHT else -1.0  # lines run to the right for either hand
    for stroke in range(int(random.integers(12, 28))):
        target = base.copy()
        lift_m = random.uniform(0.004, 0.010) if random.random() < 0.15 else 0.0
        target[:3] += (onward * 0.0025 * stroke + random.uniform(-0.005, 0.005), lift_m, random.uniform(-0.008, 0.008))
        target[3:] += random.normal(0.0, 0.02, 3)
        time_s = score.wrist(time_s, target, tempo * random.uniform(0.10, 0.22), exact=True)
    score.calm(calm_s, time_s)
    return time_s


def _point_out(stage: Stage, thing: Thing, hand: int, time_s: float) -> float:
    """The other hand is held out, and the pen's tip goes to one of its fingers after another."""
    random, tempo, other = stage.random, stage.person.tempo, 1 - hand
    score, pointed = stage.scores[hand], stage.scores[other]
    held_out = wrist_at(
        np.array([random.uniform(0.02, 0.07), random.uniform(1.0, 1.06), random.uniform(-0.32, -0.26)]),
        yaw=random.uniform(0.1, 0.5), pitch=random.uniform(-0.1, 0.25), roll=random.uniform(-0.3, 0.3),
    )  # fmt: skip
    angles = stage.again(str(random.choice(["relaxed", "rest_open", "flat"])), other)
    ready_s = max(pointed.wrist(time_s, held_out), stage.take(other, time_s, angles))
    posed = stage.posed(other, held_out, angles)
    if hand == LEFT:
        posed = posed.mirrored()  # everything in the terms of the hand with the pen

    calm_s = ready_s
    for bone in random.choice(_TARGETS, int(random.integers(2, 6)), replace=False):
        joint = bone + 1 if bone < len(_TARGETS) - 2 else 0
        outward = posed.rotations[0, joint, :, 1]
        skin = 0.5 * (posed.starts_m[0, bone] + posed.ends_m[0, bone]) + stage.flesh.radii_m[bone] * outward
        above, touching = (_nib_at(thing, skin + away * outward, outward) for away in (_HOVER_M, _TOUCH_M))
        time_s = max(score.wrist(time_s, above), ready_s)
        time_s = score.wrist(time_s, touching, tempo * random.uniform(0.25, 0.45), exact=True)
        time_s += random.uniform(0.1, 0.6)
        time_s = score.wrist(time_s, above, tempo * random.uniform(0.25, 0.4), exact=True)
    for one in (score, pointed):
        one.calm(calm_s, time_s)
    away = score.now[:6] + np.array([0.12, 0.06, 0.0, 0.0, 0.0, 0.0])
    time_s = score.wrist(time_s, away)
    return max(time_s, step_aside(stage, other, time_s - 0.2))


def _nib_at(thing: Thing, place_m: FloatArray, outward: FloatArray) -> FloatArray:
    """(6,): the wrist with which the pen's tip is at place_m, the pen leaning to its own hand's side."""
    nib, middle = thing.prop.transform_hand @ (_NIB * (1.0, 1.0, thing.prop.size_m[1], 1.0)), thing.prop.transform_hand
    along = (nib[:3] - middle[:3, 3]) / np.linalg.norm(nib[:3] - middle[:3, 3])
    base = Rotation.from_rotvec(wrist_at(np.zeros(3), yaw=0.3, pitch=0.1, roll=-0.4)[3:])
    wanted = -outward + np.array([-0.5, 0.0, -0.2])
    turn = Rotation.align_vectors([wanted / np.linalg.norm(wanted)], [base.apply(along)])[0] * base
    return np.concatenate([place_m - turn.apply(nib[:3]), turn.as_rotvec()])


def _press(stage: Stage, hand: int, closed: FloatArray, time_s: float, until_s: float) -> float:
    """Index on the trigger, thumb on the stick: up and down until a time [s]."""
    random, score = stage.random, stage.scores[hand]
    while time_s < until_s + random.uniform(0.0, 0.5):
        target = closed.copy()
        target[4:8] += random.uniform(-0.35, 0.1) * np.array([0.0, 0.6, 1.0, 0.4])
        target[:4] += random.uniform(-0.15, 0.15, 4)
        time_s = score.digits(time_s, stage.person.within(target), random.uniform(0.2, 0.35), np.zeros(5))
        time_s += random.choice([0.0, 0.05, 0.4])
    return time_s
