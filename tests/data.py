"""Where tests find recordings that are not part of the project."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
DATA = Path(os.environ.get("PHALANX_DATA", ROOT.parent / "shared" / "data"))
CASES = Path(os.environ.get("PHALANX_CASES", ROOT.parent / "shared" / "cases"))


def data_path(*parts: str) -> Path:
    """A file or folder of the recordings; the test is skipped where it is absent."""
    path = DATA.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"needs the recording {'/'.join(parts)} (set PHALANX_DATA to the folder that holds it)")
    return path


def case_path(*parts: str) -> Path:
    """A file or folder of the collected cases; the test is skipped where it is absent."""
    path = CASES.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"needs the case {'/'.join(parts)} (set PHALANX_CASES to the folder that holds it)")
    return path
