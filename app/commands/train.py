"""`phalanx train labeller`: make a network that names markers, for all layouts or for one."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from app.commands.out import out_file
from app.commands.result import Result
from app.commands.terminal import say, until_stopped, warn
from core.errors import FormatError, PhalanxError
from core.printable import printable

if TYPE_CHECKING:
    from core.markers.layout import MarkerLayout
    from core.training.labelled import LabelledFrames
    from core.training.labeller import Order
    from core.training.loop import Progress

ARCHITECTURES = ("set", "han2018")


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser("train", help="train a network (needs the extra: pip install 'phalanx[train]')")
    kinds = parser.add_subparsers(title="what", metavar="WHAT", required=True)
    labeller = kinds.add_parser(
        "labeller",
        help="the network that names markers in one frame",
        description="Trains a labelling network on hands made by Phalanx: any shape of hand, any pose, markers hidden "
        "and reflections added. Without --layout it learns the shipped layouts and made-up ones, and names the markers "
        "of a new glove without more training; with --layout it learns that one only, which is quicker. Ctrl+C ends "
        "early and keeps the best so far.",
    )
    labeller.add_argument("--layout", metavar="FILE", help="the only layout to learn: a shipped one or a file")
    labeller.add_argument(
        "--data", metavar="DIR", type=Path,
        help="folder of your own labelled recordings of that layout to learn from too (TRC, C3D, TSV, CSV, .npz)",
    )  # fmt: skip
    labeller.add_argument(
        "--without", metavar="NAME", nargs="+", default=(),
        help="recordings of --data to leave out, such as user4.npz, to measure the network on",
    )  # fmt: skip
    labeller.add_argument(
        "--from", dest="start", metavar="NETWORK", type=Path,
        help="go on from an earlier network: a few minutes make one that knows your layout or recordings better",
    )  # fmt: skip
    labeller.add_argument("--minutes", metavar="M", type=float, default=50.0, help="default %(default)g")
    labeller.add_argument("--seed", metavar="N", type=int, default=0, help="default %(default)s")
    labeller.add_argument("--threads", metavar="N", type=int, default=os.cpu_count() or 1, help="default %(default)s")
    labeller.add_argument(
        "--architecture", choices=ARCHITECTURES, default="set",
        help="default %(default)s; han2018 is the published one, for one layout, to compare with",
    )  # fmt: skip
    labeller.add_argument("--out", metavar="NETWORK", type=out_file, required=True, help=".onnx file to write")
    labeller.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    labeller.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """Trains and writes the network and its card."""
    warnings: dict[str, Sequence[str]] = {}
    order = order_of(arguments, warnings)
    for name, texts in warnings.items():
        warn(name, texts)
    say(f"Making postures, then training for {arguments.minutes:g} minutes. Ctrl+C keeps the best so far.")

    def report(progress: Progress) -> None:
        say(
            f"{100.0 * progress.share:3.0f} %, {progress.samples:,} clouds, {progress.samples_per_s:,.0f} a second: "
            f"loss {progress.loss:.3f}, {100.0 * progress.accuracy:.2f} % of validation points named right, "
            f"{progress.left_s / 60.0:.1f} minutes left"
        )

    with until_stopped() as stopped:
        if arguments.architecture == "han2018":
            from core.training.han2018 import make_reference

            card = make_reference(order, report, stopped.is_set)
        else:
            from core.training.labeller import make

            card = make(order, report, stopped.is_set)
    print(f"{printable(arguments.out)} written, and its card {arguments.out.with_suffix('.json').name}.")
    return Result(figures={**card, "out": arguments.out, "warnings": warnings})


def order_of(arguments: argparse.Namespace, warnings: dict[str, Sequence[str]] | None = None) -> Order:
    """What the words of the command ask for, as training takes it. Raises PhalanxError for what cannot be trained.

    warnings: gets what the reader of each recording warns of, by the name of the file.
    """
    if not arguments.minutes > 0.0:
        raise PhalanxError(f"--minutes {arguments.minutes:g}.", "Give the minutes to train for, such as 50.")
    if arguments.threads < 1:
        raise PhalanxError(f"--threads {arguments.threads}.", "Give at least one.")
    if arguments.out.suffix != ".onnx":
        raise FormatError(f"--out {arguments.out}.", "Its name must end in .onnx.")
    if not arguments.out.absolute().parent.is_dir():
        raise FormatError(
            f"Folder {arguments.out.absolute().parent} is not there.", "Make it, or choose another place."
        )
    card = arguments.out.with_suffix(".json")
    if arguments.layout and Path(arguments.layout).absolute() == card.absolute():
        raise FormatError(
            f"--out {arguments.out}: its card {card.name} would replace the layout.", "Name it otherwise."
        )
    from core.markers.layout import load_layout

    layout = load_layout(arguments.layout) if arguments.layout else None
    if arguments.data is not None and layout is None:
        raise PhalanxError("--data needs --layout.", "Say which layout your recordings wear.")
    if arguments.architecture == "han2018" and layout is None:
        raise PhalanxError("The architecture of Han 2018 knows one layout.", "Name it with --layout, such as han19.")
    if arguments.architecture == "han2018" and arguments.start is not None:
        raise PhalanxError("--from does not go with --architecture han2018.", "Leave one of the two out.")
    recordings: tuple[LabelledFrames, ...] = ()
    if layout is not None and arguments.data is not None:
        recordings = _recordings(arguments.data, layout, arguments.without, {} if warnings is None else warnings)
    missing = missing_packages()
    if missing:
        raise PhalanxError(
            f"Training needs {' and '.join(missing)}, not installed here.",
            "Run: python -m pip install 'phalanx[train]'.",
        )
    from core.training.labeller import Order

    return Order(
        60.0 * arguments.minutes, arguments.seed, arguments.out, layout, recordings, arguments.threads,
        arguments.start,
    )  # fmt: skip


def missing_packages() -> list[str]:
    """What training needs and is not installed here."""
    return [package for package in ("torch", "onnx") if find_spec(package) is None]


def _recordings(
    folder: Path, layout: MarkerLayout, without: Sequence[str], warnings: dict[str, Sequence[str]]
) -> tuple[LabelledFrames, ...]:
    """Every recording of a folder but those named in `without`. Raises FormatError naming the first that cannot be
    read or left out, or an empty folder."""
    from core.training.labelled import read_labelled

    if not folder.is_dir():
        raise FormatError(f"Folder {folder} is not there.", "Give the folder that holds your labelled recordings.")
    paths = sorted(path for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
    names = [path.name for path in paths]
    for name in without:
        if name not in names:
            raise FormatError(f"--without {name}: {folder} holds no such file.", f"It holds {', '.join(names)}.")
    paths = [path for path in paths if path.name not in without]
    found = [
        read_labelled(path, layout) if path.suffix == ".npz" else _labelled(path, layout, warnings)
        for path in paths
        if path.suffix.lower() in (".npz", ".trc", ".c3d", ".tsv", ".csv")
    ]
    frames = [recording for recording in found if len(recording.points_m)]
    if not frames:
        raise FormatError(f"{folder} holds no recording with markers of {layout.name}.", "Choose another folder.")
    return tuple(frames)


def _labelled(path: Path, layout: MarkerLayout, warnings: dict[str, Sequence[str]]) -> LabelledFrames:
    """A labelled recording of one or two hands, each a hand of its own."""
    import numpy as np

    from app.labels import label_map
    from core.frames import SIDES
    from core.profile import Profile
    from core.takes.formats import read_recording
    from core.training.clouds import LEFT, RIGHT
    from core.training.labelled import LabelledFrames

    recording = read_recording(path)
    warnings[path.name] = recording.warnings
    columns = label_map(recording, Profile("", layout, layout.sides)) or {}
    points, sides = [], []
    for side in SIDES:
        own = np.full((recording.n_frames, len(layout.joints), 3), np.nan)
        for column, identity in enumerate(recording.ids if recording.labels else ()):
            hand, marker = columns.get(int(identity), (None, 0))
            if hand == side:
                own[:, marker] = recording.points_m[:, column]
        seen = np.isfinite(own[..., 0]).sum(axis=1) >= len(layout.joints) // 2
        points.append(own[seen])
        sides.append(np.full(int(seen.sum()), RIGHT if side == "right" else LEFT))
    return LabelledFrames(path.name, np.concatenate(points), np.concatenate(sides))
