"""`make fuzz`: every reader against spoilt files, for as long as asked."""

from __future__ import annotations

import argparse
import os
import secrets
import sys
from pathlib import Path

# Before numpy: threads of its own would be lost in the processes that are forked.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from core.errors import PhalanxError
from tests.fuzz.readers import BY_NAME, READERS
from tests.fuzz.rounds import Order, run, table


def main() -> int:
    """The exit status: 0 if nothing broke a reader."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="in all, shared among the readers; %(default)s")
    parser.add_argument("--cases", type=int, default=0, help="this many files of each reader, however long it takes")
    parser.add_argument("--seed", type=int, default=None, help="of an earlier run, to try the same files again")
    parser.add_argument("--reader", action="append", choices=sorted(BY_NAME), help="only this one; may be repeated")
    parser.add_argument("--case", type=int, default=-1, help="only the file of this number")
    parser.add_argument("--file", type=Path, help="read this file, unprotected, with the one --reader")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="readers at once; %(default)s")
    parser.add_argument("--failures", type=Path, default=Path("fuzz-failures"), help="folder; %(default)s")
    arguments = parser.parse_args()
    readers = [BY_NAME[name] for name in arguments.reader] if arguments.reader else list(READERS)
    if arguments.file is not None:
        if len(readers) != 1:
            parser.error("--file is read by one --reader")
        try:
            readers[0].read(arguments.file)
        except PhalanxError as error:
            print(f"Refused: {error}")
        else:
            print("Read.")
        return 0
    seed = secrets.randbelow(1 << 31) if arguments.seed is None else arguments.seed
    print(f"Seed {seed}: again with `make fuzz SEED={seed}`.", flush=True)
    order = Order(
        seed, arguments.seconds, arguments.cases, arguments.jobs, arguments.failures.resolve(), arguments.case
    )
    rounds = run(order, readers)
    print(table(rounds))
    for one in rounds:
        for number, said in one.broken[:3]:
            print(f"\n{one.reader.name}, file {number}: {said}")
    broken = sum(len(one.broken) for one in rounds)
    if broken:
        print(f"\n{broken} files broke a reader. They lie in {order.failures}, each with how to read it again.")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
