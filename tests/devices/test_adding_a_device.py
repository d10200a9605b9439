"""The device that docs/adding-a-device.md shows, as it stands on the page, does what is asked of every kind."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from core.errors import FormatError
from tests.data import ROOT
from tests.devices.conformance import CHECKS, SERVED, Kind
from tests.some import some

PAGE = (ROOT / "docs" / "adding-a-device.md").read_text(encoding="utf-8")


def _of_the_page() -> dict[str, Any]:
    """What its Python defines: the device, and how a test makes one."""
    module = ModuleType("adding_a_device")
    device, kind = re.findall(r"^```python\n(.*?)^```$", PAGE, flags=re.DOTALL | re.MULTILINE)
    for text in (device, kind):
        exec(compile(text, module.__name__, "exec", dont_inherit=True), module.__dict__)
    return module.__dict__


NAMES = _of_the_page()


@pytest.mark.parametrize("check", CHECKS + SERVED, ids=lambda check: check.__name__.removeprefix("check_"))
def test_contract(check: Callable[[Kind], None], tmp_path: Path) -> None:
    with NAMES["TextPoints"](tmp_path) as kind:
        check(kind)


def test_lines_are_read_as_the_page_says() -> None:
    frame = NAMES["decode_points"](b"7 0.25 0 1 0.5 0.1 1 0.5\n", 9.0)
    assert (frame.sequence, frame.times.device_s, frame.times.arrival_s) == (7, 0.25, 9.0)
    assert frame.points_m.tolist() == [[0, 1, 0.5], [0.1, 1, 0.5]]
    for packet in (b"", b"7", b"7 0.25 1 2", b"7 inf 1 2 3", b"7 0 1 2 1e999", b"9" * 400 + b" 0 1 2 3", b"\xff"):
        with pytest.raises(FormatError):
            NAMES["decode_points"](packet, 9.0)


def test_the_page_names_every_check() -> None:
    table = PAGE[PAGE.index("## What the suite asks") :]
    rows = {row.split("|")[1].split("(")[0].strip() for row in table.splitlines() if row.startswith("| ")}
    for check in some(CHECKS + SERVED):
        words = check.__name__.removeprefix("check_").replace("_", " ")
        assert words in rows or words.replace("what is ", "") in rows, words
