"""Benchmarks that are made of experiments: the modules of a package that have a `run`.

An experiment may have `add_options(parser)`, and `NEEDS`: folders of recordings without which it is left out.
"""

from __future__ import annotations

import argparse
import importlib
import pkgutil
from pathlib import Path
from types import ModuleType
from typing import Any

from core.errors import FormatError

Experiments = dict[str, ModuleType]


def experiments_of(package: ModuleType) -> Experiments:
    """By name."""
    names = (module.name for module in pkgutil.iter_modules(package.__path__))
    modules = {name: importlib.import_module(f"{package.__name__}.{name}") for name in sorted(names)}
    return {name: module for name, module in modules.items() if hasattr(module, "run")}


def add_choice(parser: argparse.ArgumentParser, known: Experiments) -> None:
    """The options that choose among them, and their own."""
    parser.add_argument(
        "--only", metavar="NAME", nargs="+", choices=known, default=[], help="of " + ", ".join(known) + "; default all"
    )
    parser.add_argument("--data", metavar="DIR", type=Path, help="folder of the recordings")
    for module in known.values():
        if hasattr(module, "add_options"):
            module.add_options(parser)


def run_chosen(known: Experiments, arguments: argparse.Namespace) -> dict[str, Any]:
    """Figures by name; they run one after the other, and each prints its table. Raises FormatError where recordings
    lack for one that was chosen by name."""
    figures: dict[str, Any] = {}
    for name, module in known.items():
        if arguments.only and name not in arguments.only:
            continue
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
