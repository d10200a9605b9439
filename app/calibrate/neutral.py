"""zero of each joint angle, from a hand that is held flat, or at angles that a goniometer read.

A good trial: the hand lies flat on a table, all markers seen, for two seconds. Angles are then reported as they are
tracked less what they were in the trial; each hand has zeros of its own. A recording of which `phalanx track` says that
its names, unit, side or layout cannot be right gives no zeros. Of an angle whose markers are hidden in the trial the
zero stays as it was. An angle that posture statistics tell, and not the markers, gets no zero: it would take off what
other postures do not have (--all sets it). Only reported angles count from zeros: the skeleton, joints.csv, BVH and
glTF do not change. --angles names a CSV file of what was read: `angle,degrees`, or
`angle,left_degrees,right_degrees`; an angle that it does not name was held at 0. It must name one of each hand whose
zeros are set.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from app.commands.out import out_file
from app.commands.result import Result
from app.commands.terminal import Progress, say, warn
from core.errors import FormatError, PhalanxError
from core.frames import SIDES
from core.hand.skeleton import DIGIT_DOF_NAMES
from core.printable import printable

if TYPE_CHECKING:
    from core.calibration.neutral import NeutralHand
    from core.calibration.neutral_trial import HeldHand
    from core.frames import BoolArray, FloatArray, IntArray, Side, TrackedFrame
    from core.profile import Profile
    from core.recording import Recording


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this calibration."""
    parser.add_argument(
        "file", metavar="FILE", type=Path, nargs="?", help="a recording or a take; all of it is tracked"
    )
    parser.add_argument("--from", dest="from_s", metavar="S", type=float, help="the hand is held from this second")
    parser.add_argument("--to", dest="to_s", metavar="S", type=float, help="to this one")
    parser.add_argument("--profile", metavar="P", required=True, help="profile file of the performer")
    parser.add_argument("--angles", metavar="CSV", type=Path, help="what a goniometer read; default: all angles are 0")
    parser.add_argument("--side", choices=SIDES, help="set the zeros of this hand only; default: of each that is seen")
    parser.add_argument(
        "--all", action="store_true",
        help="set a zero also of angles that posture statistics tell in the trial, and not the markers",
    )  # fmt: skip
    parser.add_argument("--unlabelled", action="store_true", help="do not use the labels of the file")
    parser.add_argument("--remove", action="store_true", help="take the neutral trial out of the profile")
    parser.add_argument("--out", metavar="PROFILE", type=out_file, help="profile file to write; default: P itself")


def run(arguments: argparse.Namespace) -> Result:
    """Measures the zeros, says them, and writes the profile."""
    from core.markers.layout import layout_names
    from core.profile import load_profile

    profile = load_profile(arguments.profile)
    if arguments.out is None and arguments.profile in layout_names():
        raise PhalanxError(f"{arguments.profile} is a layout of Phalanx, no file.", "Give --out, a profile to write.")
    out = arguments.out or Path(arguments.profile)
    if not out.absolute().parent.is_dir():
        raise FormatError(f"Folder {out.absolute().parent} is not there.", "Make it, or choose another --out.")
    if arguments.remove:
        return _remove(arguments, profile, out)
    if arguments.file is None or arguments.from_s is None or arguments.to_s is None:
        raise PhalanxError("FILE, --from and --to are missing.", "Give a recording and the stretch to take zeros from.")
    return _set(arguments, profile, out)


def say_dropped(before: Profile) -> None:
    """That a profile with another hand or subspace than `before` has no neutral trial any more, if that had one."""
    if before.neutral is not None:
        say("The neutral trial was of the profile before, and is gone: hold another one (phalanx calibrate neutral).")


