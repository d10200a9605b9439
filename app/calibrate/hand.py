"""hand shape and marker positions, found from a recording of a moving hand.

A good recording: some 10 s in which the hand opens and closes, every finger bends by itself and spreads, and the thumb
touches each of them. Either hand, or both: they count as one performer. A recording whose points carry the names of
the layout's markers is calibrated from these; anything else is labelled first.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from app.calibrate.neutral import say_dropped
from app.calibration_check import print_retest, retest_figures, stretches
from app.calibration_gates import named_wrongly
from app.commands.out import out_file
from app.commands.result import Exit, Result
from app.commands.terminal import Progress, say, warn
from core.errors import FormatError, PhalanxError
from core.printable import printable

if TYPE_CHECKING:
    from core.calibration.findings import Compared
    from core.calibration.hand import HandCalibration
    from core.frames import IntArray, MarkerFrame, Side
    from core.observability import Observability
    from core.profile import Profile
    from core.recording import Recording

    Labels = Mapping[int, tuple[Side, int]] | None


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this calibration."""
    parser.add_argument("file", metavar="FILE", type=Path, help="a recording or a take")
    parser.add_argument(
        "--profile", metavar="P", help="profile file, or the layout that was worn; default for takes: their own"
    )
    parser.add_argument("--from", dest="start_s", metavar="S", type=seconds, default=0.0, help="begin at this second")
    parser.add_argument("--to", dest="end_s", metavar="S", type=seconds, default=math.inf, help="end at this second")
    parser.add_argument("--performer", metavar="NAME", help="whose hand it is; default: as in the profile")
    parser.add_argument(
        "--keep-shape",
        action="store_true",
        help="the profile's hand is right, measured or imported: find only the markers",
    )
    parser.add_argument("--unlabelled", action="store_true", help="do not use the labels of the file")
    parser.add_argument("--keyframes", metavar="N", type=int, help="frames to calibrate from; default: 120")
    parser.add_argument(
        "--check", metavar="SECONDS", type=seconds,
        help="calibrate also from so many other seconds, and say by how much the angles of both differ",
    )  # fmt: skip
    parser.add_argument("--out", metavar="PROFILE", type=out_file, required=True, help="profile file to write")


def run(arguments: argparse.Namespace) -> Result:
    """Calibrates, says what was found and what was not, and writes the profile."""
    from core.calibration.hand import KEYFRAMES, LEAST_SHOTS, calibrate_hand
    from core.calibration.retest import retest
    from core.observability import observability
    from core.profile import load_profile, save_profile
    from core.takes.formats import read_recording

    if arguments.keyframes is not None and arguments.keyframes < LEAST_SHOTS:
        raise PhalanxError(f"--keyframes {arguments.keyframes}.", f"Give {LEAST_SHOTS} or more.")
    if not arguments.out.absolute().parent.is_dir():
        raise FormatError(
            f"Folder {arguments.out.absolute().parent} is not there.", "Make it, or choose another --out."
        )
    given = load_profile(arguments.profile) if arguments.profile else None
    recording = read_recording(arguments.file)
    warn(arguments.file.name, recording.warnings)
    material = _material(arguments, recording, given)
    compared = None
    if arguments.check is not None:
        compared = stretches((arguments.start_s, arguments.end_s), arguments.check, recording.span_s)
    frames, labels = material.between(arguments.start_s, arguments.end_s)
    wrong = named_wrongly(frames, material.part(arguments.start_s, arguments.end_s), material.profile, labels)
    warn(arguments.file.name, wrong)
    how = "by the names of its points" if labels is not None else "labelling its points first"
    say(f"Calibrating from {len(frames):,} frames of {arguments.file.name}, {how}.")

    def calibrated(frames: list[MarkerFrame], labels: Labels, what: str) -> HandCalibration:
        progress = Progress(what)
        found = calibrate_hand(
            frames, material.profile, labels=labels, performer=arguments.performer,
            keep_shape=arguments.keep_shape, keyframes=arguments.keyframes or KEYFRAMES, progress=progress,
        )  # fmt: skip
        progress.done()
        return found

    found = calibrated(frames, labels, f"Calibrating from {arguments.file.name}")
    record = found.profile.calibrated
    assert record is not None
    record = replace(
        record, sources=(arguments.file.name,), from_s=arguments.start_s,
        to_s=min(arguments.end_s, recording.span_s), made_on=date.today().isoformat(),
    )  # fmt: skip
    save_profile(replace(found.profile, calibrated=record), arguments.out)
    told = observability(found.profile)
    _print(found, told)
    print(f"{printable(arguments.out)} written.")
    say_dropped(material.profile)
    figures = _figures(arguments, found, told, labels is not None)
    if compared is not None:
        one = found
        if compared.halves:
            one = calibrated(*material.between(*compared.first), "Calibrating from the first half")
        other = calibrated(*material.between(*compared.second), "Calibrating from other seconds")
        progress = Progress("Solving with both calibrations")
        every, names = material.between(0.0, math.inf)
        checked = retest(every, (one.profile, other.profile), names, progress)
        progress.done()
        print_retest(compared, checked)
        figures["check"] = retest_figures(compared, checked)
    return Result(Exit.LOSS if wrong else Exit.DONE, {**figures, "warnings": (*recording.warnings, *wrong)})


