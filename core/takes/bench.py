"""How fast takes are written and read on this disk."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from core.frames import SIDES, HandFrame, HandState, MarkerFrame, Times, TrackedFrame
from core.hand.skeleton import DOF_NAMES, JOINT_NAMES
from core.profile import load_profile
from core.takes.reader import open_take
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter

POINTS, MARKERS = 40, 19


@dataclass(frozen=True)
class TakeBenchmark:
    """Of a take of two hands in 40 points, at 120 Hz, raw and solved.

    records_per_s: written through to the system, in a row. write_p99_s: for one raw and one solved frame [s].
    bytes_per_frame: raw and solved, as recorded and sealed. access_s: median for one solved frame at random [s].
    """

    frames: int
    records_per_s: float
    write_p99_s: float
    bytes_per_frame: float
    bytes_per_frame_sealed: float
    seal_s: float
    open_unsealed_s: float
    open_sealed_s: float
    access_s: float


def bench_take(frames: int = 2400, folder: Path | str | None = None) -> TakeBenchmark:
    """Records a take into a temporary folder inside `folder`, seals and reads it. Raises TakeError."""
    rng = np.random.default_rng(0)
    raw, solved = zip(*(_frame(i, rng) for i in range(frames)), strict=True)
    with tempfile.TemporaryDirectory(dir=folder) as place:
        writer = TakeWriter(Path(place) / "bench.mcap", TakeInfo("bench", rate_hz=120), load_profile("han19"))
        before, took = writer.bytes_written, np.empty(frames)
        for i in range(frames):
            start = perf_counter()
            writer.raw("", raw[i])
            writer.solved(solved[i])
            took[i] = perf_counter() - start
        recorded = writer.bytes_written - before
        open_unsealed_s = _open_s(writer.path)
        start = perf_counter()
        writer.seal(TakeCounts(frames, frames, solved=frames))
        seal_s = perf_counter() - start
        open_sealed_s = _open_s(writer.path)
        with open_take(writer.path) as take:
            access = np.empty(min(frames, 500))
            for k, i in enumerate(rng.integers(0, frames, len(access))):
                start = perf_counter()
                take.solved[int(i)]
                access[k] = perf_counter() - start
        return TakeBenchmark(
            frames=frames,
            records_per_s=2 * frames / float(took.sum()),
            write_p99_s=float(np.percentile(took, 99)),
            bytes_per_frame=recorded / frames,
            bytes_per_frame_sealed=writer.path.stat().st_size / frames,
            seal_s=seal_s,
            open_unsealed_s=open_unsealed_s,
            open_sealed_s=open_sealed_s,
            access_s=float(np.median(access)),
        )


def _open_s(path: Path) -> float:
    start = perf_counter()
    open_take(path).close()
    return perf_counter() - start


def _frame(i: int, rng: np.random.Generator) -> tuple[MarkerFrame, TrackedFrame]:
    """A slow motion with the noise of a real system, in single precision as systems send it."""
    t = i / 120
    times = Times(t, t, t + 0.004)
    wave = 0.1 * np.sin(t + np.arange(3 * POINTS)).reshape(POINTS, 3)
    points = (wave + rng.normal(0, 1e-4, (POINTS, 3))).astype(np.float32).astype(np.float64)
    raw = MarkerFrame(i, times, points, np.arange(POINTS), np.full(POINTS, 2e-4))
    joints = np.tile(np.eye(4), (len(JOINT_NAMES), 1, 1))
    joints[:, :3] += rng.normal(0, 1e-4, (len(JOINT_NAMES), 3, 4))
    hands = tuple(
        HandFrame(
            side=side,
            state=HandState.TRACKED,
            theta_rad=rng.normal(size=len(DOF_NAMES)),
            joints_world=joints,
            markers_world_m=points[k * MARKERS : (k + 1) * MARKERS],
            point=np.arange(MARKERS),
            confidence=np.ones(MARKERS),
            theta_std=np.abs(rng.normal(0.02, 0.01, len(DOF_NAMES))),
            marker_std_m=np.abs(rng.normal(2e-3, 1e-3, MARKERS)),
            rms_m=1e-3,
            label_confidence=rng.uniform(0.9, 1.0, MARKERS),
        )
        for k, side in enumerate(SIDES)
    )
    return raw, TrackedFrame(i, times, hands, (), {"cluster": 1e-4, "label": 1e-4, "solve": 2e-4})
