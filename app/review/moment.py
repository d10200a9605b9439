"""The frame under the playhead in words: one joint angle of each hand, and what is least sure."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from app.label_trust import percent
from app.pose_words import angle_title, least_sure
from app.review.analysis import Analysis, Cell
from app.review.fixed_shown import FixedShown
from app.review.player import Player
from app.review.take_plots import TakePlots
from app.why_lost import SHORT_WORDS
from core.frames import WHY_LOST
from core.hand.skeleton import DOF_NAMES, N_ROOT_DOFS
from core.takes.holes import hole_words
from core.words import ordinal

_PERIOD_S = 0.1
"""Numbers that change faster cannot be read, and putting them up takes the time of the 3D view."""


def moment_words(analysis: Analysis, frame: int, dof: int, fixed: FixedShown | None = None) -> str:
    """A line per hand: 'Left: index PIP flexion 34° ±2° (in all frames ±5°), least sure: ring DIP ±14°'.

    fixed: of this analysis; None leaves its deviation out.
    """
    if n := analysis.chosen_of(frame):
        every = f": every {ordinal(n)} frame was solved" if n > 1 else ""
        return f"No pose, left out by choice{every}. Solve again makes poses of all."
    lines = []
    for i in range(len(analysis.hands)):
        if analysis.states[i, frame] != Cell.TRACKED:
            why = SHORT_WORDS.get(WHY_LOST[analysis.why[i, frame]], "")
            lines.append(f"{analysis.title(i)}: not tracked" + (f", {why}" if why else ""))
            continue
        title = angle_title(DOF_NAMES[dof])
        std_rad = analysis.theta_std[i, frame, dof]
        error = f" ±{np.degrees(std_rad):.0f}°" if np.isfinite(std_rad) else ""
        if error and fixed is not None and dof >= N_ROOT_DOFS:
            error += f" (in all frames ±{np.degrees(fixed.std(i, frame)[dof]):.0f}°)"
        value = f"{title[0].lower()}{title[1:]} {np.degrees(analysis.theta_rad[i, frame, dof]):.0f}°{error}"
        value += " from neutral" if analysis.from_neutral(i) else ""
        unsure = least_sure(analysis.theta_std[i, frame])
        mean, worst = analysis.trust[i, frame].tolist()
        labels = "" if np.isnan(mean) else f", labels {percent(mean)} sure, the worst {percent(worst)}"
        lines.append(f"{analysis.title(i)}: {value}" + (f", least sure: {unsure}" if unsure else "") + labels)
    return "\n".join(lines)


class Moment:
    """Says the words whenever the playhead or the angle chosen changes, while playing ten times a second."""

    def __init__(
        self,
        player: Player,
        plots: TakePlots,
        analysis: Callable[[], Analysis | None],
        say: Callable[[str], None],
    ) -> None:
        self._player, self._plots, self._analysis, self._say = player, plots, analysis, say
        self._fixed: FixedShown | None = None
        self._said_s = 0.0
        player.subscribe(self._moved)
        plots.angle.currentIndexChanged.connect(lambda _: self.refresh())

    def refresh(self) -> None:
        """Say it now."""
        self._said_s = time.monotonic()
        analysis, frame = self._analysis(), self._player.frame
        hole = analysis.holes.at(self._player.time_s) if analysis is not None else None
        if analysis is not None and hole is not None:
            self._say(hole_words(analysis.holes, hole))
            return
        if analysis is None or frame >= analysis.n_frames:
            self._say("")
            return
        if self._fixed is None or self._fixed.analysis is not analysis:
            self._fixed = FixedShown(analysis)
        if self._player.playing and analysis.chosen_of(frame):  # the hands of the last that was solved are shown
            frame = int(max(analysis.with_pose[analysis.with_pose <= frame], default=frame))
        self._say(moment_words(analysis, frame, self._plots.dof, self._fixed))

    def _moved(self) -> None:
        if not self._player.playing or time.monotonic() - self._said_s > _PERIOD_S:
            self.refresh()
