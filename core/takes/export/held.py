"""From when to when BVH and glTF hold a pose because there is none to show.

Neither knows a joint that is absent. A hand scaled to nothing while it is lost would be gone to the eye, but a program
that measures or retargets bones would get ones of length zero, and between two keys the hand would shrink and grow;
glTF's extension for what is seen and what is not (KHR_node_visibility) is read by few programs and animated by fewer.
So the pose is held, and the file or one beside it says where.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.frames import BoolArray
from core.takes.export.timeline import Timeline
from core.takes.holes import is_hole

REASONS = ("", "not found yet", "lost", "no frames")
"""Why a pose is held. "not found yet": the hand's first pose, before it was found. "lost": its last pose, while it is
not tracked. "no frames": its last pose, where the recording has no frame."""

_NOT_FOUND_YET, _LOST, _NO_FRAMES = 1, 2, 3


@dataclass(frozen=True)
class HeldSpan:
    """One stretch of time.

    from_s, to_s: when the first of its frames was due, and when the first after it came, or would have [s], as `time_s`
    elsewhere. first, last: its frames on the even grid, counted from 1, as in BVH. reason: one of REASONS.
    """

    from_s: float
    to_s: float
    first: int
    last: int
    reason: str

    def blended(self, rate_hz: float) -> bool:
        """Is it so short a lack of frames that formats with keys at the frames' own times (glTF) move on through it?"""
        around = np.array([self.from_s - 1.0 / rate_hz, self.to_s])
        return self.reason == REASONS[_NO_FRAMES] and not bool(is_hole(around, rate_hz)[0])


def held_spans(tracked: BoolArray, timeline: Timeline) -> tuple[HeldSpan, ...]:
    """Where one hand or prop stands still for want of a pose. tracked: (n,) bool, in each frame of the timeline."""
    if not tracked.any():
        return ()
    slot = np.arange(timeline.n_slots)
    frame = timeline.frame_at_slot()
    since = slot - timeline.slots[frame]  # 0 where there is a frame
    untracked = np.where(frame < int(np.argmax(tracked)), _NOT_FOUND_YET, _LOST)
    kind = np.where(tracked[frame], np.where(since > 0, _NO_FRAMES, 0), untracked)
    due_s = timeline.times_s[frame] + since / timeline.rate_hz
    starts = np.concatenate([[0], np.flatnonzero(np.diff(kind)) + 1])
    stops = np.append(starts[1:], len(slot))
    due_s = np.append(due_s, timeline.times_s[-1] + 1.0 / timeline.rate_hz)
    return tuple(
        HeldSpan(float(due_s[start]), float(due_s[stop]), int(start) + 1, int(stop), REASONS[kind[start]])
        for start, stop in zip(starts, stops, strict=True)
        if kind[start]
    )
