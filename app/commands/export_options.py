"""What `phalanx export` and `phalanx track` have in common: formats, and how to write them."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from app.commands.terminal import say
from core.printable import printable

if TYPE_CHECKING:
    from core.takes.export import Exported, ExportOptions

FORMATS_HELP = "c3d, trc, csv, points, bvh, gltf; several with commas"


def add_export_options(parser: argparse.ArgumentParser) -> None:
    """Declares them."""
    files = parser.add_argument_group("how the files are written")
    files.add_argument("--joints", action="store_true", help="C3D and TRC also hold joint centres and fingertips")
    files.add_argument(
        "--measured",
        action="store_true",
        help="C3D and markers.csv hold only what was measured: a marker that was not seen is a gap, as it always is in "
        "TRC. Many programs cannot tell the predicted ones from measured ones",
    )
    files.add_argument(
        "--up",
        choices=("y", "z"),
        default="y",
        help="the axis that points up (default y); with z the files hold x, -z, y of the world. glTF is always Y up",
    )
    files.add_argument(
        "--unit",
        choices=("mm", "cm", "m"),
        help="of lengths in C3D, TRC (default mm) and BVH (default cm); CSV and glTF are in metres",
    )
    files.add_argument(
        "--bones",
        metavar="NAMES",
        type=_checked("bones", str),
        default="phalanx",
        help="what BVH and glTF call the joints: phalanx, vrm, unreal, unity, mixamo or mano (docs/joints.md)",
    )
    files.add_argument(
        "--no-neutral",
        action="store_true",
        help="angles.csv holds angles as they were tracked, not counted from the profile's neutral trial",
    )
    files.add_argument(
        "--rate",
        metavar="HZ",
        type=_checked("rate_hz", float),
        help="frames per second of C3D, TRC, BVH and glTF; what lies between two frames is blended, never across a "
        "gap (default: the recording's own; CSV keeps that)",
    )
    for name, dest, what in (("--from", "from_s", "begin"), ("--to-time", "to_s", "end")):
        files.add_argument(
            name, metavar="S", type=_checked(dest, _seconds), dest=dest, help=f"{what} S seconds after the first frame"
        )


def options_of(arguments: argparse.Namespace) -> ExportOptions:
    """Ends the command as a usage mistake where the options contradict each other."""
    from core.errors import ExportError
    from core.takes.export import ExportOptions

    try:
        return ExportOptions(
            joints=arguments.joints,
            measured=arguments.measured,
            bones=arguments.bones,
            neutral=not arguments.no_neutral,
            up=arguments.up,
            unit=arguments.unit,
            rate_hz=arguments.rate,
            from_s=arguments.from_s,
            to_s=arguments.to_s,
        )
    except ExportError as error:
        arguments.refuse(str(error))
        raise


def formats(text: str) -> tuple[str, ...]:
    """The formats in a list with commas, for argparse."""
    from core.takes.export import FORMATS

    found = tuple(name.strip().lower() for name in text.split(","))
    unknown = next((name for name in found if name not in FORMATS), None)
    if unknown is not None:
        what = f"{unknown!r} is no export format" if unknown else "a format is missing"
        raise argparse.ArgumentTypeError(f"{what} in {text!r}: choose of {', '.join(FORMATS)}, with commas between")
    return tuple(dict.fromkeys(found))


def _checked(field: str, convert: Callable[[str], float | str]) -> Callable[[str], float | str]:
    """Reads one option for argparse, and refuses what ExportOptions refuses."""

    def read(text: str) -> float | str:
        from core.errors import ExportError
        from core.takes.export import ExportOptions

        value = convert(text)
        try:
            ExportOptions(**{field: value})  # type: ignore[arg-type]
        except ExportError as error:
            raise argparse.ArgumentTypeError(str(error)) from error
        return value

    read.__name__ = convert.__name__  # argparse says: invalid float value
    return read


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of seconds") from error
    if value < 0.0:
        raise argparse.ArgumentTypeError(f"{value:g} s is before the first frame: times count from it")
    return value


def folders_of(files: list[Path], out: Path, each: bool) -> dict[Path, Path]:
    """Where the files of each recording go: `out` itself, or a folder in it by the name of the file without ending.
    Raises FormatError where two would share one."""
    from core.errors import FormatError

    folders: dict[Path, Path] = {}
    for path in files:
        folder = out / path.stem if each else out
        other = next((p for p, f in folders.items() if f == folder and p != path), None)
        if other is not None:
            raise FormatError(
                f"{path} and {other} would both be written to {folder}.", "Do them one by one, into other folders."
            )
        folders[path] = folder
    return folders


def tell(exported: Exported, name: str = "") -> None:
    """One line per file; what there is to say of them, and what failed, where errors go. name: of the recording, to
    stand before what is said of it, where there are several."""
    for path in exported.files:
        print(f"{printable(path)}: {path.stat().st_size:,} bytes, read back and compared", flush=True)
    if exported.record is not None:
        print(f"{printable(exported.record)}: what they are", flush=True)
    before = f"{printable(name)}: " if name else ""
    for words in exported.neutral:
        print(f"{before}{words}", flush=True)
    for text in (*exported.warnings, *dict.fromkeys(map(str, exported.failed.values()))):
        say(f"phalanx: {before}{text}")


def tell_notes(notes: Mapping[str, Sequence[str]]) -> None:
    """What formats do not follow, each once. notes: of each recording, by its name."""
    of: dict[str, list[str]] = {}
    for name, texts in notes.items():
        for text in texts:
            of.setdefault(text, []).append(name)
    for text, names in of.items():
        whose = (
            "" if len(notes) == 1 else f"all {len(names)}: " if len(names) == len(notes) else ", ".join(names) + ": "
        )
        say(f"phalanx: {whose}{text}")
