"""How well poses, surfaces and hand shapes are found: the experiments of the papers, beside the papers' own figures.

The protocols are those of Schröder 2017 and Han 2018 as far as the papers tell them; each experiment prints what it
does. Those on recordings need --data, the folder in which they lie as han2018/ and qualisys_hand/.
"""

from __future__ import annotations

import argparse
import importlib
import pkgutil
from pathlib import Path
from types import ModuleType
from typing import Any

import app.reconstruction
from core.errors import FormatError


def experiments() -> dict[str, ModuleType]:
    """Every module of app.reconstruction that is an experiment, by name."""
    names = (module.name for module in pkgutil.iter_modules(app.reconstruction.__path__))
    modules = {name: importlib.import_module(f"app.reconstruction.{name}") for name in sorted(names)}
    return {name: module for name, module in modules.items() if hasattr(module, "run")}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    known = experiments()
    parser.add_argument(
        "--only", metavar="NAME", nargs="+", choices=known, default=[], help="of " + ", ".join(known) + "; default all"
    )
    parser.add_argument("--data", metavar="DIR", type=Path, help="folder of the recordings")
    parser.add_argument("--out", metavar="DIR", type=Path, help="folder for plots; without it none is drawn")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="what is drawn at random; default %(default)s")
    parser.add_argument(
        "--frames", metavar="N", type=int, help="at most so many of each motion, for a quick look; default: enough"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Runs the experiments one after the other; each prints its table. Raises FormatError where recordings lack."""
    chosen = {name: module for name, module in experiments().items() if name in arguments.only or not arguments.only}
    if arguments.out is not None:
        arguments.out.mkdir(parents=True, exist_ok=True)
    figures: dict[str, Any] = {"seed": arguments.seed}
    for name, module in chosen.items():
        lacking = [folder for folder in getattr(module, "NEEDS", ()) if not _there(arguments.data, folder)]
        if lacking and arguments.only:
            raise FormatError(f"{name} needs {' and '.join(lacking)}.", "Give the folder that holds it as --data.")
        print(f"\n{name}: {(module.__doc__ or '').strip().partition(chr(10))[0]}")
        if lacking:
            print(f"  left out: it needs {' and '.join(lacking)} in the folder given as --data")
            continue
        figures[name] = module.run(arguments)
    return figures


def _there(data: Path | None, folder: str) -> bool:
    return data is not None and (data / folder).is_dir()
