"""All tests, some groups of them beside each other: `make test`; with --check those that matter most: `make check`.

Each group is one run of pytest with a display, settings and folders of its own. Groups of BESIDE run at once, one more
than there are processors (many wait for windows and processes of their own), or as many as --jobs says; those of ALONE
afterwards, one after the other, with the machine to themselves: they count what is lost, late or skipped while frames
come in, and two of them would count each other. What no group names is run as well.

A few that fail are run once more at the end with the machine to themselves: a display or a timer may come too late on
one that is busy. What passes then is named in the last lines; what fails again, or many at once, has failed, as has a
process that broke down. The last lines say what went wrong and why.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path
from typing import IO

ROOT = Path(__file__).resolve().parent.parent

Groups = dict[str, tuple[str, ...]]
"""Patterns of files by the name of a group; a file belongs to the first that fits."""

Ended = dict[str, int]
"""Exit statuses of pytest by the name of a group: 1 where tests failed, others where more went wrong."""

ALONE: Groups = {
    "frames as they come": (
        "tests/app/test_live_figures.py",
        "tests/app/test_staying_live.py",
        "tests/app/test_two_performers.py",
        "tests/app/test_nothing_jumps.py",
        "tests/app/test_session.py",
        "tests/app/test_window.py",
        "tests/devices/natnet/test_replay.py",
        "tests/devices/natnet/test_spoofed.py",
    ),
}

BESIDE: Groups = {
    "ends and disks": (
        "tests/app/test_endings.py",
        "tests/app/test_record*_faults.py",
        "tests/app/test_recording_memory.py",
        "tests/app/test_window_disk.py",
        "tests/devices/natnet/test_asleep.py",
    ),
    "streams": (
        "tests/app/test_backlog.py",
        "tests/app/test_playing_files.py",
        "tests/app/test_takes_of_bad_streams.py",
        "tests/devices/**/*",
    ),
    "commands": ("tests/app/test_cli*.py", "tests/app/test_import.py", "tests/app/test_e*.py"),
    "measures": (
        "tests/app/test_ba*.py",
        "tests/app/test_be*.py",
        "tests/app/test_c[ae]*.py",
        "tests/app/test_r[eu][clnsu]*.py",
        "tests/app/test_pe[eo][rp]*.py",
    ),
    "fields and whole days": (
        "tests/app/test_typing.py",
        "tests/app/test_operator_day.py",
        "tests/app/test_demo.py",
    ),
    "windows": ("tests/app/test_[a-q]*.py", "tests/app/test_[s-z]*.py"),
    "labelling": ("tests/core/labelling/*", "tests/core/relabel/*", "tests/core/training/*"),
    "engine": ("tests/core/test_*.py", "tests/core/props/*"),
    "faults": ("tests/faults/*", "tests/core/untrusted/*"),
    "hands": ("tests/core/hand/**/*", "tests/core/kinematics/*", "tests/core/calibration/*", "tests/core/m*/*"),
    "takes and files": ("tests/core/takes/*", "tests/core/export/*", "tests/core/formats/*", "tests/fuzz/*"),
    "review": ("tests/app/test_review*.py",),
    "all others": ("tests/**/*",),
}
"""The longest first: the last ones fill the gap at the end."""

CHECK: Groups = {
    "takes and files": ("tests/core/takes/*", "tests/core/formats/*", "tests/core/untrusted/*", "tests/fuzz/*"),
    "engine": (
        "tests/core/test_engine.py",
        "tests/core/test_engine_p*.py",
        "tests/core/test_profile.py",
        "tests/core/test_sources.py",
        "tests/core/kinematics/test_[ks]*.py",
        "tests/core/labelling/test_[as]*.py",
        "tests/core/markers/*",
        "tests/core/hand/test_t*.py",
    ),
    "devices and window": (
        "tests/devices/**/*",
        "tests/app/test_window.py",
        "tests/app/test_session.py",
        "tests/app/test_losses.py",
        "tests/app/test_holes.py",
    ),
    "commands and project": (
        "tests/app/test_cli.py",
        "tests/app/test_cli_takes.py",
        "tests/app/test_cli_export.py",
        "tests/core/export/test_[cr]*.py",
        "tests/test_*.py",
    ),
}
"""What a fault costs most in: takes and what reads them, the wire, the engine's labels and poses, recording, losses
that must show, and the project itself. Left out: measures and benches, whole days and whole dialogs in the window."""


FEW = 12
"""So many failures may be a busy machine's; more are not."""


@dataclass
class Running:
    """A group under way."""

    name: str
    process: subprocess.Popen[bytes]
    output: IO[bytes]
    began_s: float


def files_of(groups: Groups, taken: set[Path]) -> dict[str, list[str]]:
    """The test files of each group, relative to the project; `taken` grows by them."""
    found: dict[str, list[str]] = {}
    for name, patterns in groups.items():
        files = {file for pattern in patterns for file in ROOT.glob(pattern) if file.name.startswith("test_")}
        mine = sorted(file for file in files - taken if file.suffix == ".py")
        taken.update(mine)
        if mine:
            found[name] = [str(file.relative_to(ROOT)) for file in mine]
    return found


