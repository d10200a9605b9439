"""Hand of a glove size, or of what a tape measures.

Takes a size from XS to XL, or any of --length, --palm-length, --breadth and --circumference. What is not measured
is as likely as it can be for such a hand. The profile keeps its layout, its sides and its subspace.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict

from app.calibrate.neutral import say_dropped
from app.commands.out import out_file
from app.commands.result import Result
from core.errors import PhalanxError
from core.hand.measures import HandMeasures, measure
from core.hand.sizes import GLOVE_MM, SIZES
from core.hand.skeleton import DIGITS
from core.hand.tape import TAPES, shape_of_measures
from core.printable import printable
from core.profile import load_profile, save_profile

_TAPE_HELP = {
    "length": "wrist crease to the tip of the middle finger",
    "palm_length": "wrist crease to the crease at the base of the middle finger",
    "breadth": "across the knuckles, without the thumb",
    "circumference": "around the knuckles, without the thumb",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this calibration."""
    parser.add_argument("size", metavar="SIZE", nargs="?", choices=tuple(GLOVE_MM), help=", ".join(GLOVE_MM))
    for name in TAPES:
        parser.add_argument(f"--{name.replace('_', '-')}", metavar="MM", type=float, help=f"[mm] {_TAPE_HELP[name]}")
    parser.add_argument("--profile", metavar="P", required=True, help="profile file, or a layout on a generic hand")
    parser.add_argument("--performer", metavar="NAME", help="whose hand it is; default: as in the profile")
    parser.add_argument("--out", metavar="PROFILE", type=out_file, required=True, help="profile file to write")


def run(arguments: argparse.Namespace) -> Result:
    """Gives the profile the hand, says what it measures, and writes the profile."""
    taped_m = {name: getattr(arguments, name) / 1e3 for name in TAPES if getattr(arguments, name) is not None}
    if bool(arguments.size) == bool(taped_m):
        raise PhalanxError(
            "Give one of both: a size, or what was measured.",
            f"Sizes are {', '.join(GLOVE_MM)}; measures are --length, --palm-length, --breadth and --circumference.",
        )
    profile = load_profile(arguments.profile)
    shape = SIZES[arguments.size] if arguments.size else shape_of_measures(taped_m)
    performer = profile.performer if arguments.performer is None else arguments.performer
    fitted = profile.with_hand(performer=performer, shape=shape, scale=1.0)
    measures = measure(fitted.hand)
    save_profile(fitted, arguments.out)
    _say(measures)
    print(f"{printable(arguments.out)} written.")
    say_dropped(profile)
    return Result(
        figures={
            "size": arguments.size,
            "performer": performer,
            "measures_mm": {name: value * 1e3 for name, value in asdict(measures).items()},
            "shape": shape.to_dict(),
            "profile": arguments.out,
        }
    )


def _say(measures: HandMeasures) -> None:
    print(
        f"A hand of {measures.length * 1e3:.0f} mm, its palm {measures.palm_length * 1e3:.0f} mm; "
        f"{measures.breadth * 1e3:.0f} mm broad and {measures.circumference * 1e3:.0f} mm around the knuckles."
    )
    for digit, length_m, girth_m in zip(DIGITS, measures.digit_lengths, measures.digit_girths, strict=True):
        joint = "IP" if digit == "thumb" else "PIP"
        print(f"  {digit:7} {length_m * 1e3:5.1f} mm long, {girth_m * 1e3:5.1f} mm around its {joint} joint")