def _remove(arguments: argparse.Namespace, profile: Profile, out: Path) -> Result:
    """--side: of this hand only."""
    from core.calibration.neutral import Neutral
    from core.profile import save_profile

    if arguments.file is not None or arguments.angles is not None:
        raise PhalanxError("--remove takes no recording and no --angles.", "Leave them out, or leave --remove out.")
    had = {} if profile.neutral is None else dict(profile.neutral.hands)
    removed = [side for side in had if arguments.side in (None, side)]
    if not removed:
        whose = f" of the {arguments.side} hand" if arguments.side else ""
        raise PhalanxError(f"{arguments.profile} holds no neutral trial{whose}.", "There is nothing to remove.")
    left = {side: hand for side, hand in had.items() if side not in removed}
    save_profile(replace(profile, neutral=Neutral(left) if left else None), out)
    print(f"{printable(out)} written: {' and '.join(removed)} angles are reported as they are tracked.")
    return Result(figures={"profile": out, "removed": removed})


def _set(arguments: argparse.Namespace, profile: Profile, out: Path) -> Result:
    from core.calibration.goniometer import read_angles
    from core.calibration.neutral_trial import held_hands, neutral_of
    from core.profile import save_profile
    from core.takes.formats import read_recording

    given = read_angles(arguments.angles)
    recording = read_recording(arguments.file)
    warn(arguments.file.name, recording.warnings)
    if arguments.angles is not None:
        warn(arguments.angles.name, given.warnings)
    from_s, to_s = arguments.from_s, arguments.to_s
    since = recording.times_s - recording.times_s[0]
    if not 0.0 <= from_s < to_s <= since[-1] + 1.0 / recording.rate_hz:
        raise PhalanxError(
            f"{from_s:g} to {to_s:g} s is no stretch of {arguments.file.name}, which lasts {since[-1]:.2f} s.",
            "Choose another --from and --to.",
        )
    rows = np.flatnonzero((since >= from_s) & (since <= to_s))
    sides = profile.sides if arguments.side is None else (arguments.side,)
    solved = _tracked(arguments, recording, profile, rows, sides)
    held = held_hands([solved[row] for row in rows], since[rows], profile, sides)
    given.check(list(held))
    date = datetime.now(UTC).isoformat(timespec="seconds")
    neutral = neutral_of(
        held, given.angles_rad, profile.neutral, arguments.file.name, from_s, to_s, date, every=arguments.all
    )
    save_profile(replace(profile, neutral=neutral), out)
    for side, one in held.items():
        _print(side, one, neutral.hands[side])
    notes = [words for side in held for words in _doubts(side, held[side], neutral.hands[side], profile)]
    notes += [_not_given(side, given.empty[side]) for side in held if given.empty[side]]
    notes += [f"The {side} hand was not tracked: its zeros stay as they were." for side in sides if side not in held]
    if profile.scale is None or profile.calibrated is None:
        why = "no size of its own: every recording finds another" if profile.scale is None else "markers by the layout"
        notes.append(
            f"{profile.performer or 'The profile'} has {why}. With a hand that was not calibrated, zeros can make the "
            "angles of other postures worse: calibrate it first (phalanx calibrate hand)."
        )
    for words in notes:
        print(words)
    print(f"{printable(out)} written.")
    hands = {side: _figures(one, neutral.hands[side]) for side, one in held.items()}
    return Result(
        figures={
            "file": arguments.file, "from_s": from_s, "to_s": to_s, "angles": arguments.angles, "profile": out,
            "hands": hands, "notes": notes, "warnings": (*recording.warnings, *given.warnings),
        }
    )  # fmt: skip


def _tracked(
    arguments: argparse.Namespace, recording: Recording, profile: Profile, rows: IntArray, sides: Sequence[Side]
) -> Sequence[TrackedFrame]:
    """Every frame, as `phalanx track` solves it before it fills gaps. rows: the stretch. Raises FormatError where what
    is tracked of `sides` in it is not what it is taken for."""
    from app.calibration_gates import refuse_doubtful
    from app.labels import label_map
    from app.tracking_doubts import check_performers
    from app.tracking_figures import frames_and_columns
    from core.labelling.name_check import believed, check_names, check_sides
    from core.takes.reader import open_take
    from core.takes.reprocess import relabelled, solve
    from core.takes.take import EXTENSION

    check_performers(arguments.file.name, recording, (profile,))
    progress = Progress(f"Tracking {arguments.file.name}")
    labels = None if arguments.unlabelled else label_map(recording, profile)
    if arguments.file.suffix == EXTENSION:
        with open_take(arguments.file) as take:
            frames = list(take.raw)
    else:
        frames, _ = frames_and_columns(recording, arguments.unlabelled)
    how = "by the names of its points" if labels is not None else "labelling its points first"
    say(f"Tracking {len(frames):,} frames of {arguments.file.name}, {how}.")
    if labels is None:
        solved = relabelled(frames, profile, progress)
        faults = check_sides(frames, solved, profile)
    else:
        faults = check_names(frames, recording.rate_hz, profile, labels)
        named, names = believed(frames, labels, faults)
        solved = solve(named, profile, progress, labels=names)
    progress.done()
    refuse_doubtful(arguments.file, recording, rows, solved, profile, sides, labels, faults, arguments.unlabelled)
    return solved


