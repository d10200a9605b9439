"""What every test of Phalanx relies on: a display, and settings and caches that are not the user's own."""

from __future__ import annotations

import locale
import os
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

# Before numpy: small matrices are slower on several BLAS threads, and the machine has other work.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import hypothesis
import pytest

from app.virtual_display import has_display, virtual_display
from tests import unchanged

EXPERIMENTS = (
    "test_bench_angles.py",
    "test_bench_gaps.py",
    "test_bench_labels.py",
    "test_bench_props.py",
    "test_bench_tracking.py",
    "test_certainty_bench.py",
    "test_reconstruction.py",
    "test_reconstruction_calibration.py",
    "test_relabel_bench.py",
)

_session = ExitStack()
_display = ExitStack()
"""Never closed: Qt looks at its display until the process has ended, and a display that went first would make every
test that passed a failure. It ends with its process."""


def pytest_configure(config: pytest.Config) -> None:
    """Windows of tests open on a virtual display where there is none; settings and takes go to a folder of this run."""
    hypothesis.settings.register_profile("phalanx", deadline=None)  # no test asserts on seconds
    hypothesis.settings.load_profile("phalanx")
    locale.setlocale(locale.LC_ALL, "")  # as Qt does with the first application of a process
    if not has_display():
        _display.enter_context(virtual_display())
    home = _session.enter_context(tempfile.TemporaryDirectory(prefix="phalanx-tests-"))
    for variable in ("XDG_CONFIG_HOME", "XDG_STATE_HOME", "XDG_DATA_HOME"):
        os.environ[variable] = f"{home}/{variable.lower()}"
    config_home = Path(os.environ["XDG_CONFIG_HOME"])
    config_home.mkdir()
    (config_home / "user-dirs.dirs").write_text(f'XDG_DOCUMENTS_DIR="{home}/documents"\n')


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes long waits to be asked for: tests that are marked, and the experiments of `phalanx bench`."""
    if os.environ.get("PHALANX_LONG"):
        return
    for item in items:
        if item.get_closest_marker("long") or item.path.name in EXPERIMENTS:
            item.add_marker(pytest.mark.skip(reason="takes long: make test LONG=1"))


def pytest_unconfigure(config: pytest.Config) -> None:
    """Removes the folder of this run."""
    _session.close()


@pytest.fixture(autouse=True)
def nothing_is_left_behind() -> Iterator[None]:
    """Display, folder, signals and other things of the whole process are after each test what they were before it."""
    before = unchanged.now()
    yield
    if changed := unchanged.put_back(before):
        pytest.fail("left behind for the tests that follow: " + "; ".join(changed), pytrace=False)
