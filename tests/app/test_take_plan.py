from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from app import settings as names
from app.settings import Settings
from app.take_plan import TakePlan, default_folder
from core.errors import TakeError


def remembering(folder: str) -> Settings:
    settings = Settings(None)
    settings.set(names.TAKE_FOLDER, folder)
    return settings


def test_the_disk_of_the_last_time_is_not_asked_before_the_window_is_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A share that hangs would answer never."""
    folder, stat = tmp_path / "share" / "takes", os.stat

    def asked(path: Any, *words: Any, **more: Any) -> os.stat_result:
        assert not str(path).startswith(str(folder)), "the disk is asked"
        return stat(path, *words, **more)

    monkeypatch.setattr(os, "stat", asked)
    assert TakePlan(remembering(str(folder))).folder == folder


@pytest.mark.parametrize("name", ["x" * 300, "ö" * 150, "/".join(["folder"] * 300)])
def test_what_no_folder_can_be_called_is_not_taken_up(name: str) -> None:
    assert TakePlan(remembering(f"/{name}")).folder == default_folder()


def test_a_folder_that_cannot_be_asked_is_said_and_breaks_nothing(tmp_path: Path) -> None:
    plan = TakePlan(Settings(None))
    plan.set_folder(tmp_path / ("x" * 300))
    name, problem = plan.preview()
    assert name == "" and "cannot be used (File name too long)" in problem
    with pytest.raises(TakeError, match="choose another folder"):
        plan.next()