@dataclass(frozen=True)
class _Material:
    """What there is to calibrate from. profile: to begin with. frames: all of the recording."""

    recording: Recording
    profile: Profile
    frames: list[MarkerFrame]
    use_labels: bool

    def between(self, begin_s: float, end_s: float) -> tuple[list[MarkerFrame], Labels]:
        """Its frames of these seconds, and what their ids name. Raises FormatError if there are none."""
        from app.labels import label_map

        chosen = self._rows(begin_s, end_s)
        labels = label_map(self.recording.at(chosen), self.profile) if self.use_labels else None
        return [self.frames[row] for row in chosen], labels

    def part(self, begin_s: float, end_s: float) -> Recording:
        """The recording of these seconds alone. Raises FormatError if there are none."""
        return self.recording.at(self._rows(begin_s, end_s))

    def _rows(self, begin_s: float, end_s: float) -> IntArray:
        recording = self.recording
        since = recording.times_s - recording.times_s[0]
        chosen = np.flatnonzero((since >= begin_s) & (since < end_s))
        if len(chosen) == 0:
            raise FormatError(
                f"{recording.name} lasts {recording.span_s:.1f} s: nothing from {begin_s:g} s"
                + (f" to {end_s:g} s." if math.isfinite(end_s) else "."),
                "Choose another --from and --to.",
            )
        return chosen


def _material(arguments: argparse.Namespace, recording: Recording, profile: Profile | None) -> _Material:
    """Raises FormatError if it is not known what the hands wore."""
    from app.tracking_figures import frames_and_columns
    from core.cast import performer_names
    from core.takes.reader import open_take
    from core.takes.take import EXTENSION

    if arguments.file.suffix == EXTENSION:
        with open_take(arguments.file) as take:
            if profile is None and len(take.profiles) > 1:
                names = ", ".join(performer_names(take.profiles, "performer "))
                raise FormatError(
                    f"{arguments.file.name} holds the hands of {len(take.profiles)} performers: {names}.",
                    "Give --profile, that of the one to be calibrated.",
                )
            frames, profile = list(take.raw), profile or take.profile
    else:
        frames, _ = frames_and_columns(recording, arguments.unlabelled)
    if profile is None:
        raise FormatError(f"{arguments.file.name} does not say what the hands wore.", "Give --profile, such as han19.")
    return _Material(recording, profile, frames, not arguments.unlabelled)


