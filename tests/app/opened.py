"""Opens one file with everything that opens takes, and says how each of it ended: run by test_faults_takes.

Prints a JSON object: of each way its exit status, what it said, and its processor seconds; and the most memory [byte].
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import shutil
import sys
import tempfile
from pathlib import Path
from threading import Event
from typing import Any

from app.cli import main
from app.review.document import ReviewDocument, read_analysis, rescue
from app.review.job import Report
from app.review.take_row import read_row
from core.errors import PhalanxError
from tests.memory import most_bytes

COMMANDS = {
    "info": "info {take} --json",
    "verify": "verify {take} --json",
    "recover": "recover {take} --json",
    "export": "export {take} --to csv --out {out}",
    "track": "track {take} --profile han19 --out {out}/track",
    "layout": "layout show {take}",
    "calibrate": "calibrate hand {take} --profile han19 --out {out}/profile.json",
    "neutral": "calibrate neutral {take} --from 0 --to 1 --profile han19 --out {out}/flat.json",
    "subspace": "subspace {take} --out {out}/subspace.json",
    "prop": "prop define {take} --points 0,1,2 --name pen --out {out}/prop.json",
}


def review(take: Path) -> int:
    """What the review room does with a file: its line in the list, opening, frames, curves, and making it whole."""
    report = Report(lambda _, value: None, Event())
    row = read_row(take)
    print(row)
    try:
        document = ReviewDocument(take, report)
        for i in range(document.n_frames):
            document.frame(i)
        if document.recorded is not None and document.n_frames:
            read_analysis(take, document.recorded, report)
        document.close()
        if not row.sealed or row.damaged:
            rescue(take, report)
    except PhalanxError as error:
        print(error)
        return 1
    return 0


def opened(source: Path) -> dict[str, Any]:
    """How each way to open it ended."""
    told: dict[str, Any] = {}
    for name in (*COMMANDS, "review"):
        with tempfile.TemporaryDirectory() as folder:
            take, out = Path(folder) / source.name, Path(folder) / "out"
            shutil.copyfile(source, take)
            out.mkdir()
            words = [word.format(take=take, out=out) for word in COMMANDS.get(name, "").split()]
            text, began_s = io.StringIO(), sum(os.times()[:4])
            with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
                try:
                    code = main(words) if words else review(take)
                except SystemExit as stop:
                    code = int(stop.code or 0)
            said = text.getvalue().replace(folder, "")
            told[name] = {"code": code, "text": said, "seconds": sum(os.times()[:4]) - began_s}
    told["bytes"] = most_bytes()
    return told


if __name__ == "__main__":
    sys.stdout.write(json.dumps(opened(Path(sys.argv[1]))) + "\n")
