"""Python and its packages: present, in the allowed range, at the tested version."""

from __future__ import annotations

import re
import sys
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from app.doctor.finding import Finding, good, problem, warning

PYTHON_RANGE = ((3, 11), (3, 14))
CONSTRAINTS = Path(__file__).parents[2] / "packaging" / "constraints.txt"
_INSTALL = "Run `make setup`, or: python -m pip install --upgrade phalanx."
_PYSIDE_WITH_FAULTS = ("6.11.0", "6.11.1", "6.12")


def check_python() -> list[Finding]:
    """The version of Python."""
    low, high = PYTHON_RANGE
    found = ".".join(map(str, sys.version_info[:3]))
    if low <= sys.version_info[:2] < high:
        return [good("Python", f"{found} ({sys.executable})")]
    return [problem("Python", f"{found}; 3.11 to 3.13 are supported.", "Install Python 3.12 and make .venv anew.")]


def check_packages() -> list[Finding]:
    """What Phalanx needs beside Python: installed, and at the version it is tested with."""
    try:
        needed = requires("phalanx") or []
    except PackageNotFoundError:
        return [problem("Packages", "Phalanx is not installed in this environment.", _INSTALL)]
    tested = tested_versions()
    missing, other = [], []
    names = [_name(text) for text in needed if "extra ==" not in text]
    for name in names:
        try:
            installed = version(name)
        except PackageNotFoundError:
            missing.append(name)
            continue
        if name == "pyside6-essentials" and installed.startswith(_PYSIDE_WITH_FAULTS):
            return [
                problem(
                    "Packages",
                    f"PySide6 {installed} has faults that end the application.",
                    "Run: python -m pip install 'PySide6-Essentials==6.11.3'.",
                )
            ]
        if tested.get(name, installed) != installed:
            other.append(f"{name} {installed} (tested with {tested[name]})")
    if missing:
        return [problem("Packages", "missing: " + ", ".join(missing) + ".", _INSTALL)]
    if other:
        return [warning("Packages", "other versions than tested: " + ", ".join(other) + ".", _INSTALL)]
    return [good("Packages", f"all {len(names)} installed" + (", at the tested versions" if tested else ""))]


def tested_versions() -> dict[str, str]:
    """Package to version, as pinned in a checkout; empty where Phalanx was installed without one."""
    if not CONSTRAINTS.exists():
        return {}
    lines = CONSTRAINTS.read_text(encoding="utf-8").splitlines()
    return {_name(line): line.partition("==")[2] for line in lines if "==" in line and not line.startswith("#")}


def _name(requirement: str) -> str:
    match = re.match(r"[A-Za-z0-9._-]+", requirement)
    return re.sub(r"[-_.]+", "-", match[0]).lower() if match else ""
