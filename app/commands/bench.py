"""`phalanx bench NAME`: figures of this machine. Every module of app.bench is one."""

from __future__ import annotations

import argparse
import importlib
import pkgutil

import app.bench
from app.commands.result import Result


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser("bench", help="measure on this machine")
    names = parser.add_subparsers(title="benchmarks", metavar="NAME", required=True)
    for name in sorted(module.name for module in pkgutil.iter_modules(app.bench.__path__)):
        module = importlib.import_module(f"app.bench.{name}")
        what = (module.__doc__ or "").strip().partition("\n")[0]
        child = names.add_parser(name, help=what, description=what)
        child.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
        if hasattr(module, "add_options"):
            module.add_options(child)
        child.set_defaults(run=run, measure=module.run)


def run(arguments: argparse.Namespace) -> Result:
    """Measures; the module prints, its figures are the result."""
    return Result(figures=arguments.measure(arguments))
