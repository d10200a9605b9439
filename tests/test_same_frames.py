"""`packaging/same_frames.py`: what is the same, what is not and where, and what cannot be told; in real processes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from core.profile import load_profile
from core.takes.formats.points_csv import HEADER
from tests.app.stage import performance

SCRIPT = Path(__file__).resolve().parent.parent / "packaging" / "same_frames.py"

STUBS = {
    "app/labels.py": "def cast_labels(recording, cast): return None",
    "app/tracking_figures.py": "def frames_and_columns(recording, unlabelled): return list(range(3)), None",
    "core/gap_filling.py": "def filled(frames, cast): return frames",
    "core/profile.py": "def load_profile(name): return name",
    "core/takes/formats/__init__.py": "def read_recording(path): return None",
    "core/takes/formats/take.py": "def is_take(path): return False",
    "core/takes/reader.py": "open_take = None",
    "core/takes/reprocess.py": "from core.frame import frame\nrelabelled = None\n"
    "def solve_each(raw, cast, labels): return [(i, frame(i)) for i in raw]",
}
"""A checkout with as much as the script asks of one, whose engine is `core/frame.py`."""

FRAME = """
from dataclasses import dataclass, field
from enum import Enum
import numpy as np

class State(Enum):
    TRACKED = "tracked"

@dataclass(frozen=True)
class Hand:
    state: State
    theta_rad: np.ndarray
    rms_m: float = float("nan"){field}

@dataclass(frozen=True)
class Frame:
    sequence: int
    hands: tuple
    stage_s: dict = field(default_factory=dict)

def frame(i):
    import time
    return Frame(i, (Hand(State.TRACKED, np.arange(3.0) + {add}),) * {hands}, {{"solve": time.perf_counter()}})
"""


@pytest.fixture
def checkout(tmp_path: Path):
    def make(
        name: str, add: str = "0.1", hands: str = "2", field: str = "", instead: tuple[str, str] | None = None
    ) -> Path:
        for path, text in (*STUBS.items(), *((instead,) if instead else ())):
            target = tmp_path / name / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8")
        (tmp_path / name / "core" / "frame.py").write_text(FRAME.format(add=add, hands=hands, field=field), "utf-8")
        return tmp_path / name

    return make


def told(this: Path, other: Path, recording: Path, *more: str) -> tuple[int, str]:
    command = [sys.executable, str(SCRIPT), str(other), str(recording), "--this", str(this), *more]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    return done.returncode, done.stdout + done.stderr


def test_what_is_the_same_is_said_with_fields_that_are_new(checkout) -> None:
    old, new = checkout("old"), checkout("new", field='\n    held_by: str = "points"')
    status, said = told(new, old, Path("a.trc"), "--profile", "p")
    assert status == 0 and "a.trc: 3 frames, solved and filled, are the same" in said
    assert f"only in {new}: hands[].held_by." in said and "only in {old}" not in said


def test_the_first_difference_is_named_to_the_last_bit(checkout) -> None:
    one, other = checkout("one"), checkout("other", add="0.1 + (1e-16 if i == 2 else 0.0)")
    status, said = told(one, other, Path("a.trc"), "--profile", "p")
    assert status == 1 and "DIFFERENT in frame 2 as solved, hands[0].theta_rad:" in said
    assert "\n  [0.1 1.1 2.1]\n  [0.1000000000000001 " in said
    status, said = told(one, checkout("fewer", hands="1"), Path("a.trc"), "--profile", "p")
    assert status == 1 and "len(hands):\n  2\n  1" in said


def test_one_with_fewer_frames_is_different_and_one_that_fails_is_said(checkout) -> None:
    one = checkout("one")
    fewer = checkout("fewer", instead=("core/gap_filling.py", "def filled(frames, cast): return list(frames)[:1]"))
    assert told(one, fewer, Path("a.trc"), "--profile", "p")[0] == 1
    broken = checkout("broken", instead=("core/profile.py", "def load_profile(name): raise SystemExit('No glove.')"))
    status, said = told(one, broken, Path("a.trc"), "--profile", "p")
    assert status == 2 and f"{broken} could not solve it" in said and "No glove." in said
    status, said = told(one, one, Path("a.trc"))
    assert status == 2 and "give --profile" in said


def test_a_real_recording_is_the_same_in_this_checkout(tmp_path: Path) -> None:
    path, profile = tmp_path / "points.csv", tmp_path / "profile.json"
    rows = [
        f"{i},{i / 120},{id_},{x!r},{y!r},{z!r}"
        for i, frame in enumerate(performance()[:12])
        for id_, (x, y, z) in zip(frame.ids.tolist(), frame.points_m.tolist(), strict=True)
    ]
    path.write_text("\n".join([HEADER, *rows]), encoding="utf-8")
    profile.write_text(load_profile("han19").to_json(), encoding="utf-8")
    status, said = told(SCRIPT.parent.parent, SCRIPT.parent.parent, path, "--profile", str(profile), "--frames", "8")
    assert (status, said) == (0, "points.csv: 8 frames, solved and filled, are the same.\n")
