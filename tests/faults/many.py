"""The same thing over and over in one session: what is taken must be given back.

Run as a program: python -m tests.faults.many connects|takes TRIES COMMAND_PORT FOLDER
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

from app.process_memory import memory_of, trim
from app.session import Session
from core.profile import load_profile
from core.takes.take import TakeInfo
from devices.natnet.client import NatNetDevice
from tests.data import ROOT
from tests.faults.fault import Fault, Outcome
from tests.faults.stage import environment, served, started, until, wrong_sealed

FIRST = 40
"""Rounds after which everything that is made once has been made: the last of it, some 12 MB, between the 10th and the
40th."""
GROWN = 4 << 20
"""More memory than this was not given back [byte]."""


def _held() -> dict[str, int]:
    """What this process holds now."""
    trim()
    return {
        "threads": threading.active_count(),
        "descriptors": len(list(Path("/proc/self/fd").iterdir())),
        "bytes": memory_of(os.getpid()).own,
    }


def main(what: str, tries: int, port: int, folder: Path) -> dict[str, Any]:
    """Rounds done, the wrong ones in words, and what was held before and after."""
    session = Session(load_profile("schroeder6"))
    session.start()
    session.wait_ready()
    stream = session.add_device(NatNetDevice, {"command_port": port})
    wrong: list[str] = []
    before = _held()
    if what == "takes":
        session.connect(stream)
        stream.wait_connected(30.0)
    for i in range(tries):
        if what == "takes":
            path = folder / f"take{i + 1}.mcap"
            session.start_recording(path, TakeInfo(path.stem, rate_hz=120.0))
            until(lambda: session.numbers().recording.written >= 10, "ten frames")  # type: ignore[union-attr]
            summary = session.stop_recording().result(60.0)
            wrong += [f"take {i + 1}: {fault}"] if (fault := wrong_sealed(summary.path, off_m=1e-6)) else []
            path.unlink()
        else:
            received = stream.device.health().received
            session.connect(stream)
            until(lambda n=received: stream.device.health().received > n, "a frame")  # type: ignore[misc]
            session.disconnect(stream)
            stream.join(30.0)
        if i == min(FIRST, tries - 1):
            before = _held()
    after = _held()
    session.close()
    return {"wrong": wrong, "before": before, "after": after}


def _many(what: str, tries: int, folder: Path) -> Outcome:
    outcome = Outcome()
    with served() as server:
        command = [sys.executable, "-m", "tests.faults.many", what, str(tries), str(server.command_port), str(folder)]
        process = subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(folder)
        )
        started(process)
        out, errors = process.communicate(timeout=1800)
    if process.returncode:
        outcome.count(errors.strip().splitlines()[-1] if errors.strip() else "it ended")
        return outcome
    found = json.loads(out.splitlines()[-1])
    before, after = found["before"], found["after"]
    outcome.tried, outcome.survived, outcome.broken = tries, tries - len(found["wrong"]), found["wrong"]
    outcome.broken += [
        f"{after[kind] - before[kind]} {kind} more" for kind in before if kind != "bytes" and after[kind] > before[kind]
    ]
    grown = after["bytes"] - before["bytes"]
    if grown > GROWN:
        outcome.broken.append(f"{grown / 1e6:.1f} MB more")
    outcome.said = f"Afterwards as many threads and files open as before, {max(grown, 0) / 1e6:.1f} MB more memory."
    return outcome


def connects(tries: int, folder: Path) -> Outcome:
    """A device is connected and disconnected."""
    return _many("connects", tries, folder)


def takes(tries: int, folder: Path) -> Outcome:
    """Takes in a row."""
    return _many("takes", tries, folder)


FAULTS = (
    Fault("connects", "a device is connected and disconnected, over and over", 200, connects),
    Fault("takes", "takes in a row in one session", 100, takes),
)

if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))))
