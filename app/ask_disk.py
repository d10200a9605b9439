"""A question to a disk that may not answer: whoever asks waits a moment, and not for good."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from core.errors import TakeError

T = TypeVar("T")
WAIT_S = 1.0


class SilentDiskError(TakeError):
    """The disk has not answered in time."""


class AskDisk(Generic[T]):
    """One kind of question, asked by one thread. While an answer is owed, others are not waited for at all."""

    def __init__(self) -> None:
        self._asked: threading.Thread | None = None

    def __call__(self, folder: Path, question: Callable[[], T]) -> T:
        """The answer, or what the question raises. Raises SilentDiskError if none comes in time."""
        answers: list[T] = []
        errors: list[BaseException] = []

        def ask() -> None:
            try:
                answers.append(question())
            except BaseException as error:
                errors.append(error)

        if self._asked is None or not self._asked.is_alive():
            self._asked = threading.Thread(target=ask, name="disk", daemon=True)
            self._asked.start()
            self._asked.join(WAIT_S)
        if errors:
            raise errors[0]
        if not answers:
            raise SilentDiskError(f"The folder {folder} does not answer.", "Check its disk, or choose another folder.")
        return answers[0]
