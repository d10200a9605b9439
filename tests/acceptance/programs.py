"""The programs that open our files, each in a process of its own; and where each is looked for."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.data import ROOT

READERS = Path(__file__).parent / "readers"
MODULES = Path(__file__).parent / "node_modules"
BLENDER = ROOT / ".venv-blender" / "bin" / "python"
"""Blender as a module asks for a numpy older than Phalanx's, so it has an environment of its own."""

_SLOWEST_S = 300.0


@dataclass(frozen=True)
class Program:
    """reader: its script in `readers`. needs: the module of Python, or the package of Node, that must be there. suffix:
    of the files it opens."""

    name: str
    reader: str
    needs: str
    suffix: str

    @property
    def runner(self) -> str | None:
        """What runs the reader; None where it or the program is not there."""
        if self.reader.endswith(".mjs"):
            return shutil.which("node") if (MODULES / self.needs).is_dir() else None
        if self.needs == "bpy":
            return str(BLENDER) if BLENDER.exists() else None
        return sys.executable if importlib.util.find_spec(self.needs) else None

    def open(self, files: Sequence[Path], folder: Path) -> Opened:
        """Opens the files with an installed program. Fails where the program itself does."""
        runner = self.runner
        assert runner is not None, f"{self.name} is not installed"
        out = folder / f"{self.reader}.json"
        done = subprocess.run(
            [runner, str(READERS / self.reader), str(out), *map(str, files)],
            capture_output=True, text=True, timeout=_SLOWEST_S, check=False,
            env={**os.environ, "PYTHONPATH": "", "MPLBACKEND": "Agg", "QT_QPA_PLATFORM": "offscreen"},
        )  # fmt: skip
        said = (done.stdout + done.stderr)[-4000:]
        assert done.returncode == 0, f"{self.name} ended with {done.returncode}:\n{said}"
        told = json.loads(out.read_text(encoding="utf-8"))
        return Opened(f"{told['program']} {told['version']}", told["files"], said)


@dataclass(frozen=True)
class Opened:
    """What a program found. files: by path. said: what it wrote while it read."""

    program: str
    files: dict[str, Any]
    said: str

    def file(self, path: Path) -> dict[str, Any]:
        """One file; fails with what the program has against it."""
        found: dict[str, Any] = self.files[str(path)]
        assert "error" not in found, f"{self.program} does not open {path.name}: {found['error']}"
        return found


EZC3D = Program("ezc3d", "c3d_ezc3d.py", "ezc3d", ".c3d")
PY_C3D = Program("py-c3d", "c3d_py_c3d.py", "c3d", ".c3d")
KINETICS = Program("Kinetics Toolkit", "c3d_kineticstoolkit.py", "kineticstoolkit", ".c3d")
OPENSIM = Program("OpenSim", "trc_opensim.py", "opensim", ".trc")
TRC_PANDAS = Program("pandas", "trc_pandas.py", "pandas", ".trc")
BVH_BLENDER = Program("Blender", "bvh_blender.py", "bpy", ".bvh")
BVH_THREE = Program("three.js", "bvh_three.mjs", "three", ".bvh")
VALIDATOR = Program("glTF Validator", "gltf_validator.mjs", "gltf-validator", ".glb")
GLTF_THREE = Program("three.js", "gltf_three.mjs", "three", ".glb")
GLTF_BLENDER = Program("Blender", "gltf_blender.py", "bpy", ".glb")
CSV_PANDAS = Program("pandas", "csv_pandas.py", "pandas", ".csv")
