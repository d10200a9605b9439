"""Records out of their JSON form."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from app.commands.result import plain, to_json
from app.restored import restored
from core.frames import FloatArray, IntArray


@dataclass(frozen=True)
class Part:
    kind: str
    value: float


@dataclass(frozen=True)
class Whole:
    path: Path
    share: float
    n: int
    parts: tuple[Part, ...] = ()
    by_name: Mapping[str, Part] = field(default_factory=dict)
    nested: dict[str, dict[str, float]] = field(default_factory=dict)
    maybe: Part | None = None
    seconds: FloatArray = field(default_factory=lambda: np.empty(0))
    frames: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))


def test_what_was_written_comes_back() -> None:
    whole = Whole(
        Path("a/b.c3d"), math.nan, 3, (Part("unit", 0.5), Part("side", math.nan)), {"left": Part("", 1.0)},
        {"x": {"y": 0.25}}, Part("one", 2.0), np.array([0.1, 0.2]), np.array([1, 2]),
    )  # fmt: skip
    found = restored(json.loads(to_json(plain(whole))), Whole)
    assert isinstance(found, Whole) and plain(found) == plain(whole)
    assert math.isnan(found.share) and math.isnan(found.parts[1].value) and found.parts[0] == Part("unit", 0.5)
    assert found.by_name == whole.by_name and found.maybe == whole.maybe and found.path == whole.path
    assert (found.seconds.dtype, found.frames.dtype) == (np.float64, np.int64)


@pytest.mark.parametrize(
    "said", [{"path": "a"}, {"path": "a", "share": "b", "n": 1}, [], None, {"path": 3, "share": 1, "n": 1}]
)
def test_what_is_no_such_record_is_refused(said: object) -> None:
    with pytest.raises((KeyError, TypeError, ValueError, AttributeError)):
        restored(said, Whole)
