"""Takes on disk with known contents, for tests of what is done with them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from core.frames import HandFrame, HandState, Times
from core.hand.skeleton import DOF_NAMES
from core.profile import Profile
from core.takes.take import Mark, TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.app.hand_frames import hand_frame, profile, sample

RATE_HZ = 100.0


def write_take(
    folder: Path, name: str, n: int = 60, *, lost: range = range(0), hidden: range = range(0), seal: bool = True,
    unsolved: range = range(0), guessed: range = range(0), network_loss: int = 0,
    worn: Profile | None = None, rating: str = "", notes: str = "", rate_hz: float = RATE_HZ,
    silent: tuple[int, float] | None = None, tail_s: float | None = None,
) -> Path:  # fmt: skip
    """Both hands drift sideways for n frames; the left one is lost in `lost`, its marker 2 hidden in `hidden`.

    worn: whose hands they are; None: hand_frames.profile.
    Frames of `unsolved` have no solution. In `guessed` (if any) the left ring finger's last joint is sure to 30 degrees
    only and its marker 2 to 9 mm; everything else, and in all other frames, is sure to 2 degrees and 1 mm.
    silent: before this frame nothing came for so long [s]. tail_s: recording went on for so long after the last frame.
    Marks at frames 10 ("clap") and 20 (no name).
    """
    path = folder / f"{name}.mcap"
    info = TakeInfo(name, "Ann", rate_hz=rate_hz, device={"title": "test"}, rating=rating, notes=notes)
    worn = worn or profile()
    writer = TakeWriter(path, info, worn)
    right = hand_frame("right", worn=worn)
    left = {state: hand_frame("left", state=state, worn=worn) for state in HandState}
    dropout = hand_frame("left", hidden=(2,), worn=worn)
    for i in range(n):
        one = dropout if i in hidden else left[HandState.LOST if i in lost else HandState.TRACKED]
        drift = np.array([0.001 * i, 0.0, 0.0])
        hands = [replace(hand, markers_world_m=hand.markers_world_m + drift) for hand in (one, right)]
        if guessed:
            hands = [_sure(hand, guess=i in guessed and hand.side == "left") for hand in hands]
        frame, tracked = sample(*hands, sequence=i)
        time_s = i / rate_hz + (silent[1] if silent and i >= silent[0] else 0.0)
        times = Times(time_s, time_s, time_s)
        writer.raw("", replace(frame, times=times))
        if i not in unsolved:
            writer.solved(replace(tracked, times=times))
    for mark in (Mark(10 / rate_hz, "clap"), Mark(20 / rate_hz)):
        writer.mark(mark)
    if seal:
        tracked = {"left": n - len(lost), "right": n}
        ran_s = None if tail_s is None else time_s + 1.0 / rate_hz + tail_s
        writer.seal(
            TakeCounts(
                n, n, lost=network_loss, solved=n - len(unsolved), tracked=tracked, length_s=ran_s,
                first_s=None if ran_s is None else 0.0,
            )
        )  # fmt: skip
    else:
        writer.close()
    return path


def _sure(hand: HandFrame, guess: bool) -> HandFrame:
    theta_std, marker_std_m = np.full(26, np.radians(2.0)), np.full(len(hand.point), 1e-3)
    theta_std[:3] = 5e-4
    if guess:
        theta_std[DOF_NAMES.index("ring_dip_flexion")], marker_std_m[2] = np.radians(30.0), 9e-3
    return replace(hand, theta_std=theta_std, marker_std_m=marker_std_m)
