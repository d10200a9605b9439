"""The command `phalanx`: what the window does with data, done from a terminal with the same engine and code."""

from __future__ import annotations

import argparse
import atexit
import importlib
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import NoReturn

from app.commands.printable_output import printable_output, why_not_printed
from app.commands.result import Exit, Result, to_json
from app.commands.terminal import say, tell
from app.signals import interrupting, words_of
from app.unfinished import at_work, end_process
from core.errors import PhalanxError
from core.printable import MOST_OF_TEXT, printable

COMMANDS = (
    "window",
    "demo",
    "track",
    "record",
    "simulate",
    "info",
    "verify",
    "recover",
    "export",
    "calibrate",
    "subspace",
    "train",
    "layout",
    "prop",
    "bench",
    "doctor",
)
"""Modules of app.commands, in the order of the help."""

EPILOG = """\
Without a command the application opens; --demo opens it on the built-in performer.
Exit status: 0 done, 1 failed (the message says what to do), 2 usage, 3 done with loss.
"""


class _Parser(argparse.ArgumentParser):
    """Quotes what was typed in a way that can be printed."""

    def error(self, message: str) -> NoReturn:
        super().error(printable(message, MOST_OF_TEXT))


def build_parser(names: Sequence[str] = COMMANDS) -> argparse.ArgumentParser:
    """The command line, with all commands or only those named."""
    parser = _Parser(
        prog="phalanx",
        description="Marker-based hand motion capture.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("-V", "--version", action="version", version=f"phalanx {_version()}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name in names:
        importlib.import_module(f"app.commands.{name}").add(commands)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit status. Never shows a traceback."""
    # Before anything large is computed: the matrices here are small, more BLAS threads only get in the way.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    words = list(sys.argv[1:] if argv is None else argv)
    if not words or words[0] == "--demo":
        words.insert(0, "window")
    if argv is None:
        # Numba's colours come by a library that writes to the terminal when all is said.
        os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")
        # After all that clears up comes the interpreter's own end: it would have Ctrl+C do as it did at first.
        atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
    with printable_output():
        status = _told(_main(words), words, ours=argv is None)
    if argv is None and at_work():
        end_process(status)
    return status


def _main(words: list[str]) -> Result:
    try:
        # Only the command that is asked for is imported: it starts faster, and the doctor works on a broken machine.
        arguments = build_parser([words[0]] if words[0] in COMMANDS else COMMANDS).parse_args(words)
        arguments.words = tuple(words)  # as typed, for what a command says of itself in its results
        for name in getattr(arguments, "imports", ()):  # before Ctrl+C is more than the end
            importlib.import_module(name)
        with interrupting():  # nothing half done is left behind, whoever asks
            return _run(arguments)
    except ModuleNotFoundError as error:
        return _failed(_missing(error))
    except PhalanxError as error:  # of what was typed
        return _failed(str(error))
    except KeyboardInterrupt as stop:  # as it began
        return _failed(str(stop) or words_of(signal.SIGINT))


def _told(result: Result, words: Sequence[str], ours: bool) -> int:
    """The exit status, once the figures are told that were asked for. ours: this process is the command's alone."""
    if ours:  # nothing is left that Ctrl+C could end but what waits for its reader, or spoil the status of
        signal.signal(signal.SIGINT, lambda number, frame: os._exit(result.exit))
    if any(len(word) > 2 and "--json".startswith(word) for word in words):  # also where the rest was refused
        tell(to_json(result.figures))
    sys.stdout.flush()
    why = why_not_printed(sys.stdout)
    if not why:
        return result.exit
    say(f"phalanx: What was to be printed could not be written ({why}). Give it another place.")
    return result.exit if result.stands or result.exit != Exit.DONE else Exit.FAILED


def _run(arguments: argparse.Namespace) -> Result:
    try:
        result: Result = arguments.run(arguments)
    except PhalanxError as error:
        return _failed(str(error))
    except KeyboardInterrupt as stop:
        return _failed(str(stop) or words_of(signal.SIGINT))
    except ModuleNotFoundError:
        raise
    except Exception as error:
        return _failed(_unexpected(error))
    return result


def _missing(error: ModuleNotFoundError) -> str:
    package = (error.name or "").partition(".")[0]
    if package in ("app", "core", "devices", "resources"):
        return _unexpected(error)
    return f"The package {package} is missing. Run `make setup`, or: python -m pip install --upgrade phalanx."


def _failed(text: str) -> Result:
    text = printable(text, MOST_OF_TEXT)
    say(f"phalanx: {text}")
    return Result(Exit.FAILED, {"error": text})


def _unexpected(error: Exception) -> str:
    """One line for the operator; the traceback goes to the log."""
    from app.notifications import LOG, start_log

    path = start_log()
    LOG.error("Command failed: %s\n%s", " ".join(sys.argv), "".join(traceback.format_exception(error)))
    where = f"The details are in {path}; please report them." if path else "No log could be written."
    return f"Unexpected {type(error).__name__}: {error}. {where}"


def _version() -> str:
    try:
        return version("phalanx")
    except PackageNotFoundError:
        return "(not installed)"
