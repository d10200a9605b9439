"""`phalanx subspace FILE...`: learn from takes and recordings how a performer's digits move together."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from app.calibrate.neutral import say_dropped
from app.commands.out import out_file
from app.commands.result import Exit, Result
from app.commands.terminal import Progress, say, warn
from core.errors import FormatError, PhalanxError
from core.printable import printable

if TYPE_CHECKING:
    from core.frames import TrackedFrame
    from core.motion.learning import Learnt, Motion
    from core.profile import Profile

VARIANCE = 0.95


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser(
        "subspace",
        help="learn how a performer's digits move together",
        description="Learns a subspace: which joint angles change together, as principal components of many postures. "
        "A profile that holds one has digits that are hidden, or carry too few markers, moved as this performer, or "
        "this kind of motion, usually moves them. Takes give their solved frames, other recordings are solved first. "
        "Only hands that were tracked, and sure in every joint, are learnt from, and a pose that is held counts once: "
        "record some minutes of varied motion with a layout that has a marker on every bone.",
    )
    parser.add_argument("files", metavar="FILE", nargs="+", type=Path, help="a take or a recording")
    parser.add_argument("--out", metavar="SUBSPACE", type=out_file, required=True, help="subspace file to write")
    parser.add_argument("--name", metavar="NAME", help="its name; default: that of the file")
    size = parser.add_mutually_exclusive_group()
    size.add_argument(
        "--variance", metavar="SHARE", type=float, default=VARIANCE,
        help="as many dimensions as explain this share of the variance; default %(default)s",
    )  # fmt: skip
    size.add_argument("--dimensions", metavar="L", type=int, help="so many dimensions, 1 to 20")
    parser.add_argument(
        "--profile", metavar="P", help="what recordings are solved with: a profile file, or the layout that was worn; "
        "default for takes: their own",
    )  # fmt: skip
    parser.add_argument(
        "--write-profile", metavar="PROFILE", type=out_file,
        help="also write the profile (of --profile, or of the first take) with this subspace in it",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """Learns, says from how much and how well, and writes."""
    from core.motion.learning import learn, motions_of
    from core.motion.subspace import N_ANGLES, save_subspace, shipped_subspace, subspace_names
    from core.profile import load_profile, save_profile

    name = arguments.name or arguments.out.stem
    if name in subspace_names():
        raise PhalanxError(f"{name!r} is the name of a subspace of Phalanx.", "Choose another --name or --out.")
    if not 0.0 < arguments.variance <= 1.0:
        raise PhalanxError(f"--variance {arguments.variance:g}.", "Give a share above 0, at most 1, such as 0.95.")
    if arguments.dimensions is not None and not 1 <= arguments.dimensions <= N_ANGLES:
        raise PhalanxError(f"--dimensions {arguments.dimensions}.", f"Give a number from 1 to {N_ANGLES}.")
    for path in filter(None, (arguments.out, arguments.write_profile)):
        if not path.absolute().parent.is_dir():
            raise FormatError(f"Folder {path.absolute().parent} is not there.", "Make it, or choose another place.")
    given = load_profile(arguments.profile) if arguments.profile else None

    motions: list[Motion] = []
    worn, damaged = given, False
    warnings: dict[str, Sequence[str]] = {}
    for path in arguments.files:
        frames, profile, whole, warnings[str(path)] = _solved(path, given)
        warn(path.name, warnings[str(path)])
        worn, damaged = worn or profile, damaged or not whole
        found = motions_of(path.name, frames)
        if not found:
            say(f"{path.name}: no hand was tracked.")
        motions += found
        for motion in found:
            print(
                f"{motion.name}: {motion.tracked:,} frames tracked, {motion.sure:,} sure, "
                f"{len(motion.postures_rad):,} different postures",
                flush=True,
            )
    description = f"Learnt from {', '.join(path.name for path in arguments.files)}."
    learnt = learn(
        motions, name, description, shipped_subspace("generic"), variance=arguments.variance,
        dimensions=arguments.dimensions,
    )  # fmt: skip
    save_subspace(learnt.subspace, arguments.out)
    _print(learnt)
    print(f"{printable(arguments.out)} written.")
    if arguments.write_profile is not None:
        assert worn is not None
        save_profile(worn.with_hand(subspace=learnt.subspace), arguments.write_profile)
        print(f"{printable(arguments.write_profile)} written: solve with --profile {arguments.write_profile}.")
        say_dropped(worn)
    figures = {**_figures(arguments, motions, learnt), "warnings": warnings}
    return Result(Exit.LOSS if damaged else Exit.DONE, figures)


def _solved(path: Path, given: Profile | None) -> tuple[list[TrackedFrame], Profile, bool, Sequence[str]]:
    """Solved frames of a take or recording, what they were solved with, whether the file was whole, and what its reader
    warns of."""
    from app.labels import label_map
    from app.tracking_figures import frames_and_columns
    from core.takes.formats import read_recording
    from core.takes.reader import open_take
    from core.takes.reprocess import solve
    from core.takes.take import EXTENSION

    progress = Progress(f"Solving {path.name}")
    if path.suffix == EXTENSION:
        with open_take(path) as take:
            profile, whole = given or take.profile, not take.damage
            warnings = take.damage
            if take.damage:
                say(f"{path.name} is damaged: what could be read is learnt from. phalanx recover mends it.")
            if given is None and len(take.profiles) > 1:
                raise FormatError(
                    f"{path.name} holds the hands of {len(take.profiles)} performers.",
                    "Give --profile, that of the one to learn from.",
                )
            if given is None and len(take.solved):
                return list(take.solved), profile, whole, warnings
            solved = solve(list(take.raw), profile, progress)
    else:
        if given is None:
            raise FormatError(f"{path.name} does not say what the hands wore.", "Give --profile, for example han19.")
        recording = read_recording(path)
        frames, _ = frames_and_columns(recording)
        profile, whole, warnings = given, True, recording.warnings
        solved = solve(frames, profile, progress, labels=label_map(recording, profile))
    progress.done()
    return solved, profile, whole, warnings


def _print(learnt: Learnt) -> None:
    import numpy as np

    from core.motion.learning import HELD_OUT

    subspace = learnt.subspace
    shares = ", ".join(f"{100.0 * share:.0f}" for share in subspace.explained)
    print(
        f"{subspace.name}: {subspace.dimensions} dimensions from {learnt.postures:,} postures explain "
        f"{100.0 * subspace.explained[-1]:.1f} % of the variance (by dimension: {shares} %)"
    )
    print(
        f"On the last {100.0 * HELD_OUT:.0f} % of the motion, learnt without it, postures are met to "
        f"{np.degrees(learnt.own_rad):.1f} degrees per joint; by the generic subspace in as many dimensions to "
        f"{np.degrees(learnt.other_rad):.1f}"
    )


def _figures(arguments: argparse.Namespace, motions: list[Motion], learnt: Learnt) -> dict[str, object]:
    return {
        "name": learnt.subspace.name,
        "out": arguments.out,
        "profile": arguments.write_profile,
        "motions": {
            motion.name: {"tracked": motion.tracked, "sure": motion.sure, "postures": len(motion.postures_rad)}
            for motion in motions
        },
        "postures": learnt.postures,
        "dimensions": learnt.subspace.dimensions,
        "explained": learnt.subspace.explained,
        "held_out_rms_rad": learnt.own_rad,
        "held_out_rms_generic_rad": learnt.other_rad,
    }
