"""Whether windows open here, and what draws the 3D view."""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess
import sys
from contextlib import nullcontext
from importlib.resources import files

from app.doctor.finding import Finding, good, problem, warning
from app.virtual_display import has_display, virtual_display

_TIMEOUT_S = 60.0

# In a process of its own: a missing library makes Qt abort, not raise.
_PROBE = """
import json, platform
from PySide6 import __version__
from PySide6.QtGui import QGuiApplication
application = QGuiApplication([])
from app.viewport.gl_support import gl_support
support = gl_support()
screen = application.primaryScreen()
size = f"{screen.size().width()} x {screen.size().height()}" if screen else "no screen"
print(json.dumps([__version__, application.platformName(), size, support.renderer, support.software, support.reason]))
"""


def check_libraries() -> list[Finding]:
    """Shared libraries and programs of the system (Linux)."""
    if not sys.platform.startswith("linux"):
        return []
    missing = missing_packages()
    if not missing:
        return [good("System libraries", "all there")]
    packages = " ".join(missing)
    return [
        problem(
            "System libraries",
            f"missing what {packages} bring.",
            f"Run: sudo apt-get install --no-install-recommends {packages} (or your system's equivalents).",
        )
    ]


def missing_packages() -> list[str]:
    """Debian packages whose library or program is not found, by resources/system_libraries.txt."""
    missing = []
    for line in (files("resources") / "system_libraries.txt").read_text(encoding="utf-8").splitlines():
        part, _, package = line.partition(" ")
        if not part or part == "#":
            continue
        if not (shutil.which(part[1:]) if part.startswith("/") else _loads(part)):
            missing.append(package)
    return missing


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def check_screen() -> list[Finding]:
    """Opens Qt, here or on a virtual display, and asks what draws."""
    here = has_display()
    if not here and shutil.which("Xvfb") is None:
        return [problem("Display", "none, and no Xvfb.", "Work at a desktop, or: sudo apt-get install xvfb xauth.")]
    with nullcontext() if here else virtual_display():
        done = subprocess.run(
            [sys.executable, "-c", _PROBE],
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_S,
            check=False,
        )
    if done.returncode != 0:
        reason = (done.stderr.strip().splitlines() or [f"exit {done.returncode}"])[-1]
        return [problem("Display", f"Qt does not start: {reason}", "Install the system libraries named above.")]
    version, platform, size, renderer, software, reason = json.loads(done.stdout.splitlines()[-1])
    where = "" if here else "; no display of its own, a virtual one serves"
    findings = [good("Display", f"Qt {version} on {platform}, {size}{where}")]
    if reason:
        findings.append(warning("3D view", "none; everything else works.", reason))
    elif software:
        text = f"{renderer}: the processor draws, at most 30 frames/s."
        findings.append(warning("3D view", text, "Install the driver of the graphics card, if there is one."))
    else:
        findings.append(good("3D view", renderer))
    return findings
