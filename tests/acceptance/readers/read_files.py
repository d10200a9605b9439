"""What every reader of this folder shares: `python READER.py OUT.json FILE...` tells what a program found in the files.

The readers run in a process of their own, with nothing of Phalanx in it: they are the other program.
"""

import json
import sys
import traceback
from pathlib import Path


def tell(program, version, read):
    """Writes {"program", "version", "files": {path: what `read(path)` found, or {"error": text}}} to OUT.json."""
    found = {}
    for path in sys.argv[2:]:
        try:
            found[path] = read(path)
        except Exception:
            found[path] = {"error": traceback.format_exc(limit=-1)}
    told = json.dumps({"program": program, "version": version, "files": found})
    Path(sys.argv[1]).write_text(told, encoding="utf-8")
