"""Functions compiled by Numba, kept for the next start wherever there is a folder to keep them in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit


def compiler(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit` with these options, as a decorator.

    Where neither the folder of Phalanx nor one of the user's can be written, Numba refuses to compile what it could not
    keep. Then it is compiled anew at every start: slower, and the doctor says so.
    """

    def compiled(function: Callable[..., Any]) -> Any:
        try:
            return njit(cache=True, **options)(function)
        except RuntimeError:
            return njit(**options)(function)

    return compiled
