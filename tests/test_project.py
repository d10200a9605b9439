"""The project itself: what is installed, what is pinned, what must not come in."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import PackageNotFoundError, distribution, requires, version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

from tests.data import ROOT
from tests.some import some

PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CONSTRAINTS = (ROOT / "packaging" / "constraints.txt").read_text(encoding="utf-8").splitlines()


def pins() -> dict[str, str]:
    lines = [line for line in CONSTRAINTS if line.strip() and not line.startswith("#")]
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.]+", line) for line in lines), lines
    names = [canonicalize_name(line.partition("==")[0]) for line in lines]
    assert len(set(names)) == len(names)
    return {name: line.partition("==")[2] for name, line in zip(names, lines, strict=True)}


def needed(extras: set[str]) -> set[str]:
    """Every distribution that Phalanx with `extras` brings into this environment."""
    project = PYPROJECT["project"]
    queue = [Requirement(text) for text in project["dependencies"]]
    for extra in extras:
        queue += [Requirement(text) for text in project["optional-dependencies"][extra]]
    found: set[str] = set()
    while queue:
        requirement = queue.pop()
        name = canonicalize_name(requirement.name)
        if name in found:
            continue
        found.add(name)
        for text in requires(name) or ():
            child = Requirement(text)
            environments = [{"extra": extra} for extra in requirement.extras] or [{"extra": ""}]
            if child.marker is None or any(child.marker.evaluate(environment) for environment in environments):
                queue.append(child)
    return found


def test_every_installed_package_is_pinned_at_its_version() -> None:
    pinned = pins()
    differing = {name: (version(name), pinned.get(name)) for name in needed({"dev"})}
    assert {name: pair for name, pair in differing.items() if pair[0] != pair[1]} == {}


def test_build_tools_and_training_are_pinned() -> None:
    pinned = pins()
    assert {"pip", "setuptools"} <= pinned.keys()
    for text in PYPROJECT["build-system"]["requires"] + PYPROJECT["project"]["optional-dependencies"]["train"]:
        requirement = Requirement(text)
        assert pinned[canonicalize_name(requirement.name)] in requirement.specifier


def test_pins_are_within_the_ranges_of_pyproject() -> None:
    pinned = pins()
    project = PYPROJECT["project"]
    for text in some(
        project["dependencies"] + [t for extra in project["optional-dependencies"].values() for t in extra]
    ):
        requirement = Requirement(text)
        assert requirement.specifier.contains(pinned[canonicalize_name(requirement.name)]), text


def test_pyside_versions_with_known_faults_are_shut_out() -> None:
    (qt,) = (r for t in PYPROJECT["project"]["dependencies"] if (r := Requirement(t)).name.startswith("PySide6"))
    assert qt.specifier == SpecifierSet(">=6.10.3,<6.12,!=6.11.0,!=6.11.1")
    assert pins()["pyside6-essentials"] == "6.11.3"


def test_nothing_names_a_package_host() -> None:
    acceptance = ROOT / "tests" / "acceptance"
    texts = [ROOT / "pyproject.toml", ROOT / "Makefile", *(ROOT / "packaging").glob("*.*"), *(ROOT / ".ci").iterdir()]
    texts += [acceptance / "package.json", acceptance / ".npmrc"]
    for path in texts:
        assert not re.search(r"https?://|--(extra-)?index-url|find-links", path.read_text(encoding="utf-8")), path
    assert not (ROOT / "uv.lock").exists() and not (acceptance / "package-lock.json").exists()


def test_a_wheel_holds_every_module_and_every_resource(tmp_path: Path) -> None:
    if int(version("setuptools").partition(".")[0]) < 77:
        pytest.skip("needs setuptools 77 in this environment (make setup)")
    packages = ("app", "core", "devices", "resources")
    source, wheels = tmp_path / "source", tmp_path / "wheels"
    for package in packages:
        shutil.copytree(ROOT / package, source / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", str(wheels), "."]
    subprocess.run(command, cwd=source, check=True, capture_output=True)
    (wheel,) = wheels.glob("*.whl")
    held = set(zipfile.ZipFile(wheel).namelist())
    sources = {str(path.relative_to(source)) for package in packages for path in (source / package).rglob("*.*")}
    assert {name for name in sources if not name.endswith(".pyc")} - held == set()


def test_version_of_the_installed_distribution() -> None:
    try:
        installed = distribution("phalanx")
    except PackageNotFoundError:
        pytest.skip("Phalanx is not installed here (make setup)")
    assert installed.version == PYPROJECT["project"]["version"]


def test_changelog_names_the_version_or_has_unreleased_changes() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(rf"^## \[(Unreleased|{re.escape(PYPROJECT['project']['version'])})\]", changelog, re.MULTILINE)


def test_shell_scripts_are_plain_sh_and_executable() -> None:
    for path in [*(ROOT / "packaging").glob("*.sh"), ROOT / ".ci" / "run"]:
        assert path.stat().st_mode & 0o111, path
        subprocess.run(["sh", "-n", str(path)], check=True)


COUNT_UPDATES = """
from PySide6.QtWidgets import QApplication, QWidget
application = QApplication([])
widget = QWidget()
for _ in range(20_000):
    widget.update()
    widget.isVisible(), widget.layout()
print("alive")
"""


def test_qt_counts_references_right() -> None:
    """PySide6 6.12.0 loses a reference to None per QWidget.update(): the interpreter aborts after about 5,000."""
    done = subprocess.run([sys.executable, "-c", COUNT_UPDATES], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "alive"), done.stderr[-2000:]
