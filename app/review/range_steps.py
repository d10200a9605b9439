"""In and out points as steps that can be undone."""

from __future__ import annotations

from collections.abc import Callable

from app.review.document import ReviewDocument
from app.review.player import Player
from app.undo import UndoStack


class RangeSteps:
    """Moves in and out of the open take, which the steps end with."""

    def __init__(self, player: Player, undo: UndoStack, document: Callable[[], ReviewDocument | None]) -> None:
        self._player, self._undo, self._document = player, undo, document

    def set_in(self) -> None:
        """In is at the playhead."""
        self._change("in point", self._player.set_in)

    def set_out(self) -> None:
        """Out is at the playhead."""
        self._change("out point", self._player.set_out)

    def clear(self) -> None:
        """In and out are the ends of the take."""
        self._change("clearing of in and out", self._player.clear_range)

    def dragged(self, handle: str, in_frame: int, out_frame: int) -> None:
        """A handle ("in" or "out") was dragged; in and out were at these frames before."""
        self._made(f"{handle} point", (in_frame, out_frame))

    def _change(self, text: str, move: Callable[[], None]) -> None:
        before = self._player.in_frame, self._player.out_frame
        move()
        self._made(text, before)

    def _made(self, text: str, before: tuple[int, int]) -> None:
        player, document = self._player, self._document()
        after = player.in_frame, player.out_frame
        if document is not None and after != before:
            self._undo.change(
                f"{text} of {document.info.name}",
                lambda: player.set_range(*after),
                lambda: player.set_range(*before),
                of=document,
            )
