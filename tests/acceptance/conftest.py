"""Takes and their exports, made once a session and only if a program is there to open them; and the report.

These tests run by `make acceptance`, which installs the programs; in other runs they are skipped.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from core.takes.export import export
from core.takes.export.options import DEFAULT, ExportOptions
from tests.acceptance.programs import Opened, Program
from tests.acceptance.report import Row, markdown, write_into
from tests.acceptance.takes import KINDS, Taken, taken

ASKED_FOR = "PHALANX_ACCEPTANCE"
"""Set by `make acceptance`."""

TABLE_INTO = "PHALANX_TABLE_INTO"
"""The document to write the table of what was opened where into."""

_ROWS: list[Row] = []
_ABSENT: set[str] = set()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if ASKED_FOR not in os.environ:
        skip = pytest.mark.skip(reason="opens exports in other programs: make acceptance")
        for item in items:
            if Path(__file__).parent in item.path.parents and "bench" in getattr(item, "fixturenames", ()):
                item.add_marker(skip)


@dataclass
class Bench:
    """Every kind of take, exported on demand; every program opens all files of a format in one go."""

    folder: Path
    _taken: dict[str, Taken] = field(default_factory=dict)
    _files: dict[tuple[str, str, ExportOptions], list[Path]] = field(default_factory=dict)
    _opened: dict[tuple[str, str, ExportOptions], Opened] = field(default_factory=dict)

    def taken(self, kind: str) -> Taken:
        """A take of this kind."""
        if kind not in self._taken:
            self._taken[kind] = taken(KINDS[kind], self.folder)
        return self._taken[kind]

    def files(self, kind: str, name: str, options: ExportOptions = DEFAULT) -> list[Path]:
        """Its export to one format."""
        key = (kind, name, options)
        if key not in self._files:
            folder = self.folder / f"{len(self._files)}"
            self._files[key] = export(self.taken(kind).solution, [name], folder, options=options)
        return self._files[key]

    def file(self, kind: str, name: str, options: ExportOptions = DEFAULT) -> Path:
        """The one file of a format that has one; tables of holes and marks beside it aside."""
        (path,) = [
            path
            for path in self.files(kind, name, options)
            if path.suffix == (".glb" if name == "gltf" else f".{name}")
        ]
        return path

    def open(self, program: Program, name: str, options: ExportOptions = DEFAULT) -> Opened:
        """All kinds of takes in one format, as a program finds them. Skips the test where it is not installed."""
        key = (program.reader, name, options)
        if key not in self._opened:
            files = [path for kind in KINDS for path in self.files(kind, name, options)] if program.runner else []
            self._opened[key] = self.open_files(program, [p for p in files if p.suffix == program.suffix], self.folder)
        return self._opened[key]

    def open_files(self, program: Program, files: Sequence[Path], folder: Path) -> Opened:
        """These files. Skips the test where the program is not installed."""
        if program.runner is None:
            _ABSENT.add(program.name)
            pytest.skip(f"{program.name} is not installed here")
        return program.open(files, folder)


@pytest.fixture(scope="session")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Bench(tmp_path_factory.mktemp("acceptance"))


@pytest.fixture
def report() -> Callable[[Row], None]:
    """Takes down what was compared."""
    return _ROWS.append


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, exitstatus: int) -> None:
    if not _ROWS:
        return
    table = markdown(_ROWS, _ABSENT)
    terminalreporter.section("opened where")
    terminalreporter.write(table)
    document = os.environ.get(TABLE_INTO)
    if document and exitstatus == 0:  # a table is of files that were found right
        write_into(Path(document), table)
