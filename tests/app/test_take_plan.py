"""The next take: a folder that has gone is not made anew, one that hangs stops nothing, no name is given twice."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from app import settings as names
from app.settings import Settings
from app.take_plan import TakePlan, default_folder
from core.errors import TakeError


@pytest.fixture
def plan(tmp_path: Path) -> TakePlan:
    settings = Settings(None)
    settings.set(names.TAKE_FOLDER, str(tmp_path / "takes"))
    made = TakePlan(settings)
    made.set_template("{shot}_{take:03}")
    return made


def begun(plan: TakePlan) -> Path:
    """A take as the recorder begins it."""
    name, path = plan.next()
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(b"a take")
    plan.take_begun(name)
    return path


def test_a_folder_that_was_never_there_is_made(plan: TakePlan) -> None:
    assert plan.next()[0] == "shot_001"
    plan.make_folder()
    plan.folder.rmdir()
    assert plan.next()[0] == "shot_001"  # it held nothing


@pytest.mark.parametrize("seen", ["begun", "there at the start", "emptied meanwhile"])
def test_a_folder_that_held_takes_and_was_renamed_is_refused(plan: TakePlan, tmp_path: Path, seen: str) -> None:
    if seen == "begun":
        begun(plan)
    else:
        plan.folder.mkdir()
        (plan.folder / "old.mcap").write_bytes(b"a take")
        plan.next()
    if seen == "emptied meanwhile":
        (plan.folder / "old.mcap").unlink()
        plan.next()
    plan.folder.rename(tmp_path / "away")
    for _ in range(2):
        with pytest.raises(TakeError, match=r"is not there, and it held takes\. Choose it where it is now"):
            plan.next()
        with pytest.raises(TakeError, match="is not there"):
            plan.make_folder()
    preview = plan.preview()
    assert "is not there" in preview.problem and preview.at_fault == "folder" and not plan.folder.exists()
    plan.show_typed("template", "{nothing}")  # both are wrong: the name is said first, for it is being typed
    assert plan.preview().at_fault == "template" and plan.preview().instead == "No valid name"
    plan.set_template(plan.template)
    (tmp_path / "away").rename(plan.folder)
    assert plan.next()[1].parent == plan.folder  # it is back


def test_a_number_is_not_given_twice_wherever_its_take_is(plan: TakePlan, tmp_path: Path) -> None:
    first = begun(plan)
    plan.take_finished(first.stem, kept=True)
    first.unlink()  # moved to another place, or into a waste bin
    assert plan.next()[0] == "shot_002"
    plan.set_folder(tmp_path / "another")
    assert plan.next()[0] == "shot_002"
    plan.set_shot("Shot")
    assert plan.next()[0] == "Shot_002"  # some systems compare names so
    plan.set_shot("other")
    assert plan.next()[0] == "other_001"


def test_the_name_of_a_take_of_which_nothing_is_left_is_free(plan: TakePlan) -> None:
    first = begun(plan)
    first.unlink()
    plan.take_finished(first.stem, kept=False)
    assert plan.next()[0] == "shot_001"


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
    preview = plan.preview()
    assert preview.name == "" and "cannot be used (File name too long)" in preview.problem
    assert preview.at_fault == "folder" and preview.instead == "Take folder not usable"
    with pytest.raises(TakeError, match="choose another folder"):
        plan.next()
