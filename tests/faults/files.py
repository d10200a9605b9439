"""Files that are damaged, crafted, or no files at all: each is read rightly or refused in words, soon and in little
memory."""

from __future__ import annotations

import io
import json
import os
import random
import struct
import subprocess
import sys
import zipfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from core.profile import load_profile, save_profile
from core.takes.export import FORMATS, export
from core.takes.reader import open_take
from core.takes.solution import Solution
from tests.app.takes import write_take
from tests.data import CASES, ROOT
from tests.faults.fault import Fault, Outcome
from tests.faults.opened import Opened, opener
from tests.faults.stage import environment

PIPE_S = 30.0
_NUMBERS = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 1 << 34, 1 << 40, 1 << 62, (1 << 63) - 1)


def labelled(path: str) -> None:
    """A labelled recording, as `train --data` opens it."""
    from core.training.labelled import read_labelled

    read_labelled(Path(path), load_profile("han19").layout)


def ways(path: Path, out: Path) -> list[tuple[str, ...]]:
    """Everything that opens a file like this. out: where results may go."""
    name, file = path.name, str(path)
    if path.suffix == ".mcap":
        return [("info", file), ("verify", file)]
    if path.suffix == ".onnx":
        return [("=core.labelling.network:network_at", file)]
    if path.suffix == ".npz":
        mano = ("calibrate", "import", file, "--profile", "han19", "--out", str(out))
        return [mano, ("=tests.faults.files:labelled", file)]
    if "subspace" in name:
        return [("=core.motion.subspace:load_subspace", file)]
    if "prop" in name:
        return [("prop", "add", file, "--profile", "han19", "--out", str(out))]
    if path.suffix == ".json":
        return [("layout", "show", file)]
    return [("info", file)]


class _Tally:
    """Of files opened: how many were read, refused, and what was wrong."""

    def __init__(self, outcome: Outcome) -> None:
        self.outcome, self.read, self.refused = outcome, 0, 0
        self._kinds: Counter[str] = Counter()

    def add(self, path: Path, found: list[Opened]) -> None:
        """One file by all its ways."""
        wrong = next((one.wrong for one in found if one.wrong), "")
        self.outcome.count(f"{path.name} {wrong}" if wrong else None)
        if not wrong:
            refused = found[0].refused
            self.refused += refused
            self.read += not refused

    def close(self) -> None:
        """Says it."""
        self.outcome.lost = "nothing: files are only read"
        self.outcome.said = f"{self.refused:,} were refused or called damaged in words, {self.read:,} were read."


def _samples(folder: Path) -> list[Path]:
    """One good file of each kind."""
    folder.mkdir()
    sealed = write_take(folder, "sealed", 20)
    write_take(folder, "unsealed", 20, seal=False)
    with open_take(sealed) as take:
        export(Solution.of_take(take), [name for name in FORMATS if name in ("c3d", "trc", "csv")], folder / "exports")
    save_profile(load_profile("han19"), folder / "profile.json")
    for source in ("layouts/han19.json", "subspaces/generic.json", "networks/labeller.onnx"):
        content = (ROOT / "resources" / source).read_bytes()
        name = {"generic.json": "subspace.json"}.get(Path(source).name, Path(source).name)
        (folder / name).write_bytes(content)
    points = np.zeros((4, 19, 3))
    names = np.array(load_profile("han19").layout.marker_names)
    np.savez(folder / "labelled.npz", points=points, hand=np.zeros(4, dtype=np.int64), marker_names=names)
    rows = [f"{i},{i / 100},1,0,0,0\n" for i in range(50)]
    (folder / "points.csv").write_text("frame,time_s,id,x_m,y_m,z_m\n" + "".join(rows))
    return sorted(path for path in folder.rglob("*") if path.is_file())


def mutation(data: bytes, chance: random.Random) -> bytes:
    """The same file with some damage: bytes changed, lost, doubled, a number made huge, an end that is not there."""
    changed = bytearray(data)
    for _ in range(chance.choice((1, 1, 2, 8))):
        if not changed:
            break
        at, length = chance.randrange(len(changed)), chance.choice((1, 4, 16, 256))
        match chance.randrange(6):
            case 0:
                changed[at] ^= 1 << chance.randrange(8)
            case 1:
                changed[at : at + length] = chance.randbytes(length)
            case 2:
                del changed[at : at + length]
            case 3:
                changed[at:at] = changed[at : at + length]
            case 4:
                number = struct.pack("<Q", chance.choice(_NUMBERS))[: chance.choice((2, 4, 8))]
                changed[at : at + len(number)] = number
            case _:
                del changed[at:]
    return bytes(changed)