def _print(found: HandCalibration, told: Observability) -> None:
    from core.calibration.findings import lengths_m, title
    from core.hand.model import template

    print(
        f"{found.shots:,} tracked hands; {found.keyframes} keyframes, {100 * found.mislabelled:.1f} % of their points "
        "left aside as not of their marker"
    )
    print(
        f"Skin and glove slide alike in like postures: the keyframes tell as much as {found.independent:.0f} "
        "whose errors are their own"
    )
    joints, names = found.profile.layout.joints, found.profile.layout.marker_names
    print("\nRMS [mm]              keyframes        frames not used")
    print("                    before   after     before   after")
    _row("all markers", found.key.before.overall_m, found.key.after.overall_m, found.held_out)
    before, after = found.held_out.before.by_digit(joints), found.held_out.after.by_digit(joints)
    for part, rms in found.key.after.by_digit(joints).items():
        _print_row(part, found.key.before.by_digit(joints)[part], rms, before[part], after[part])
    print("\nMarker              before   after     before   after   moved [mm]")
    for k, name in enumerate(names):
        moved = 1e3 * float(np.linalg.norm(found.markers[k].moved_m))
        _print_row(
            name, found.key.before.rms_m[k], found.key.after.rms_m[k], found.held_out.before.rms_m[k],
            found.held_out.after.rms_m[k], f"{moved:9.1f} +- {1e3 * found.markers[k].std_m:.1f}",
        )  # fmt: skip
    if found.measures:
        lengths = lengths_m(template())
        print("\nHand                      ratio  +- %     mm")
        for measure in found.measures:
            length = f"{1e3 * lengths[measure.name] * measure.ratio:6.1f}" if measure.name in lengths else "     -"
            print(
                f"  {title(measure.name):22} {measure.ratio:6.3f}  {100 * measure.std:4.1f} {length}  {measure.words}"
            )
    for words in (*found.unseen, *found.doubts):
        print(words)
    for words in told.words:
        print(words)
    if found.profile.limits:
        print(f"Joint limits kept: {found.profile.limits.words}")
    if found.still:
        print(
            f"Hardly moved: {', '.join(found.still)}. Bend and spread them in a longer recording to know their bones."
        )


def _row(name: str, before_m: float, after_m: float, held_out: Compared) -> None:
    _print_row(name, before_m, after_m, held_out.before.overall_m, held_out.after.overall_m)


def _print_row(name: str, *values_m: Any) -> None:
    """Four RMS, and perhaps a text."""
    numbers = [f"{1e3 * float(v):8.2f}" if math.isfinite(v) else f"{'-':>8}" for v in values_m[:4]]
    print(f"  {name:16}{numbers[0]}{numbers[1]}   {numbers[2]}{numbers[3]}" + "".join(f"  {v}" for v in values_m[4:]))


def _figures(
    arguments: argparse.Namespace, found: HandCalibration, told: Observability, labels_given: bool
) -> dict[str, Any]:
    names, joints = found.profile.layout.marker_names, found.profile.layout.joints

    def compared(both: Compared) -> dict[str, Any]:
        return {
            "hands": both.shots,
            **{
                word: {
                    "rms_m": fit.overall_m,
                    "digits_m": fit.by_digit(joints),
                    "markers_m": dict(zip(names, fit.rms_m, strict=True)),
                }
                for word, fit in (("before", both.before), ("after", both.after))
            },
        }

    return {
        "file": arguments.file,
        "profile": arguments.out,
        "labels_given": labels_given,
        "hands": found.shots,
        "keyframes": found.keyframes,
        "independent_keyframes": found.independent,
        "noise_m": found.noise_m,
        "points_left_aside": found.mislabelled,
        "on_keyframes": compared(found.key),
        "on_frames_not_used": compared(found.held_out),
        "shape": {m.name: {"ratio": m.ratio, "std": m.std, "seen": m.seen} for m in found.measures},
        "markers": {m.name: {"moved_m": m.moved_m, "std_m": m.std_m, "seen": m.seen} for m in found.markers},
        "not_seen": found.unseen,
        "doubts": found.doubts,
        "still": found.still,
        "told": told.to_dict(),
    }


def seconds(text: str) -> float:
    """A time in the recording; raises ValueError."""
    value = float(text)
    if not 0.0 <= value < math.inf:
        raise ValueError
    return value
