"""packaging/bootstrap.sh where it cannot do its work: one clear message, nothing half-made."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.data import ROOT

PROGRAMS = ("cat", "cksum", "cut", "dirname", "env", "id", "printf", "rm", "sh", "sort", "tr", "uname", "pwd")

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="bootstrap.sh is for Linux")


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """A checkout's set-up files, and in `bin` all programs that this machine has."""
    for name in (
        "packaging/bootstrap.sh",
        "packaging/constraints.txt",
        "resources/system_libraries.txt",
        "pyproject.toml",
    ):
        target = tmp_path / name
        target.parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, target)
    programs = tmp_path / "bin"
    programs.mkdir()
    for name in PROGRAMS:
        found = shutil.which(name)
        if found:
            (programs / name).symlink_to(found)
    return tmp_path


def script(machine: Path, name: str, text: str) -> None:
    path = machine / "bin" / name
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


def bootstrap(machine: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["sh", str(machine / "packaging" / "bootstrap.sh")],
        env={"PATH": str(machine / "bin"), **environment},
        capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=60, check=False,
    )  # fmt: skip


def libraries(machine: Path, there: bool) -> None:
    """An ldconfig that lists every library, or none; and Xvfb and xauth accordingly."""
    lines = [line.split()[0] for line in (machine / "resources/system_libraries.txt").read_text().splitlines()]
    listed = "\n".join(f"\t{name} (libc6) => /lib/{name}" for name in lines if name.startswith("lib")) if there else ""
    script(machine, "ldconfig", f"printf '%s\\n' '{listed}'")
    if there:
        script(machine, "Xvfb", "exit 0")
        script(machine, "xauth", "exit 0")


def working_python(machine: Path) -> None:
    (machine / "bin" / "python3").symlink_to(sys.executable)


def test_python_too_old(machine: Path) -> None:
    script(machine, "python3", 'case $1 in --version) echo "Python 3.9.2" ;; *) exit 1 ;; esac')
    ran = bootstrap(machine)
    assert ran.returncode == 1
    (line,) = ran.stderr.splitlines()
    assert "Python 3.9.2" in line
    assert "3.11" in line
    assert not (machine / ".venv").exists()


def test_no_python(machine: Path) -> None:
    ran = bootstrap(machine, PYTHON="/no/such/python")
    assert ran.returncode == 1
    assert "needs Python 3.11" in ran.stderr
    assert len(ran.stderr.splitlines()) == 1


def test_libraries_missing_and_no_apt(machine: Path) -> None:
    working_python(machine)
    libraries(machine, there=False)
    ran = bootstrap(machine)
    assert ran.returncode == 1
    message = ran.stderr.splitlines()[-1]
    assert "no apt-get" in message
    for line in (ROOT / "resources" / "system_libraries.txt").read_text().splitlines():
        if not line.startswith("#"):
            assert line.split()[1] in message
    assert not (machine / ".venv").exists()


def test_libraries_missing_and_neither_root_nor_sudo(machine: Path) -> None:
    working_python(machine)
    libraries(machine, there=False)
    script(machine, "apt-get", "echo apt-get must not run >&2; exit 9")
    (machine / "bin" / "id").unlink()
    script(machine, "id", "echo 1000")
    ran = bootstrap(machine)
    assert ran.returncode == 1
    assert "Ask an administrator" in ran.stderr.splitlines()[-1]
    assert "must not run" not in ran.stderr


def test_missing_libraries_are_installed_by_sudo_where_one_is_not_root(machine: Path) -> None:
    working_python(machine)
    libraries(machine, there=True)
    (machine / "bin" / "Xvfb").unlink()
    script(machine, "apt-get", 'echo "$@" >>"$LOG"')
    script(machine, "sudo", 'echo sudo >>"$LOG"; exec "$@"')
    (machine / "bin" / "id").unlink()
    script(machine, "id", "echo 1000")
    log = machine / "log"
    ready(machine)
    ran = bootstrap(machine, LOG=str(log))
    assert ran.returncode == 0, ran.stderr
    commands = log.read_text().splitlines()
    assert commands[0::2] == ["sudo", "sudo"]
    assert commands[1].endswith("update")
    assert commands[3].endswith("install --no-install-recommends xvfb")


def test_everything_there_touches_nothing(machine: Path) -> None:
    working_python(machine)
    libraries(machine, there=True)
    script(machine, "apt-get", "exit 9")
    ready(machine)
    before = sorted((path, os.lstat(path).st_mtime_ns) for path in (machine / ".venv").rglob("*"))
    ran = bootstrap(machine)
    assert (ran.returncode, ran.stderr, ran.stdout) == (0, "", "")
    assert sorted((path, os.lstat(path).st_mtime_ns) for path in (machine / ".venv").rglob("*")) == before


def ready(machine: Path) -> None:
    """A .venv with the stamp that bootstrap.sh itself would leave."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(machine / ".venv")], check=True)
    shell = (machine / "packaging" / "bootstrap.sh").read_text()
    fingerprint = next(line for line in shell.splitlines() if line.startswith("fingerprint()"))
    stamp = subprocess.run(
        ["sh", "-c", f"VENV=.venv\n{fingerprint}\nfingerprint"], cwd=machine, capture_output=True, text=True, check=True
    ).stdout
    (machine / ".venv" / ".phalanx-stamp").write_text(stamp)
