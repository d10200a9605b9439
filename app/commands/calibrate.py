"""`phalanx calibrate WHAT`: find out what is particular to a performer. Every module of app.calibrate is a way."""

from __future__ import annotations

import argparse
import importlib
import pkgutil

import app.calibrate


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser("calibrate", help="make the profile of a performer")
    ways = parser.add_subparsers(title="what", metavar="WHAT", required=True)
    for name in sorted(m.name for m in pkgutil.iter_modules(app.calibrate.__path__)):
        module = importlib.import_module(f"app.calibrate.{name}")
        text, _, more = (module.__doc__ or "").strip().partition("\n")
        way = ways.add_parser(getattr(module, "NAME", name), help=text, description=f"{text}\n{more}".strip())
        way.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
        module.add_options(way)
        way.set_defaults(run=module.run)
