"""Reads spoilt files, one after the other, in a process of its own under limits of time and memory."""

from __future__ import annotations

import json
import os
import resource
import signal
import time
import traceback
from collections.abc import Iterable
from pathlib import Path
from random import Random

from core.errors import PhalanxError
from tests.fuzz.mutations import spliced, spoilt
from tests.fuzz.readers import Reader

MOST_S = 5.0
"""Of the processor, for one file [s]: that time does not grow when others use the machine."""

WAITING_S = 30.0
"""By the clock [s]: what waits for ever uses no processor."""

MOST_MB = 500

_ADDRESSES_MB = 2000
"""Address space beyond what the process has before it reads: what asks for more is refused it."""


def case_of(reader: Reader, sound: list[bytes], seed: int, number: int) -> bytes:
    """The spoilt file of this number: the same for the same seed."""
    random = Random(f"{seed}/{reader.name}/{number}")
    return spoilt(sound, (*reader.mutations, spliced(sound)), random)


def serve(reader: Reader, sound: list[bytes], seed: int, numbers: Iterable[int], seconds: float, folder: Path) -> None:
    """Reads the cases of these numbers, or of as many as there are `seconds` for, in `folder`.

    What becomes of each is said on the standard output, a JSON object a line, before and after: whoever waits for this
    knows of the file that ended it. The first of the sound files is read beforehand, and must be.
    """
    told = os.fdopen(os.dup(1), "w", buffering=1)
    silent = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(silent, stream)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"case{reader.suffix}"
        path.write_bytes(sound[0])
        reader.read(path)  # kernels are compiled, modules loaded
        _limit_addresses()
        until_s = time.monotonic() + seconds
        for number in numbers:
            if time.monotonic() > until_s:
                break
            path.write_bytes(case_of(reader, sound, seed, number))
            print(json.dumps({"began": number}), file=told)
            print(json.dumps({"number": number, **outcome_of(reader, path)}), file=told)
    except Exception:  # of this harness, or of a reader that does not read what is sound
        print(json.dumps({"failed": traceback.format_exc()}), file=told)


def outcome_of(reader: Reader, path: Path) -> dict[str, object]:
    """What becomes of a file: read, refused or broke, with seconds, megabytes, and what was said."""
    before = _begin_peak()
    signal.setitimer(signal.ITIMER_PROF, MOST_S)  # its signal ends the process, wherever it is
    signal.setitimer(signal.ITIMER_REAL, WAITING_S)
    began, outcome, said = time.process_time(), "read", ""
    try:
        reader.read(path)
    except PhalanxError as error:
        outcome, said = "refused", str(error)
    except BaseException as error:  # of whatever kind: that is what is looked for
        where = "".join(traceback.format_tb(error.__traceback__)[-4:])
        outcome, said = "broke", f"{type(error).__name__}: {str(error)[:300]}\n{where}"
    seconds = time.process_time() - began
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    megabytes = (_status("VmHWM") - before) / 1e6
    if megabytes > MOST_MB and outcome != "broke":
        outcome, said = "broke", f"It took {megabytes:.0f} MB. {said}"
    return {"outcome": outcome, "said": said, "seconds": seconds, "megabytes": megabytes}


def _limit_addresses() -> None:
    most = _status("VmSize") + (_ADDRESSES_MB << 20)
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _begin_peak() -> int:
    """Lets the highest use of memory be counted anew; what is used now [bytes]."""
    Path("/proc/self/clear_refs").write_text("5")
    return _status("VmRSS")


def _status(name: str) -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(name + ":"):
            return int(line.split()[1]) << 10
    return 0
