"""What moment of a take is shown, and how that moves: play, speed, loop, in and out. Knows no window."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from core.frames import FloatArray

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)


class Player:
    """A playhead over the frames of a take.

    The range from `in_frame` to `out_frame`, both included, is what plays and loops; scrubbing may leave it.
    Every change calls the subscribers once. start_s, end_s: of the recording [s], with or without frames.
    """

    def __init__(self, times_s: FloatArray | None = None) -> None:
        self._subscribers: list[Callable[[], None]] = []
        self.playing = False
        self.speed = 1.0
        self.loop = False
        self.load(np.empty(0) if times_s is None else times_s)

    def load(self, times_s: FloatArray, span_s: tuple[float, float] | None = None) -> None:
        """Another take: times_s (n,) float64 [s]; a clock that steps back stands still here. span_s: when its recording
        began and ended, where that was before its first frame and after its last. Stops at frame 0."""
        self.times_s: FloatArray = np.maximum.accumulate(times_s) if len(times_s) else np.empty(0)
        first_s, last_s = (float(self.times_s[0]), float(self.times_s[-1])) if len(times_s) else (0.0, 0.0)
        begin_s, end_s = span_s or (first_s, last_s)
        self.start_s, self.end_s = min(begin_s, first_s), max(end_s, last_s)
        self.playing = False
        self.frame = 0
        self.in_frame, self.out_frame = 0, max(len(times_s) - 1, 0)
        self._time_s = float(self.times_s[0]) if len(times_s) else 0.0
        self._changed()

    def subscribe(self, subscriber: Callable[[], None]) -> None:
        """Call `subscriber` after every change."""
        self._subscribers.append(subscriber)

    @property
    def n_frames(self) -> int:
        """Frames in the take."""
        return len(self.times_s)

    @property
    def time_s(self) -> float:
        """Where the playhead is [s], as the take counts."""
        return self._time_s

    @property
    def ranged(self) -> bool:
        """Whether in and out leave anything out."""
        return self.in_frame > 0 or self.out_frame < self.n_frames - 1

    def frame_at(self, time_s: float) -> int:
        """The last frame not after `time_s`, within the take."""
        if not self.n_frames:
            return 0
        found = int(np.searchsorted(self.times_s, time_s + 1e-9, side="right")) - 1
        return min(max(found, 0), self.n_frames - 1)

    # moving

    def advance(self, dt_s: float) -> None:
        """`dt_s` of the watcher's time has passed [s]."""
        if not self.playing or dt_s <= 0:
            return
        last_s = float(self.times_s[self.out_frame])
        time_s = self._time_s + dt_s * self.speed
        if time_s < last_s:
            self._go(time_s)
            return
        first_s = float(self.times_s[self.in_frame])
        if self.loop and last_s > first_s:
            self._go(first_s + (time_s - last_s) % (last_s - first_s))
        else:
            self.playing = False
            self._go(last_s)

    def play(self) -> None:
        """Play from here; from the in point if the playhead is at the out point or outside the range."""
        if not self.n_frames:
            return
        self.playing = True
        if not self.in_frame <= self.frame < self.out_frame:
            self._go(float(self.times_s[self.in_frame]))
        else:
            self._changed()

    def pause(self) -> None:
        """Stop here."""
        self.playing = False
        self._changed()

    def toggle(self) -> None:
        """Play or pause."""
        if self.playing:
            self.pause()
        else:
            self.play()

    def seek_time(self, time_s: float) -> None:
        """Move the playhead to a time [s], within the take."""
        self._go(min(max(time_s, self.start_s), self.end_s))

    def seek_frame(self, frame: int) -> None:
        """Move the playhead to a frame, within the take."""
        if self.n_frames:
            frame = min(max(frame, 0), self.n_frames - 1)
            self._time_s = float(self.times_s[frame])
            self.frame = frame
            self._changed()

    def step(self, frames: int) -> None:
        """Pause, and move by so many frames; from a place without frames to the next one that way."""
        self.playing = False
        before_first = bool(self.n_frames) and self._time_s < float(self.times_s[0])
        after_last = bool(self.n_frames) and self._time_s > float(self.times_s[-1])
        if (frames > 0 and after_last) or (frames < 0 and before_first):
            self._changed()
            return
        self.seek_frame(self.frame + frames - before_first)

    def go_to_start(self) -> None:
        """To the first frame."""
        self.seek_frame(0)

    def go_to_end(self) -> None:
        """To the last frame."""
        self.seek_frame(self.n_frames - 1)

    def go_to_in(self) -> None:
        """To the in point."""
        self.seek_frame(self.in_frame)

    def go_to_out(self) -> None:
        """To the out point."""
        self.seek_frame(self.out_frame)

    # range, speed, loop

    def set_range(self, in_frame: int, out_frame: int) -> None:
        """Set in and out, in either order, within the take."""
        low, high = sorted((in_frame, out_frame))
        last = max(self.n_frames - 1, 0)
        self.in_frame, self.out_frame = min(max(low, 0), last), min(max(high, 0), last)
        self._changed()

    def set_in(self) -> None:
        """In is here; an out point before it goes to the end."""
        self.set_range(self.frame, self.out_frame if self.out_frame >= self.frame else self.n_frames - 1)

    def set_out(self) -> None:
        """Out is here; an in point after it goes to the start."""
        self.set_range(self.in_frame if self.in_frame <= self.frame else 0, self.frame)

    def clear_range(self) -> None:
        """The whole take."""
        self.set_range(0, self.n_frames - 1)

    def set_speed(self, speed: float) -> None:
        """Times the rate at which the take was recorded, 0.1 to 4."""
        self.speed = min(max(speed, SPEEDS[0]), SPEEDS[-1])
        self._changed()

    def set_loop(self, loop: bool) -> None:
        """Begin again at the in point instead of stopping at the out point."""
        self.loop = loop
        self._changed()

    def _go(self, time_s: float) -> None:
        self._time_s = time_s
        self.frame = self.frame_at(time_s)
        self._changed()

    def _changed(self) -> None:
        for subscriber in self._subscribers:
            subscriber()
