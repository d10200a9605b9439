"""How many joint angles the markers of a performer measure, and, in its tooltip, which they do not and why."""

from __future__ import annotations

from textwrap import fill

from shiboken6 import isValid

from app.texts import ElidedLabel
from app.worker import SessionWorker
from core.hand.skeleton import N_ROOT_DOFS
from core.observability import Observability, observability
from core.profile import Profile

_WIDE = 96  # characters of a line
_INTRO = "What these markers tell while all of them are seen. The other angles come from usual postures.\n"


def told_title(told: Observability) -> str:
    """'20 of 20 joint angles', '17 of 20 joint angles, 3 in part'."""
    digits = told.angles[N_ROOT_DOFS:]
    measured = sum(angle.measured for angle in digits)
    in_part = sum(not angle.measured and not angle.statistics for angle in digits)
    return f"{measured} of {len(digits)} joint angles" + (f", {in_part} in part" if in_part else "")


class ToldLine(ElidedLabel):
    """Follows the profile of one performer; worked out beside the window's thread."""

    def __init__(self, worker: SessionWorker, performer: int = 0) -> None:
        super().__init__()
        self._worker, self._performer = worker, performer
        self._of: Profile | None = None
        worker.profile_changed.connect(self._follow)
        self._follow()

    def _follow(self, _: object = None) -> None:
        cast = self._worker.session.profiles
        if self._performer >= len(cast):  # gone, as this will be
            return
        profile = cast[self._performer]
        if self._of is not None and self._of.same_hands(profile):
            return
        self._of = profile
        self.setText("…")
        self._worker.background(lambda: observability(profile), lambda told: self._show(profile, told))

    def _show(self, profile: Profile, told: Observability) -> None:
        if isValid(self) and profile is self._of:  # nobody has chosen another since, or taken the performer away
            self.setText(told_title(told))
            words = told.words or ("Every joint angle is measured.",)
            self.setToolTip(_INTRO + "\n".join(_bullet(each) for each in words))


def _bullet(words: str) -> str:
    return fill(f"• {words}", _WIDE, subsequent_indent="   ")
