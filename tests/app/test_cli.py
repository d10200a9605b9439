"""The command line as a whole: help, usage, errors, and the commands that need no device."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from app.cli import COMMANDS
from app.commands.result import to_json
from core.markers.layout import layout_names, load_layout
from tests.app.command import phalanx
from tests.data import ROOT


def test_help_names_every_command() -> None:
    ran = phalanx("--help")
    assert ran.code == 0
    assert ran.err == ""
    named = re.findall(r"^    (\w+) ", ran.out, re.MULTILINE)
    assert [name for name in COMMANDS if name not in named] == []


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help(name: str) -> None:
    ran = phalanx(name, "--help")
    assert ran.code == 0
    assert ran.out.startswith(f"usage: phalanx {name}")


def test_what_track_takes_is_told_without_what_solves() -> None:
    """Its help, and what is wrong with its options, wait for no compiled code."""
    heavy = "[name for name in ('numba', 'scipy', 'numpy') if name in sys.modules]"
    shown = f"import sys, app.commands.track; print({heavy})"
    ran = subprocess.run([sys.executable, "-c", shown], cwd=ROOT, capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


def test_readme_names_every_command_and_only_files_that_exist() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert [name for name in COMMANDS if f"`phalanx {name}" not in readme and name != "window"] == []
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", readme) if "://" not in link]
    assert [link for link in links if not (ROOT / link).exists() and not link.startswith("docs/images/")] == []


def test_the_documentation_lists_every_page() -> None:
    docs = ROOT / "docs"
    listed = re.findall(r"^\| \[[^]]+\]\(([^)]+)\)", (docs / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    pages = {path.name for path in docs.glob("*.md")} - {"README.md"}
    assert set(listed) == pages | {"../README.md", "../CHANGELOG.md"}
    assert len(listed) == len(set(listed))


def test_readme_lists_the_keys() -> None:
    from app import shortcuts

    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    section = readme[readme.index("## Keyboard") : readme.index("## Command line")]
    keys = [keys for title, rows in shortcuts.TABLE if title in ("Recording", "Application") for keys, _ in rows]
    assert [key for key in keys if key.split(", ")[0] not in section] == []


def test_version() -> None:
    ran = phalanx("--version")
    assert (ran.code, ran.out.split()[0]) == (0, "phalanx")


@pytest.mark.parametrize(
    "words",
    [
        ["no-such-command"],
        ["track"],
        ["track", "file.trc", "--profile", "han19"],
        ["record"],
        ["record", "no-such-device", "--out", "x"],
        ["record", "natnet"],
        ["record", "natnet", "--out", "x", "--seconds", "soon"],
        ["record", "natnet", "--out", "x", "--no-such-option"],
        ["simulate", "natnet", "--rate", "fast"],
        ["info"],
        ["export", "take.mcap", "--out", "there"],
        ["bench", "no-such-benchmark"],
        ["layout"],
        ["calibrate"],
        ["calibrate", "no-such-way"],
    ],
)
def test_wrong_usage_is_exit_2_and_one_message(words: list[str]) -> None:
    ran = phalanx(*words)
    assert ran.code == 2
    assert ran.out == ""
    assert ran.err.startswith("usage: phalanx")
    assert "error:" in ran.err.splitlines()[-1]


@pytest.mark.parametrize("content", [b"", b"hello\n", bytes(range(256)) * 64, b"PathFileType\t4\t(X/Y/Z)\n"])
@pytest.mark.parametrize("command", ["track", "info", "verify", "recover", "export", "simulate"])
def test_files_that_are_not_what_they_should_be(tmp_path: Path, command: str, content: bytes) -> None:
    path = tmp_path / "strange.mcap"
    path.write_bytes(content)
    words = {
        "track": ["track", path, "--profile", "han19", "--out", tmp_path / "out", "--json"],
        "export": ["export", path, "--to", "csv", "--out", tmp_path / "out", "--json"],
        "simulate": ["simulate", "natnet", "--motion", path, "--command-port", "0", "--data-port", "0", "--json"],
    }.get(command, [command, path, "--json"])
    ran = phalanx(*words)
    assert ran.code == 1
    assert len(ran.err.splitlines()) == 1
    assert "strange" in ran.err
    assert ran.err == f"phalanx: {ran.figures['error']}\n"
    assert path.read_bytes() == content
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("command", ["track", "info", "verify", "recover", "export"])
def test_files_that_are_not_there(tmp_path: Path, command: str) -> None:
    path = tmp_path / "absent.mcap"
    words = {
        "track": ["track", path, "--profile", "han19", "--out", tmp_path / "out"],
        "export": ["export", path, "--to", "csv", "--out", tmp_path / "out"],
    }.get(command, [command, path])
    ran = phalanx(*words)
    assert ran.code == 1
    assert "absent.mcap" in ran.err
    assert len(ran.err.splitlines()) == 1


def test_layouts_are_listed_and_shown() -> None:
    ran = phalanx("layout", "list", "--json")
    assert ran.code == 0
    assert tuple(layout["name"] for layout in ran.figures["layouts"]) == layout_names()
    shown = phalanx("layout", "show", "han19", "--json")
    written = load_layout("han19").to_dict()
    assert {name: shown.figures[name] for name in written} == written
    assert all(name in shown.out for name in load_layout("han19").marker_names)


def test_unknown_layout_names_the_known_ones() -> None:
    ran = phalanx("layout", "show", "han20")
    assert ran.code == 1
    assert "han20" in ran.err
    assert all(name in ran.err for name in layout_names())


def test_a_reader_that_goes_away_is_no_error() -> None:
    done = subprocess.run(
        f'"{sys.executable}" -m app layout show han19 | head -1', shell=True, cwd=ROOT, capture_output=True, text=True
    )
    assert done.stdout.startswith("han19")
    assert done.stderr == ""


def test_unexpected_faults_go_to_the_log_not_to_the_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from app import cli
    from app.commands import layout
    from app.notifications import log_folder

    def fail(arguments: object) -> None:
        raise ZeroDivisionError("seven by nought")

    monkeypatch.setattr(layout, "run_list", fail)
    assert cli.main(["layout", "list", "--json"]) == 1
    captured = capsys.readouterr()
    (line,) = captured.err.splitlines()
    assert line.startswith("phalanx: Unexpected ZeroDivisionError: seven by nought.")
    assert str(log_folder() / "phalanx.log") in line
    assert json.loads(captured.out)["error"] in line
    assert "Traceback" in (log_folder() / "phalanx.log").read_text(encoding="utf-8")


def test_figures_are_strict_json() -> None:
    import numpy as np

    text = to_json({"nan": float("nan"), "n": np.int64(3), "a": np.array([1.0, np.inf]), "p": Path("x"), "t": ("é",)})
    assert json.loads(text) == {"nan": None, "n": 3, "a": [1.0, None], "p": "x", "t": ["é"]}
    assert "\n" not in text
