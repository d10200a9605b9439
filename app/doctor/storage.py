"""Where takes and compiled kernels are written."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path

import platformdirs

from app.doctor.finding import Finding, good, problem, warning


def check_disk() -> list[Finding]:
    """Room for takes where they go by default."""
    from app.disk_room import free_text
    from core.takes.disk import LOW, RESERVE

    folder = takes_folder()
    existing = next(path for path in (folder, *folder.parents) if path.exists())
    free = shutil.disk_usage(existing).free
    text = f"{free_text(free)} free at {folder}"
    if not os.access(existing, os.W_OK):
        return [problem("Disk", f"{existing} may not be written.", "Choose another folder for takes.")]
    action = "Make room, or choose another folder for takes."
    if free < RESERVE:
        return [problem("Disk", text + ": recording will not start.", action)]
    if free < LOW:
        return [warning("Disk", text + ".", action)]
    return [good("Disk", text)]


def takes_folder() -> Path:
    """Where the recorder puts takes."""
    from app.settings import TAKE_FOLDER, Settings, default_path
    from app.take_plan import default_folder

    return Path(Settings(default_path()).get(TAKE_FOLDER, str(default_folder())))


def check_kernel_cache() -> list[Finding]:
    """Whether compiled kernels can be kept; without, every start compiles for some ten seconds."""
    import core.kinematics

    folders = [os.environ.get("NUMBA_CACHE_DIR"), *core.kinematics.__path__, str(platformdirs.user_cache_path("numba"))]
    for folder in folders:
        if folder and _writable(Path(folder)):
            return [good("Kernel cache", folder)]
    return [
        warning(
            "Kernel cache",
            "no folder for compiled kernels can be written: every start takes about 15 s longer.",
            "Set NUMBA_CACHE_DIR to a folder that you may write.",
        )
    ]


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
