"""`make faults`: tries what may go wrong on a capture day on the real programs, and says what became of the takes.

The table goes to standard output; the exit status is 1 if anything did not survive.
"""

from __future__ import annotations

import argparse
import json
import re
import signal
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from tests.faults.all import FAULTS
from tests.faults.fault import Fault, NotHere, Outcome
from tests.faults.stage import end_all
from tests.faults.table import Row, markdown, write_into


def main(words: list[str] | None = None) -> int:
    """The exit status."""
    names = [fault.name for fault in FAULTS]
    parser = argparse.ArgumentParser(prog="make faults", description=(__doc__ or "").partition("\n")[2].strip())
    parser.add_argument("fault", nargs="*", metavar="FAULT", help=f"only these; default all: {', '.join(names)}")
    parser.add_argument("--tries", type=int, metavar="N", help="how often each; default: as often as each says")
    parser.add_argument("--at-once", type=int, metavar="N", default=2, help="faults side by side; default %(default)s")
    parser.add_argument("--into", type=Path, metavar="FILE", help="a document whose lines are renewed")
    parser.add_argument("--folder", type=Path, metavar="DIR", help="where takes are written; default a new one")
    parser.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
    arguments = parser.parse_args(words)
    unknown = sorted(set(arguments.fault) - set(names))
    if unknown or (arguments.tries is not None and arguments.tries < 1):
        parser.error(f"no such fault: {', '.join(unknown)}" if unknown else "--tries must be 1 or more")
    chosen = [fault for fault in FAULTS if not arguments.fault or fault.name in arguments.fault]
    began = time.monotonic()
    rows = _rows(chosen, arguments)
    table = markdown(rows)
    print(table)
    broken = [row for row in rows if not row.survived]
    print(f"{len(rows)} faults in {time.monotonic() - began:.0f} s; {len(broken)} with losses that should not be.")
    if arguments.into is not None:
        write_into(arguments.into, rows, [fault.what for fault in FAULTS])
    if arguments.json:
        print(json.dumps({row.fault.name: {**asdict(row.outcome), "not_tried": row.not_tried} for row in rows}))
    return 1 if broken else 0


def _rows(chosen: list[Fault], arguments: argparse.Namespace) -> list[Row]:
    """In the order of the table. Most of the time programs start, so that some are tried side by side."""
    done: dict[str, Row] = {}

    def attempt(fault: Fault) -> None:
        done[fault.name] = _row(fault, arguments.tries or fault.tries, arguments.folder)

    before = signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    with ThreadPoolExecutor(max(arguments.at_once, 1)) as pool:
        try:
            list(pool.map(attempt, [fault for fault in chosen if not fault.alone]))
            for fault in chosen:
                if fault.alone:
                    attempt(fault)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            end_all()
            raise
        finally:
            signal.signal(signal.SIGTERM, before)
    return [done[fault.name] for fault in chosen]


def _row(fault: Fault, tries: int, folder: Path | None) -> Row:
    began = time.monotonic()
    outcome, not_tried = Outcome(), ""
    with tempfile.TemporaryDirectory(dir=folder, prefix=f"phalanx-{fault.name}-", ignore_cleanup_errors=True) as place:
        try:
            outcome = fault.run(tries, Path(place))
        except NotHere as reason:
            not_tried = str(reason)
        except Exception as error:  # a row that breaks is a row that did not survive, and the others go on
            outcome.count(f"{type(error).__name__}: {error}")
        paths = re.compile(re.escape(place) + r"(/[^/\s]+)*/")  # of folders that were made for the occasion
        outcome.said = paths.sub("", outcome.said)
        outcome.broken = [paths.sub("", wrong) for wrong in outcome.broken]
    came = f"not tried, {not_tried}" if not_tried else f"{outcome.survived} of {outcome.tried}"
    lines = [f"{fault.name}: {came}, {time.monotonic() - began:.0f} s", *(f"  {wrong}" for wrong in outcome.broken[:5])]
    print("\n".join(lines), file=sys.stderr, flush=True)
    return Row(fault, outcome, not_tried)


if __name__ == "__main__":
    sys.exit(main())
