"""`phalanx export TAKE`: other formats, each written file read back and compared."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.commands.result import Exit, Result
from app.commands.terminal import Progress


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser(
        "export",
        help="write a take in other formats",
        description="Writes a take in other formats; each file is read back and compared before it counts as done. "
        "Exit status 3: the take has time without frames.",
    )
    parser.add_argument("take", metavar="TAKE", type=Path)
    parser.add_argument(
        "--to", metavar="FORMATS", required=True, help="c3d, trc, csv, points, bvh, gltf; several with commas"
    )
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder for the files")
    parser.add_argument("--joints", action="store_true", help="C3D and TRC also hold the joint centres")
    parser.add_argument(
        "--bones", metavar="NAMES", default="phalanx",
        help="names of the joints in BVH and glTF: phalanx, vrm, unreal, unity, mixamo, mano",
    )  # fmt: skip
    parser.add_argument("--overwrite", action="store_true", help="replace files that are there already")
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """One line per file."""
    from core.takes.export import ExportOptions, export
    from core.takes.export.holes_csv import words
    from core.takes.reader import open_take
    from core.takes.solution import Solution

    formats = [name.strip().lower() for name in arguments.to.split(",") if name.strip()]
    options = ExportOptions(joints=arguments.joints, bones=arguments.bones)
    progress = Progress(f"Exporting {arguments.take.name}")
    with open_take(arguments.take) as take:
        solution = Solution.of_take(take)
        files = export(solution, formats, arguments.out, progress, arguments.overwrite, options)
        frames, holes = len(take.solved), take.holes
        last_s = float(take.raw.times_s[-1]) if len(take.raw) else 0.0
    progress.done()
    for path in files:
        print(f"{path}: {path.stat().st_size:,} bytes, read back and compared")
    if len(holes):
        print(f"{words(holes, last_s)} {files[-1].name} says where.")
    return Result(
        Exit.LOSS if len(holes) else Exit.DONE,
        figures={"take": arguments.take, "formats": formats, "frames": frames, "holes": holes, "files": files},
    )
