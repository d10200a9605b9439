"""`phalanx simulate KIND`: serve a recording or the built-in performer on the real wire of a kind of device."""

from __future__ import annotations

import argparse
import time

from app.commands.device_options import add_device_options, device_settings
from app.commands.motion_options import add_motion_options, motion_of
from app.commands.result import Result
from app.commands.terminal import Progress, say, until_stopped
from app.device_kinds import SIMULATED, simulator_class
from core.printable import printable

_LOOK_S = 0.05


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Declares the command."""
    parser = commands.add_parser("simulate", help="serve a recording, or a performer, on the real wire of a device")
    devices = parser.add_subparsers(title="devices", metavar="DEVICE", dest="device", required=True)
    for kind in SIMULATED:
        simulator = simulator_class(kind)
        child = devices.add_parser(kind, help=simulator.title, description=simulator.manner)
        add_device_options(child, simulator.parameters)
        add_motion_options(child)
        child.add_argument("--json", action="store_true", help="figures as one JSON object on the last line")
        child.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> Result:
    """Serves until Ctrl+C, the given time, or the end of the recording."""
    motion = motion_of(arguments)
    simulator = simulator_class(arguments.device).of(
        motion.frames, motion.rate_hz, device_settings(arguments), loop=motion.repeat
    )
    with until_stopped() as stopped, simulator:
        print(f"Serving {printable(motion.title)} at {motion.rate_hz:g} Hz: {simulator.place}.", flush=True)
        say("Ctrl+C ends it.")
        simulator.start()
        started = time.monotonic()
        progress = Progress("Serving")
        while not (stopped.is_set() or simulator.finished):
            elapsed = time.monotonic() - started
            if arguments.seconds is not None and elapsed >= arguments.seconds:
                break
            progress.show(f"{elapsed:6.1f} s, {simulator.sent:,} frames to {simulator.audience}")
            stopped.wait(_LOOK_S)
        progress.done()
    if simulator.error is not None:
        raise simulator.error
    print(f"Sent {simulator.sent:,} frames.")
    figures = {
        "motion": motion.title,
        "rate_hz": motion.rate_hz,
        "sent": simulator.sent,
        "slipped": simulator.slipped,
        "warnings": motion.warnings,
        **simulator.settings,
    }
    return Result(figures=figures)
