"""Some seconds of `make fuzz`, on the same files each time; and that what breaks a reader is found."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from core.errors import FormatError
from tests.data import ROOT
from tests.fuzz.child import case_of
from tests.fuzz.readers import BY_NAME, READERS, Reader
from tests.fuzz.rounds import Order, run, table

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of time and memory are those of Linux")

CASES = 25
SEED = 15


def test_no_spoilt_file_breaks_a_reader(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.fuzz", "--cases", str(CASES), "--seed", str(SEED), "--jobs", "1"]
    ran = subprocess.run([*command, "--failures", str(tmp_path)], cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    rows = [line for line in ran.stdout.splitlines() if line.startswith(tuple(f"{one.name:16}" for one in READERS))]
    assert len(rows) == len(READERS)
    assert all(int(row[16:24]) == CASES for row in rows), ran.stdout


def test_a_case_is_the_same_for_the_same_seed() -> None:
    reader = BY_NAME["trc"]
    sound = list(reader.samples())
    first = [case_of(reader, sound, 3, number) for number in range(20)]
    assert first == [case_of(reader, sound, 3, number) for number in range(20)]
    assert first != [case_of(reader, sound, 4, number) for number in range(20)]
    assert len(set(first)) > 10


def _breaking(path: Path) -> object:
    """Does with a file what is written in it."""
    match path.read_bytes()[:1]:
        case b"s":
            return "sound"
        case b"r":
            raise FormatError("refused")
        case b"e":
            return json.loads("[" * 100_000)
        case b"m":
            return len(bytes(range(256)) * (3 << 20))
        case b"a":
            return bytearray(1 << 40)
        case b"l":
            while True:
                pass
        case b"k":
            os.kill(os.getpid(), signal.SIGSEGV)
    return None


def test_whatever_breaks_a_reader_is_found_and_the_run_goes_on(tmp_path: Path) -> None:
    """Run as a program: this process has threads, and must not be forked."""
    program = "import sys; from tests.fuzz.test_readers_hold import broken; broken(sys.argv[1])"
    ran = subprocess.run([sys.executable, "-c", program, str(tmp_path)], cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    found = json.loads(ran.stdout.splitlines()[-1])
    assert sum(found["outcomes"].values()) == BREAKING
    assert found["outcomes"]["read"] and found["outcomes"]["refused"]
    words = {"e": "RecursionError", "m": "MB", "a": "MemoryError", "l": "5 s of the processor", "k": "SIGSEGV"}
    seen = set()
    for number, said in found["broken"]:
        what = (tmp_path / f"breaking-{BREAKING_SEED}-{number}.bin").read_text()[0]
        assert words[what] in said
        assert f"CASE={number}" in (tmp_path / f"breaking-{BREAKING_SEED}-{number}.txt").read_text()
        seen.add(what)
    assert seen == set(words)


BREAKING, BREAKING_SEED = 11, 33  # each kind once or twice


def broken(folder: str) -> None:
    """What is found where files break a reader in every way."""

    def as_it_is(data: bytes, random: object) -> bytes:
        return data

    sound = [letter.encode() for letter in "sremalk"]
    (told,) = run(
        Order(BREAKING_SEED, 0.0, BREAKING, 1, Path(folder)),
        [Reader("breaking", ".bin", _breaking, lambda: sound, (as_it_is,), ())],
    )
    print(table([told]))
    print(json.dumps({"outcomes": told.outcomes, "broken": told.broken}))