def command(files: list[str], options: list[str]) -> list[str]:
    """How a group is run."""
    return [sys.executable, "-m", "pytest", *options, *files]


def _hearing() -> None:
    """In the new process: what a shell begins in the background, or with nohup, hears no Ctrl+C and no hang-up, and
    tests send both."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


HEARING = _hearing if os.name == "posix" else None


def noted(cache: Path) -> list[str]:
    """Options for a run whose failures are kept in a folder."""
    return ["-o", f"cache_dir={cache}", f"--junitxml={cache / 'told.xml'}"]


def failures(cache: Path) -> list[str]:
    """The tests that failed in a run whose failures were kept in a folder."""
    kept = cache / "v" / "cache" / "lastfailed"
    return sorted(json.loads(kept.read_text(encoding="utf-8"))) if kept.exists() else []


def reasons(cache: Path) -> list[str]:
    """A line for each test that failed in such a run: which, and the beginning of why. [] where it broke down."""
    if not (cache / "told.xml").exists():
        return []
    cases = ElementTree.parse(cache / "told.xml").iter("testcase")
    bad = [(case, one) for case in cases for one in case if one.tag in ("failure", "error")]
    return [
        f"{case.get('classname')}::{case.get('name')}: {' '.join(one.get('message', '').split())[:160]}"
        for case, one in bad
    ]


def told(ended: Ended, cache: Path) -> None:
    """Prints what failed and why, once more: in the last lines it is found."""
    for name, status in ended.items():
        print(f"\n{name}: pytest ended with {status}", *reasons(cache / name)[:FEW], sep="\n  ")


def run_again(ended: Ended, options: list[str], cache: Path) -> bool:
    """The tests that failed, alone, if they are few and all that went wrong. True if they pass now."""
    tests = [test for name in ended for test in failures(cache / name)]
    if len(tests) > FEW or not all(status == 1 and failures(cache / name) for name, status in ended.items()):
        told(ended, cache)
        return False
    print(f"\n== once more, alone: {len(tests)} that failed", flush=True)
    if failed := run_alone({"tests that failed": tests}, options, cache / "again"):
        told(failed, cache / "again")
        return False
    print("\nFailed at first, passed when run again alone:", *tests, sep="\n  ")
    told(ended, cache)
    return True


def run_beside(groups: dict[str, list[str]], jobs: int, options: list[str], cache: Path) -> Ended:
    """Groups, `jobs` at once; what each printed as soon as it is done. Returns those that did not pass."""
    waiting, running, ended = list(groups.items()), list[Running](), Ended()
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                name, files = waiting.pop(0)
                print(f"-- {name}: {len(files)} files", flush=True)
                output = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as its group
                words = command(files, [*options, *noted(cache / name)])
                process = subprocess.Popen(words, cwd=ROOT, stdout=output, stderr=subprocess.STDOUT, preexec_fn=HEARING)
                running.append(Running(name, process, output, time.monotonic()))
            time.sleep(0.2)
            for one in [one for one in running if one.process.poll() is not None]:
                running.remove(one)
                if one.process.returncode:
                    ended[one.name] = one.process.returncode
                _tell(one)
    finally:
        for one in running:
            one.process.send_signal(signal.SIGINT)
            one.process.wait()
    return ended


def _tell(one: Running) -> None:
    one.output.seek(0)
    print(f"\n== {one.name}, {time.monotonic() - one.began_s:.0f} s", flush=True)
    sys.stdout.buffer.write(one.output.read())
    sys.stdout.flush()
    one.output.close()


def run_alone(groups: dict[str, list[str]], options: list[str], cache: Path) -> Ended:
    """Groups one after the other. Returns those that did not pass."""
    ended = Ended()
    for name, files in groups.items():
        print(f"\n== {name}", flush=True)
        words = command(files, [*options, *noted(cache / name)])
        if status := subprocess.run(words, cwd=ROOT, preexec_fn=HEARING).returncode:
            ended[name] = status
    return ended


def main() -> int:
    """The exit status: 0 if every test passed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only the tests that matter most")
    parser.add_argument(
        "--jobs", type=int, default=min((os.cpu_count() or 1) + 1, 4), help="groups at once; %(default)s"
    )
    parser.add_argument("options", nargs="*", help="for pytest, after --")
    arguments = parser.parse_args()
    began_s, taken = time.monotonic(), set[Path]()
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder)
        alone = {} if arguments.check else files_of(ALONE, taken)
        beside = files_of(CHECK if arguments.check else BESIDE, taken)
        ended = run_beside(beside, arguments.jobs, arguments.options, cache)
        ended |= run_alone(alone, arguments.options, cache)
        passed = not ended or run_again(ended, arguments.options, cache)
    print(f"\n{'All passed' if passed else 'Not all passed'}, {(time.monotonic() - began_s) / 60:.1f} min.")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