def _print(side: Side, held: HeldHand, hand: NeutralHand) -> None:
    from app.pose_words import angle_title

    most = held.most_moved
    print(
        f"The {side} hand was held in {held.frames:,} frames: no joint moved by more than "
        f"{np.degrees(held.moved_rad[most]):.1f} degrees ({angle_title(DIGIT_DOF_NAMES[most])}), the wrist by "
        f"{1e3 * held.wrist_moved_m:.0f} mm."
    )
    print("  Angle [degrees]           tracked   held at      zero        +-")
    for k, name in enumerate(DIGIT_DOF_NAMES):
        tracked, given, zero, std = (
            float(np.degrees(values[k])) for values in (held.angle_rad, hand.given_rad, hand.zero_rad, hand.std_rad)
        )
        told = f"{'hidden':>9} {'-':>9}" if held.hidden[k] else f"{tracked:9.1f} {given:9.1f}"
        zeros = f"{'none':>9} {'-':>9}" if name in hand.prior else f"{zero:9.1f} {std:9.1f}"
        print(f"  {angle_title(name):24} {told} {zeros}")


def _doubts(side: Side, held: HeldHand, hand: NeutralHand, profile: Profile) -> list[str]:
    """What there is to say of the zeros, in sentences."""
    from app.pose_words import angle_title
    from core.calibration.neutral_trial import far_angles

    doubts = []
    if hand.hidden:
        names = ", ".join(map(angle_title, hand.hidden))
        doubts.append(
            f"Markers of the {side} hand were hidden, or no point was found that fits them: the zero stays as it was "
            f"of {names}."
        )
    statistics = _named(held.prior)
    if statistics:
        what = (
            "they have no zero, which would make them worse in other postures (--all sets it)"
            if hand.prior
            else "their zeros, set for --all, make them worse in other postures"
        )
        doubts.append(
            f"Of the {side} hand {profile.layout.name} does not tell, in this stance, "
            f"{', '.join(map(angle_title, statistics))}. Posture statistics do: {what}."
        )
    far = [f"{angle_title(name)} {np.degrees(zero):.0f}" for name, zero in far_angles(hand)]
    if far:
        doubts.append(
            f"Large zeros of the {side} hand, in degrees: {', '.join(far)}. Was it held flat, or at the angles given?"
        )
    return doubts


def _not_given(side: Side, names: Sequence[str]) -> str:
    from app.pose_words import angle_title

    return f"Of the {side} hand no angle is given of {', '.join(map(angle_title, names))}: it counts as held at 0."


def _named(chosen: BoolArray) -> list[str]:
    return [name for name, one in zip(DIGIT_DOF_NAMES, chosen, strict=True) if one]


def _figures(held: HeldHand, hand: NeutralHand) -> dict[str, Any]:
    def degrees(values: FloatArray) -> dict[str, float]:
        return dict(zip(DIGIT_DOF_NAMES, np.degrees(values).tolist(), strict=True))

    return {
        "frames": held.frames, "rms_m": held.rms_m, "wrist_moved_m": held.wrist_moved_m,
        "moved_deg": degrees(held.moved_rad), "tracked_deg": degrees(held.angle_rad),
        "given_deg": degrees(hand.given_rad), "zero_deg": degrees(hand.zero_rad), "std_deg": degrees(hand.std_rad),
        "hidden": hand.hidden, "prior": _named(held.prior), "no_zero": hand.prior,
    }  # fmt: skip
