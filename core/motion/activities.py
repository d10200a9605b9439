"""What a performer does: acts by activity, and how often each is chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from core.motion.acts.free import postures
from core.motion.acts.handling import between_palms, lay_out, take_up
from core.motion.acts.keys import counting, piano, range_of_motion, signs
from core.motion.acts.together import meet
from core.motion.acts.tools import hold_controller, lay_out_pen, play, write
from core.motion.stage import Act, Stage, names_of


@dataclass(frozen=True)
class Activity:
    """title: in a user's words. acts: each with its share. things: lays out what there is to take up; None: nothing."""

    title: str
    acts: Mapping[Act, float]
    things: Callable[[Stage], None] | None = None


_GESTURES = postures(names_of("gesture", "rest", "counting"))
_GRASPS = postures(names_of("grasp", "pinch"), lively=0.8)

ACTIVITIES: Mapping[str, Activity] = {
    "free": Activity("poses of every kind in the air, hands apart", {postures(names_of()): 1.0}),
    "everyday": Activity(
        "a bit of everything: things taken up, gestures, hands that meet",
        {take_up: 0.3, between_palms: 0.08, meet: 0.2, _GESTURES: 0.27, _GRASPS: 0.1, counting: 0.05},
        things=lay_out,
    ),
    "grasping": Activity(
        "things taken up, carried, passed on and set down",
        {take_up: 0.55, between_palms: 0.1, _GRASPS: 0.35},
        things=lay_out,
    ),
    "gestures": Activity("gestures in the air, now and then with both hands", {_GESTURES: 0.85, meet: 0.15}),
    "counting": Activity("fingers counted", {counting: 1.0}),
    "piano": Activity("a keyboard played", {piano: 1.0}),
    "signs": Activity("hand shapes of a fingerspelling", {signs: 1.0}),
    "hands": Activity("both hands meet: palms together, fingers interlaced, one hand on the other", {meet: 1.0}),
    "range": Activity("every joint through its range, as before a calibration", {range_of_motion: 1.0}),
    "pen": Activity("a pen that writes, and points at the other hand", {write: 1.0}, things=lay_out_pen),
    "controller": Activity(
        "a game controller in one hand: aimed, its trigger pulled, its stick pushed",
        {play: 1.0},
        things=hold_controller,
    ),
}
