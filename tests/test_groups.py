"""`make test` runs every test once, whatever groups it is cut into."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from tests.data import ROOT
from tests.some import some


@pytest.fixture(scope="module")
def runner() -> ModuleType:
    spec = importlib.util.spec_from_file_location("run_tests", ROOT / "packaging" / "run_tests.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["run_tests"] = module
    spec.loader.exec_module(module)
    return module


def test_every_file_of_tests_is_in_one_group(runner: ModuleType) -> None:
    taken: set[Path] = set()
    groups = [*runner.files_of(runner.ALONE, taken).values(), *runner.files_of(runner.BESIDE, taken).values()]
    files = [file for group in groups for file in group]
    there = {str(file.relative_to(ROOT)) for file in (ROOT / "tests").rglob("test_*.py")}
    assert len(files) == len(set(files)) > 200
    assert there == set(files)


@pytest.mark.parametrize("name", ["ALONE", "BESIDE", "CHECK"])
def test_every_pattern_finds_tests(runner: ModuleType, name: str) -> None:
    for patterns in some(getattr(runner, name).values()):
        for pattern in some(patterns):
            assert any(file.name.startswith("test_") for file in ROOT.glob(pattern)), pattern


def made(folder: Path, **bodies: str) -> None:
    for name, body in bodies.items():
        path = folder / "tests" / name / f"test_{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(body, encoding="utf-8")


def test_a_group_that_fails_fails_all_and_the_others_are_run(runner: ModuleType, tmp_path: Path, capfd) -> None:
    made(tmp_path, good="def test_it(): pass", bad="def test_it(): assert 1 == 2", last="def test_it(): pass")
    runner.ROOT = tmp_path
    try:
        groups = runner.files_of({"good": ("tests/good/*",), "bad": ("tests/bad/*",)}, set())
        ended = runner.run_beside(groups, 2, [], tmp_path / "cache")
        assert ended == {"bad": 1}
        alone = runner.files_of({"last": ("tests/last/*",)}, set())
        assert runner.run_alone(alone, [], tmp_path / "cache") == {}
        assert not runner.run_again(ended, [], tmp_path / "cache")
    finally:
        runner.ROOT = ROOT
    told = capfd.readouterr().out
    assert told.count("- assert 1 == 2") == 2 and told.count("1 passed") == 2
    last = told.rstrip().splitlines()[-2:]
    assert last == ["tests that failed: pytest ended with 1", "  tests.bad.test_bad::test_it: assert 1 == 2"]


ONCE = """
from pathlib import Path
def test_it():
    was = Path(__file__).with_suffix(".was")
    if not was.exists():
        was.touch()
        raise AssertionError
"""


def ran_twice(runner: ModuleType, folder: Path, bodies: dict[str, str]) -> tuple[dict[str, int], bool]:
    """How groups of one file each ended, and whether they pass when run again."""
    made(folder, **bodies)
    runner.ROOT = folder
    groups = {name: [f"tests/{name}/test_{name}.py"] for name in bodies}
    try:
        ended = runner.run_beside(groups, 1, [], folder / "cache")
        return ended, runner.run_again(ended, [], folder / "cache")
    finally:
        runner.ROOT = ROOT


def test_what_fails_only_beside_others_is_named(runner: ModuleType, tmp_path: Path, capfd) -> None:
    assert ran_twice(runner, tmp_path, {"once": ONCE}) == ({"once": 1}, True)
    told = capfd.readouterr().out
    assert "passed when run again alone:\n  tests/once/test_once.py::test_it\n" in told
    assert told.rstrip().endswith("once: pytest ended with 1\n  tests.once.test_once::test_it: AssertionError")


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ("import os\ndef test_it(): assert False\ndef test_dies(): os._exit(77)", 77),
        ("import nothing_that_is_there", 2),
        ("\n".join(f"def test_{i}(): assert False" for i in range(13)), 1),
        ("", 5),
    ],
)
def test_a_process_that_breaks_down_and_many_failures_stay_failures(
    runner: ModuleType, tmp_path: Path, capfd, body: str, status: int
) -> None:
    assert ran_twice(runner, tmp_path, {"broken": body}) == ({"broken": status}, False)
    told = capfd.readouterr().out
    assert "once more" not in told and told.count(f"broken: pytest ended with {status}") == 1


def test_a_process_that_fails_after_its_tests_have_passed_has_failed(runner: ModuleType, tmp_path: Path, capfd) -> None:
    late = "import atexit, os\ndef test_it(): atexit.register(os._exit, 1)"
    assert ran_twice(runner, tmp_path, {"late": late}) == ({"late": 1}, False)
    told = capfd.readouterr().out
    assert "once more" not in told and told.rstrip().endswith("late: pytest ended with 1")


def test_tests_hear_ctrl_c_and_a_terminal_that_closes(tmp_path: Path) -> None:
    """What a shell begins in the background, or with nohup, does not, and commands are tried with both."""
    made(
        tmp_path,
        heard="import signal\n"
        "def test_it():\n"
        "    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler\n"
        "    assert signal.getsignal(signal.SIGHUP) is signal.SIG_DFL",
    )
    script = (
        "import signal, sys\nfrom pathlib import Path\n"
        "signal.signal(signal.SIGINT, signal.SIG_IGN)\nsignal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        f"sys.path.insert(0, {str(ROOT / 'packaging')!r})\nimport run_tests\nrun_tests.ROOT = Path({str(tmp_path)!r})\n"
        "groups = {'heard': ['tests/heard/test_heard.py']}\n"
        f"assert not run_tests.run_beside(groups, 1, [], Path({str(tmp_path / 'a')!r}))\n"
        f"assert not run_tests.run_alone(groups, [], Path({str(tmp_path / 'b')!r}))\n"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert ran.returncode == 0 and ran.stdout.count("1 passed") == 2, ran.stdout + ran.stderr


def test_check_runs_some_of_the_tests(runner: ModuleType) -> None:
    checked = {file for files in runner.files_of(runner.CHECK, set()).values() for file in files}
    assert 20 < len(checked) < 150


def test_the_runner_says_what_it_takes() -> None:
    command = [sys.executable, str(ROOT / "packaging" / "run_tests.py"), "--help"]
    assert "--check" in subprocess.run(command, capture_output=True, text=True, check=True).stdout
