"""The last net of the command line: nothing that a terminal obeys passes from a name or a file to the terminal."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import TextIOBase, TextIOWrapper
from typing import Any, TextIO, cast

from app.signals import leave
from core.printable import printable_lines


class _Stream(TextIOBase):
    """What is printed goes to `stream`. That this fails is no reason to end what is being done: once whoever reads it
    has gone, its terminal was closed or its disk is full, what is printed goes nowhere.

    failed: why it did, None while it does not; a reader who has gone had what he wanted, and is no failure."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self.failed: OSError | None = None

    def write(self, text: str) -> int:
        """As the stream does; says how much was taken of the text that was given."""
        with self._kept():
            self.stream.write(text)
        return len(text)

    def flush(self) -> None:
        """What was printed is seen."""
        with self._kept():
            self.stream.flush()

    @contextmanager
    def _kept(self) -> Iterator[None]:
        try:
            yield
        except BrokenPipeError:
            leave(self.stream)
        except OSError as error:
            self.failed = self.failed or error
            leave(self.stream)

    def isatty(self) -> bool:
        """Whether somebody watches."""
        return self.stream.isatty()

    def fileno(self) -> int:
        """Of the stream."""
        return self.stream.fileno()

    def writable(self) -> bool:
        """Always."""
        return True

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


class PrintableStream(_Stream):
    """What is printed goes to `stream`, with control characters shown instead of obeyed."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__(stream if isinstance(stream, _Stream) else cast(TextIO, _Stream(stream)))

    def write(self, text: str) -> int:
        """As the stream does; says how much was taken of the text that was given."""
        super().write(printable_lines(text))
        return len(text)


def why_not_printed(stream: TextIO) -> str:
    """Why something that was printed is nowhere, "" if there is no such thing: a disk that is full."""
    inner = unfiltered(stream)
    failed = inner.failed if isinstance(inner, _Stream) else None
    return "" if failed is None or failed.errno == errno.EIO else failed.strerror or str(failed)


def unfiltered(stream: TextIO) -> TextIO:
    """The stream itself, for the control characters of Phalanx's own: colours, a line that is rewritten."""
    return stream.stream if isinstance(stream, PrintableStream) else stream


@contextmanager
def printable_output() -> Iterator[None]:
    """Standard output and error are printable while it lasts, in any encoding that the terminal has."""
    before = sys.stdout, sys.stderr
    for stream in before:
        if isinstance(stream, TextIOWrapper):  # an en dash on a terminal of ASCII is no reason to fail
            stream.reconfigure(errors="backslashreplace")
    nowhere = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115, PTH123 - where one was closed before
    sys.stdout, sys.stderr = (cast(TextIO, PrintableStream(unfiltered(stream or nowhere))) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
        nowhere.close()
