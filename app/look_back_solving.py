"""Poses of frames that are in memory, by an engine in a process of its own: that of the live view is not disturbed."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection
from typing import Any

from app.work_process import heard, serve_work, tell, work_process
from core.cast import Cast
from core.engine import Engine
from core.errors import CancelledError, PhalanxError
from core.frames import MarkerFrame, TrackedFrame
from core.profile import Profile
from core.takes.codec import decode_raw, decode_solved, encode_raw, encode_solved

LOG = logging.getLogger("phalanx")

_BATCH = 32  # frames that go over together: whoever answers has read all of them, so that nobody waits for the other
_LOOK_S = 0.1
_TASK = "solve what just happened"
_ACTION = "Every frame is in the take: solve it again in review."


def solved_beside(
    frames: Sequence[MarkerFrame], cast: Cast, stopped: Callable[[], bool]
) -> Iterator[TrackedFrame | None]:
    """The pose of each frame, in order, as a live engine gives that begins with the first of them; None where it fails.

    Raises PhalanxError if the engine cannot begin or its process breaks down, and CancelledError once `stopped`. The
    process has ended in every case.
    """
    if not frames:
        return
    with work_process(_serve, ([profile.to_json() for profile in cast],), "phalanx-look-back", _TASK, _ACTION) as line:
        _wait(line, stopped)
        for first in range(0, len(frames), _BATCH):
            batch = frames[first : first + _BATCH]
            _send(line, batch)
            _wait(line, stopped)
            for _ in batch:
                data = line.recv_bytes()
                yield decode_solved(data) if data else None


def _send(line: Connection, batch: Sequence[MarkerFrame]) -> None:
    """Raises EOFError where the process has ended."""
    try:
        tell(line, {"frames": len(batch)})
        for frame in batch:
            line.send_bytes(encode_raw(frame))
    except BrokenPipeError as error:
        raise EOFError from error


def _wait(line: Connection, stopped: Callable[[], bool]) -> None:
    """Until the process has an answer. Raises EOFError where it has ended."""
    while not stopped():
        if line.poll(_LOOK_S):
            told = heard(line)
            if "what" in told:
                raise PhalanxError(told["what"], told["action"])
            return
    raise CancelledError


# In the other process.


def _serve(profiles: list[str], line: Connection) -> None:
    serve_work(_TASK, lambda: _solve(profiles, line), line)


def _solve(profiles: list[str], line: Connection) -> dict[str, Any]:
    try:
        engine = Engine([Profile.from_json(profile, "A profile in use") for profile in profiles])
    except PhalanxError as error:
        return {"what": error.what, "action": error.action}
    tell(line, {})
    try:
        while True:
            batch = [decode_raw(line.recv_bytes()) for _ in range(heard(line)["frames"])]
            solved = [_step(engine, frame) for frame in batch]
            tell(line, {})
            for data in solved:
                line.send_bytes(data)
    except EOFError:  # who asked has gone
        return {}


def _step(engine: Engine, frame: MarkerFrame) -> bytes:
    """The pose; nothing where the engine fails, which then begins anew, as a live one does."""
    try:
        return encode_solved(engine.step(frame))
    except Exception:
        LOG.exception("Solving frame %d of what just happened", frame.sequence)
        engine.reset()
        return b""
