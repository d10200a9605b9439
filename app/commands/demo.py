"""`phalanx demo`: the built-in performer, in a window; where there is no display, a tour on a virtual one."""

from __future__ import annotations

import argparse
import subprocess
import sys
from datetime import datetime
from pathlib import Path

from app.commands.out import out_folder
from app.commands.result import Exit, Result
from app.commands.terminal import say, until_stopped
from app.commands.verdict import status_of
from app.signals import heard
from app.virtual_display import has_display, virtual_display
from core.printable import printable

FOLDER = "phalanx-demo"


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser(
        "demo",
        help="the built-in performer: connect, track, record, export",
        description="Opens the application on the built-in performer, connected and tracking. Where there is no "
        "display it does so on a virtual one for some seconds, and leaves a take, exports and pictures in a folder.",
    )
    parser.add_argument("--tour", action="store_true", help="record, export, take pictures and close, on any display")
    parser.add_argument(
        "--seconds", metavar="S", type=float, default=8.0, help="of the take of the tour [s]; default 8"
    )
    parser.add_argument(
        "--out", metavar="DIR", type=out_folder, help=f"folder of the tour; default a new one in {FOLDER}/"
    )
    parser.add_argument("--json", action="store_true", help="figures of the tour as one JSON object on the last line")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """A window that stays, or a tour that ends."""
    if not has_display():
        return _on_a_virtual_display(arguments)
    if arguments.tour:
        return _tour(arguments)
    from app.application import run as open_window

    return Result(Exit.DONE if open_window(demo=True) == 0 else Exit.FAILED)


def _on_a_virtual_display(arguments: argparse.Namespace) -> Result:
    """The tour, in a process of its own: Qt does not outlive its display."""
    folder = arguments.out or Path(FOLDER) / f"{datetime.now():%Y-%m-%d_%H-%M-%S}"
    say("This machine has no display: a virtual one serves.")
    command = [sys.executable, "-m", "app", "demo", "--tour", "--out", str(folder.resolve())]
    command += ["--seconds", str(arguments.seconds), *(["--json"] if arguments.json else [])]
    # In a session of its own it hears of an end from here alone, and once.
    with (
        virtual_display(),
        subprocess.Popen(command, cwd=Path(__file__).parents[2], start_new_session=True) as tour,
        heard(tour.send_signal),
    ):
        code = tour.wait()
    raise SystemExit(code if code >= 0 else Exit.FAILED)


def _tour(arguments: argparse.Namespace) -> Result:
    from app.left_behind.run_file import RunFile
    from app.notifications import start_log
    from app.tour import run_demo_tour

    start_log()
    folder = arguments.out or Path(FOLDER) / f"{datetime.now():%Y-%m-%d_%H-%M-%S}"
    with RunFile("the tour"), until_stopped() as stopped:
        tour = run_demo_tour(folder, arguments.seconds, say, stopped)
    take = tour.summary
    rms = ", ".join(f"{side} {1000 * rms_m:.2f} mm" for side, rms_m in tour.rms_m.items())
    print(f"Tracked at {tour.rate_hz:.0f} Hz, {1000 * tour.latency_s:.1f} ms from exposure to pose; RMS {rms}.")
    print(f"Take: {printable(take.path)}\n  {take.line}.")
    for title, files in (("Exports", tour.exports), ("Pictures", tour.screenshots)):
        print(f"{title}:", *map(printable, files), sep="\n  ")
    print(f"Everything is in {printable(folder.resolve())}")
    figures = {
        "folder": folder.resolve(),
        "take": take.path,
        "received": take.received,
        "written": take.written,
        "dropped": take.dropped,
        "lost": take.lost,
        "exports": tour.exports,
        "pictures": tour.screenshots,
        "rms_m": tour.rms_m,
        "rate_hz": tour.rate_hz,
        "latency_s": tour.latency_s,
    }
    return Result(status_of(take.verdict), figures)