def mutated(tries: int, folder: Path) -> Outcome:
    """Good files of every kind, damaged by seed."""
    outcome = Outcome()
    tally, samples = _Tally(outcome), _samples(folder / "samples")
    with opener(folder) as phalanx:
        for seed in range(tries):
            source = samples[seed % len(samples)]
            damaged = folder / f"{seed}_{source.name}"
            damaged.write_bytes(mutation(source.read_bytes(), random.Random(seed)))
            tally.add(damaged, [phalanx.open(*way) for way in ways(damaged, folder / "out.json")])
            damaged.unlink()
    tally.close()
    return outcome


def _crafted(folder: Path) -> Iterator[Path]:
    """Files made to do harm: those collected, where they are here, and some made now."""
    collected = CASES / "faults"
    if collected.is_dir():
        yield from sorted(path for path in collected.iterdir() if path.suffix in (".mcap", ".npz", ".onnx", ".json"))
    folder.mkdir()
    deep = "[" * 200_000 + "]" * 200_000
    made: dict[str, bytes] = {
        "deep_layout.json": deep.encode(),
        "deep_prop.json": b'{"a":' * 100_000 + b"1" + b"}" * 100_000,
        "digits_layout.json": json.dumps({"version": 1}).replace("1", "9" * 6000).encode(),
        "latin_subspace.json": b'{"name": "\xe9\xff"}',
        "empty_profile.json": b"",
        "huge_header.npz": _npz(b"{'descr': '<f8', 'fortran_order': False, 'shape': (1099511627776, 19, 3), }"),
        "bomb.npz": _bomb(),
        "long_line_points.csv": b"frame,time_s,id,x_m,y_m,z_m\n" + b"1" * 5_000_000,
        "frames_claimed.c3d": b"\x02\x50" + struct.pack("<8H", 65535, 0, 1, 65535, 0, 0, 0, 2) + bytes(494),
    }
    for name, content in made.items():
        (folder / name).write_bytes(content)
        yield folder / name


def _npz(header: bytes) -> bytes:
    out = io.BytesIO()
    header = header.ljust(118) + b"\n"
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("points.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header)
    return out.getvalue()


def _bomb() -> bytes:
    """A gigabyte of nothing in a megabyte."""
    out = io.BytesIO()
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (2293760, 19, 3), }".ljust(118) + b"\n"
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("points.npy", "w") as file:
        file.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header)
        for _ in range(1024):
            file.write(bytes(1 << 20))
    return out.getvalue()


def crafted(tries: int, folder: Path) -> Outcome:
    """Each of them, by everything that opens it; `tries` bounds how many."""
    outcome = Outcome()
    tally = _Tally(outcome)
    with opener(folder) as phalanx:
        for path in list(_crafted(folder / "made"))[:tries]:
            tally.add(path, [phalanx.open(*way) for way in ways(path, folder / "out.json")])
    tally.close()
    return outcome


def pipes(tries: int, folder: Path) -> Outcome:
    """Named pipes that nobody writes to, and device files, where a file is expected."""
    outcome = Outcome()
    made = {name: folder / name for name in ("pipe.trc", "pipe.mcap", "pipe.json")}
    for path in made.values():
        os.mkfifo(path)
    zero = Path("/dev/zero")
    words = [
        ("info", made["pipe.trc"]),
        ("verify", made["pipe.mcap"]),
        ("track", made["pipe.trc"], "--profile", "han19", "--out", folder / "out"),
        ("layout", "show", made["pipe.json"]),
        ("info", zero),
        ("layout", "show", zero),
    ]
    for one in words[:tries]:
        try:
            done = subprocess.run(
                [sys.executable, "-m", "app", *map(str, one)],
                cwd=ROOT, capture_output=True, text=True, timeout=PIPE_S, check=False, env=environment(folder),
                stdin=subprocess.DEVNULL,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            outcome.count(f"{one[0]} waits for {Path(str(one[1])).name} for ever")
            continue
        clear = done.returncode in (1, 2) and "Unexpected" not in done.stderr and "Traceback" not in done.stderr
        outcome.count("" if clear else f"{one[0]}: status {done.returncode}, {done.stderr.strip()[-200:]}")
        outcome.said = outcome.said or done.stderr.strip().splitlines()[-1].removeprefix("phalanx: ")
    return outcome


FAULTS = (
    Fault("mutated", "files of every kind, damaged by chance", 600, mutated),
    Fault("crafted", "takes, profiles, hands and networks made to do harm", 1000, crafted),
    Fault("pipes", "a pipe or a device file where a recording or a profile is expected", 6, pipes),
)
