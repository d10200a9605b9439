"""Whatever reads a file or a packet is in the list of readers, or is said here not to read what others made."""

from __future__ import annotations

import ast
import importlib
import inspect
from collections.abc import Iterator

from core.takes.formats import detect
from tests.data import ROOT
from tests.fuzz.readers import READERS

COVERED = {name for reader in READERS for name in reader.covers}

BEGINNINGS = {"read_bytes", "read_text", "read_json", "read_npz", "open_file", "FileIO", "ZipFile", "mmap"}
"""What brings the bytes of a file in, by the name of what is called; with `open` unless it writes, and np.load."""

OURS = "lies within Phalanx"
JUST_WRITTEN = "reads back what was written a moment ago"
EXPERIMENT = "data of an experiment, named on its command line by who runs it"
HASHED = "is only hashed"
ONE_PLACE = "is the one place through which the others open"

ELSEWHERE = {
    "app.doctor.packages": OURS,
    "app.doctor.screen": OURS,
    "app.bench.sequences": EXPERIMENT,
    "app.label_bench.clouds": EXPERIMENT,
    "app.reconstruction.han_shapes": EXPERIMENT,
    "app.reconstruction.motions": EXPERIMENT,
    "app.tracking_bench.han": EXPERIMENT,
    "core.takes.made": HASHED,
    "core.training.labeller._before": "needs PyTorch; whatever is wrong with a card, it is said to be none",
    "app.left_behind.dialog._copy": "copies a text for the operator, as it is",
    "app.process_memory.memory_of": "is told by the system",
    "core.takes.record_file.RecordFile.__init__": "writes",
    "core.untrusted": ONE_PLACE,
    "core.hand.model": OURS,
    "core.hand.sizes": OURS,
    "core.motion.subspace.shipped_subspace": OURS,
    "core.motion.library": OURS,
    "core.takes.export.csv_tables": JUST_WRITTEN,
    "core.takes.export.c3d": JUST_WRITTEN,
    "core.takes.export.held_csv": JUST_WRITTEN,
    "core.takes.export.marks_csv": JUST_WRITTEN,
    "core.takes.export.holes_csv": JUST_WRITTEN,
    "core.takes.export.record.write_record": JUST_WRITTEN,
}
"""Modules and functions that open something else, and what."""


def _reads(call: ast.Call) -> bool:
    """Whether a call brings in the bytes of a file."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    if name == "open":
        words = [*call.args, *(keyword.value for keyword in call.keywords if keyword.arg == "mode")]
        modes = {word.value for word in words if isinstance(word, ast.Constant) and isinstance(word.value, str)}
        takes_path = isinstance(call.func, ast.Name) or bool(modes) or bool(call.keywords)
        return takes_path and not any(set("wax") & set(mode) and len(mode) <= 3 for mode in modes)
    if name == "load":
        return isinstance(call.func, ast.Attribute) and getattr(call.func.value, "id", "") == "np"
    return name in BEGINNINGS


def _functions(tree: ast.AST, name: str) -> Iterator[tuple[str, ast.AST]]:
    """Every function and method, with its name, and the module itself."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield from _functions(node, f"{name}.{node.name}")
    yield name, tree


def _opening() -> set[str]:
    """The functions that bring in the bytes of a file, by module and name."""
    found = set()
    for package in ("app", "core", "devices"):
        for path in sorted((ROOT / package).rglob("*.py")):
            module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
            calls: set[ast.AST] = set()
            for name, node in _functions(ast.parse(path.read_text(encoding="utf-8")), module):
                own = {call for call in ast.walk(node) if isinstance(call, ast.Call) and _reads(call)} - calls
                calls |= own
                if own:
                    found.add(name)
    return found


def test_every_function_that_opens_a_file_is_tried_or_said_to_read_none_of_others() -> None:
    opening = _opening()
    assert len(opening) > 20  # else nothing was looked for
    said = {name for name in opening if any(name == one or name.startswith(f"{one}.") for one in ELSEWHERE)}
    assert opening - said - COVERED == set(), "put it into tests/fuzz/readers.py, or say here what else it reads"
    assert {one for one in ELSEWHERE if not any(name == one or name.startswith(f"{one}.") for name in opening)} == set()


def test_every_format_of_recordings_is_tried() -> None:
    formats = {f"{reader.__module__}.{reader.__name__}" for reader in detect.TITLES}
    assert len(formats) >= 7
    assert formats - COVERED == set()


def test_every_decoder_of_a_device_is_tried() -> None:
    decoders = set()
    for path in (ROOT / "devices").rglob("*.py"):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        module = importlib.import_module(name)
        decoders |= {
            f"{name}.{one}"
            for one, made in vars(module).items()
            if one.startswith("decode_") and inspect.isfunction(made) and made.__module__ == name
        }
    assert len(decoders) >= 10
    assert decoders - COVERED == set()


def test_what_is_said_to_be_tried_is_there() -> None:
    for name in COVERED:
        parts = name.split(".")
        at = next(i for i in range(len(parts), 0, -1) if (ROOT / "/".join(parts[:i])).with_suffix(".py").is_file())
        found: object = importlib.import_module(".".join(parts[:at]))
        for part in parts[at:]:
            found = getattr(found, part)
