"""Every kind of device does what the contract says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from app.device_kinds import KINDS as REGISTERED
from tests.devices.conformance import Kind
from tests.devices.kinds import KINDS

EACH = [
    pytest.param(made, check, id=f"{name}: {check.__name__.removeprefix('check_').replace('_', ' ')}")
    for name, (made, checks) in KINDS.items()
    for check in checks
]


@pytest.mark.parametrize(("made", "check"), EACH)
def test_contract(made: Callable[[Path], Kind], check: Callable[[Kind], None], tmp_path: Path) -> None:
    with made(tmp_path) as kind:
        check(kind)


def test_every_kind_is_checked(tmp_path: Path) -> None:
    checked = set()
    for made, _ in KINDS.values():
        with made(tmp_path) as kind:
            checked.add(kind.device().kind)
    assert checked == set(REGISTERED)
