"""The last net of the command line: nothing that a terminal obeys passes from a name or a file to the terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import TextIOBase, TextIOWrapper
from typing import Any, TextIO, cast

from core.printable import printable_lines


class PrintableStream(TextIOBase):
    """What is printed goes to `stream`, with control characters shown instead of obeyed."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def write(self, text: str) -> int:
        """As the stream does; says how much was taken of the text that was given."""
        self.stream.write(printable_lines(text))
        return len(text)

    def flush(self) -> None:
        """What was printed is seen."""
        self.stream.flush()

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
    sys.stdout, sys.stderr = (cast(TextIO, PrintableStream(unfiltered(stream))) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
