"""`phalanx prop define | add | show`: rigid things with markers on them, that hands take up."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from app.commands.out import out_file
from app.commands.result import Result
from app.commands.terminal import warn
from core.errors import FormatError, PhalanxError
from core.printable import printable
from core.props.prop import SHAPES, Prop, load_prop
from core.takes.take import EXTENSION

if TYPE_CHECKING:
    from core.frames import MarkerFrame


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser("prop", help="define props from recordings, add them to a profile")
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    _add_define(actions)
    adding = actions.add_parser("add", help="add prop files to a profile; one of the same name is replaced")
    adding.add_argument("props", metavar="PROP", nargs="+", type=Path, help="a prop file")
    adding.add_argument("--profile", metavar="P", required=True, help="profile file, or a layout on a generic hand")
    adding.add_argument("--out", metavar="PROFILE", type=out_file, required=True, help="profile file to write")
    adding.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    adding.set_defaults(run=run_add)
    show = actions.add_parser("show", help="markers and model of a prop")
    show.add_argument("prop", metavar="PROP", type=Path, help="a prop file")
    show.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    show.set_defaults(run=run_show)


def _add_define(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    define = actions.add_parser(
        "define",
        help="make a prop from points of a recording",
        description="Makes a prop from points that moved together in a recording, or from a rigid body that the "
        "device tracks itself. Its markers are averaged over all frames in which all of them are seen.",
    )
    define.add_argument("recording", metavar="FILE", type=Path, help="a take or a motion file")
    which = define.add_mutually_exclusive_group(required=True)
    which.add_argument("--points", metavar="A,B,C...", help="labels of the file, or ids of its points")
    which.add_argument("--body", metavar="NAME", help="a rigid body that the device tracks")
    define.add_argument(
        "--at", metavar="S", type=float, help="with ids: the stretch about this time only, from the first frame on [s]"
    )
    define.add_argument("--name", required=True, help="what the prop is called")
    define.add_argument("--model", choices=SHAPES, default="none", help="its shape (default: none, markers alone)")
    define.add_argument(
        "--size-mm", metavar="MM,...", help="cylinder: diameter,length; sphere: diameter; box: its edges, the longest "
        "last; default: the smallest that holds the markers",
    )  # fmt: skip
    define.add_argument("--profile", metavar="P", help="write this profile with the prop added, not the prop alone")
    define.add_argument("--out", metavar="FILE", type=out_file, required=True, help="file to write")
    define.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    define.set_defaults(run=run_define)


def run_define(arguments: argparse.Namespace) -> Result:
    """Says how rigid it was, and writes it."""
    from core.profile import load_profile, save_profile
    from core.props.define import define, samples_of_body, samples_of_ids
    from core.props.prop import save_prop
    from core.props.symmetry import symmetry_words

    profile = load_profile(arguments.profile) if arguments.profile else None
    with _opened(arguments.recording) as (frames, id_of, warnings):
        warn(arguments.recording.name, warnings)
        if arguments.body:
            samples = samples_of_body(frames, arguments.body)
        else:
            samples = samples_of_ids(frames, _ids(arguments.points, id_of, arguments.recording), arguments.at)
    made = define(arguments.name, samples, arguments.model, _size_m(arguments.size_mm))
    # A body's own frame says nothing of how it lay in the room.
    prop = replace(made.prop, home=None) if arguments.body else made.prop
    if profile is None:
        save_prop(prop, arguments.out)
    else:
        save_profile(profile.with_prop(prop), arguments.out)
    _say(prop)
    print(
        f"Over {made.frames:,} frames its markers strayed {1e3 * made.rms_m:.3f} mm from their mean shape (root mean "
        f"square), at most {1e3 * made.worst_m:.2f} mm."
    )
    warning = symmetry_words(prop.markers_m)
    if warning:
        print(f"Note: {warning}")
    print(f"{printable(arguments.out)} written.")
    return Result(
        figures={
            "recording": arguments.recording, "frames": made.frames, "rms_mm": 1e3 * made.rms_m,
            "worst_mm": 1e3 * made.worst_m, "marker_rms_mm": 1e3 * made.marker_rms_m, "symmetric": bool(warning),
            "prop": prop.to_dict(), "file": arguments.out, "warnings": warnings,
        }
    )  # fmt: skip


def run_add(arguments: argparse.Namespace) -> Result:
    """Writes the profile with the props."""
    from core.profile import load_profile, save_profile

    profile = load_profile(arguments.profile)
    for path in arguments.props:
        profile = profile.with_prop(load_prop(path))
    save_profile(profile, arguments.out)
    names = [prop.name for prop in profile.props]
    print(f"{printable(arguments.out)} written, with {', '.join(names)}.")
    return Result(figures={"profile": arguments.out, "props": names})


def run_show(arguments: argparse.Namespace) -> Result:
    """One line for the model and one per marker."""
    prop = load_prop(arguments.prop)
    _say(prop)
    return Result(figures=prop.to_dict())


def _say(prop: Prop) -> None:
    size = " x ".join(f"{1e3 * length:.1f}" for length in prop.model.size_m)
    shape = "no model" if prop.model.shape == "none" else f"a {prop.model.shape} of {size} mm"
    print(f"{prop.name}: {len(prop.markers_m)} markers, {shape}; positions in its own frame [mm]")
    for name, position in zip(prop.marker_names, prop.markers_m, strict=True):
        print(f"  {name:16} " + " ".join(f"{1e3 * value:8.1f}" for value in position))


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Iterator[MarkerFrame], dict[str, int], Sequence[str]]]:
    """The frames of a recording, the ids of its labels, and what its reader warns of."""
    from core.takes.formats.detect import read_recording
    from core.takes.reader import open_take

    if path.suffix.lower() == EXTENSION:
        with open_take(path) as take:
            yield iter(take.raw), {}, take.damage
        return
    recording = read_recording(path)
    yield recording.frames(), dict(zip(recording.labels, recording.ids.tolist(), strict=False)), recording.warnings


def _ids(words: str, id_of: dict[str, int], path: Path) -> list[int]:
    ids = []
    for word in (word.strip() for word in words.split(",")):
        if word in id_of:
            ids.append(id_of[word])
        elif not id_of and word.lstrip("-").isdigit():
            ids.append(int(word))
        elif id_of:
            raise PhalanxError(f"{path.name} has no label {word!r}.", "It has: " + ", ".join(id_of) + ".")
        else:
            raise PhalanxError(f"{word!r} is not the id of a point.", f"{path.name} has no labels; give whole numbers.")
    if len(set(ids)) < len(ids):
        raise PhalanxError(f"--points {words}: a point is named twice.", "Name each marker once.")
    return ids


def _size_m(words: str | None) -> tuple[float, ...]:
    if words is None:
        return ()
    try:
        lengths = tuple(float(word) / 1e3 for word in words.split(","))
    except ValueError as error:
        raise FormatError(f"--size-mm {words!r} is not a list of numbers.", "For example 10,150.") from error
    if not all(0.0 < length <= 2.0 for length in lengths):
        raise FormatError(f"--size-mm {words!r}.", "Give lengths above 0 and up to 2000 mm.")
    return lengths
