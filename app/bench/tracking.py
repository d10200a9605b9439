"""Labels while hands are followed: frames with every label right, recovery, real recordings, and what it costs."""

from __future__ import annotations

import argparse
import importlib
import pkgutil
from pathlib import Path
from types import ModuleType
from typing import Any

import app.tracking_bench
from core.errors import FormatError


def experiments() -> dict[str, ModuleType]:
    """Every module of app.tracking_bench that is an experiment, by name."""
    names = (module.name for module in pkgutil.iter_modules(app.tracking_bench.__path__))
    modules = {name: importlib.import_module(f"app.tracking_bench.{name}") for name in sorted(names)}
    return {name: module for name, module in modules.items() if hasattr(module, "run")}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    known = experiments()
    parser.add_argument(
        "--only", metavar="NAME", nargs="+", choices=known, default=[], help="of " + ", ".join(known) + "; default all"
    )
    parser.add_argument("--data", metavar="DIR", type=Path, help="folder of the recordings")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="the first; default %(default)s")
    parser.add_argument("--seeds", metavar="N", type=int, default=5, help="how many; default %(default)s")
    parser.add_argument(
        "--failures", metavar="N", type=int, default=0, help="list the N longest wrong stretches after each row"
    )
    for module in known.values():
        if hasattr(module, "add_options"):
            module.add_options(parser)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Runs the experiments one after the other; each prints its table. Raises FormatError where recordings lack."""
    chosen = {name: module for name, module in experiments().items() if name in arguments.only or not arguments.only}
    figures: dict[str, Any] = {"seed": arguments.seed, "seeds": arguments.seeds}
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
