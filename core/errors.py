"""One kind of error for what an operator can act upon."""

from __future__ import annotations

from core.printable import MOST_OF_TEXT, printable


class PhalanxError(Exception):
    """Something went wrong in a way that the operator can mend.

    `what` names the thing and the value that caused it; `action` says what to do next. The same text reaches
    the message panel and the command line. Both are lines that can be printed, whatever value they quote.
    """

    def __init__(self, what: str, action: str = "") -> None:
        what, action = printable(what, MOST_OF_TEXT), printable(action, MOST_OF_TEXT)
        super().__init__(what if not action else f"{what} {action}")
        self.what = what
        self.action = action


class FormatError(PhalanxError):
    """A packet or a file is not what it should be."""


class DeviceError(PhalanxError):
    """A device cannot be reached, opened or read."""


class NoAnswerError(DeviceError):
    """Nobody answers where a device should be; it may be switched on yet."""


class TakeError(PhalanxError):
    """A take cannot be written, read or recovered."""


class ExportError(PhalanxError):
    """An export could not be written, or did not read back equal."""


class CancelledError(PhalanxError):
    """The operator stopped a long task; nothing half-done is left behind."""

    def __init__(self) -> None:
        super().__init__("Cancelled.")
