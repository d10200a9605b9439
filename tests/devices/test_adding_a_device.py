"""The device that docs/adding-a-device.md shows, as it stands on the page, does what is asked of every kind."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from core.errors import FormatError
from tests.data import ROOT
from tests.devices import conformance
from tests.devices.conformance import CHECKS, SERVED, Kind
from tests.some import some

IMPORT = "from devices.textpoints import TextPointsDevice\n"
PAGE = (ROOT / "docs" / "adding-a-device.md").read_text(encoding="utf-8")


def _of_the_page(find: str = "", put: str = "") -> dict[str, Any]:
    """What its Python defines: the device, with a fault put into it, and how a test makes one."""
    module = ModuleType("adding_a_device")
    device, kind = re.findall(r"^```python\n(.*?)^```$", PAGE, flags=re.DOTALL | re.MULTILINE)
    assert find in device
    for text in (device.replace(find, put, 1), kind.replace(IMPORT, "")):
        exec(compile(text, module.__name__, "exec", dont_inherit=True), module.__dict__)
    return module.__dict__


NAMES = _of_the_page()


@pytest.mark.parametrize("check", CHECKS + SERVED, ids=lambda check: check.__name__.removeprefix("check_"))
def test_contract(check: Callable[[Kind], None], tmp_path: Path) -> None:
    with NAMES["TextPoints"](tmp_path) as kind:
        check(kind)


@pytest.mark.parametrize(
    ("find", "put", "check"),
    [
        ("        self.close()\n        self._udp = Udp", "        self._udp = Udp", conformance.check_opened_twice),
        ("raise DeviceError(", "raise ValueError(", conformance.check_before_it_is_open),
        (" or not self._streaming:", ":", conformance.check_read_after_stop),
        ('StreamInfo("markers"', 'StreamInfo("points"', conformance.check_samples_are_of_its_streams),
        ('self.title, "markers")', 'self.title, "inertial")', conformance.check_samples_are_of_its_streams),
        ("Times(device_s, arrival_s,", "Times(device_s, arrival_s + 1,", conformance.check_samples_are_of_its_streams),
        ("now_s, tally, level = host_clock()", "now_s, tally, level = 1 / len(self._ready)",
         conformance.check_asked_from_other_threads),
        ("self._ready.append(ready)", "self._ready.append(ready) if ready.sequence % 3 else None",
         conformance.check_what_is_received_is_handed_on_or_counted),
        ("except FormatError as error:", "except KeyError as error:", conformance.check_spoilt_packets),
    ],
)  # fmt: skip
def test_the_suite_notices_a_fault(find: str, put: str, check: Callable[[Kind], None], tmp_path: Path) -> None:
    with _of_the_page(find, put)["TextPoints"](tmp_path) as kind, pytest.raises((Exception, pytest.fail.Exception)):
        check(kind)


@pytest.mark.parametrize(
    ("which", "place"), [(0, "devices/textpoints/__init__.py"), (1, "tests/devices/textpoints.py")]
)
def test_it_is_as_the_linter_wants_it(which: int, place: str) -> None:
    text = re.findall(r"^```python\n(.*?)^```$", PAGE, flags=re.DOTALL | re.MULTILINE)[which]
    assert (IMPORT in text) == bool(which)
    ruff = [sys.executable, "-m", "ruff"]
    ours = "lint.isort.known-first-party=['devices']"  # it is not there
    for words in (["check", "--config", ours], ["format", "--check"]):
        ran = subprocess.run(
            [*ruff, *words, "--stdin-filename", place, "-"], input=text, cwd=ROOT, capture_output=True, text=True
        )
        assert ran.returncode == 0, ran.stdout + ran.stderr


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
