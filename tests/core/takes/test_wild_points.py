"""Points in a take that are none: a device may send anything, and it is recorded as it came."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from core.frames import NO_ID, NO_POINT, HandState, MarkerFrame, Times, TrackedFrame
from core.gaps import Gaps
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile, load_profile
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.reprocess import relabelled, solve
from core.takes.take import TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.data import case_path

N, RATE_HZ = 120, 100.0
WILD = [[9_999_999.0, 9_999_999.0, 9_999_999.0], [0.0, 0.0, 0.0], [np.nan, 0.1, 0.2]]


@pytest.fixture(scope="module")
def worn() -> Profile:
    return load_profile("han19").with_sides(("right",))


def with_wild_points(frame: MarkerFrame, i: int, ids: bool) -> MarkerFrame:
    """In every third frame one marker jumps beyond the world, and points that are none come before all others."""
    points, own = frame.points_m.copy(), frame.ids if ids else np.full(len(frame.ids), NO_ID)
    if i % 3 == 0:
        points[i % len(points)] = WILD[0]
        points, own = np.vstack([WILD, points]), np.append([9001, 9002, 9003] if ids else [NO_ID] * 3, own)
    t = i / RATE_HZ
    return replace(
        frame, sequence=i, times=Times(t, t, t), points_m=points, ids=own.astype(np.int64),
        residuals_m=np.full(len(points), np.nan),
    )  # fmt: skip


def write(path: Path, worn: Profile, ids: bool = True) -> Path:
    stream = MarkerStream(Performer(worn, seed=4), RATE_HZ, 4)
    writer = TakeWriter(path, TakeInfo(path.stem, rate_hz=RATE_HZ), worn)
    for i, frame in enumerate(islice(stream.frames(), 200, 200 + N)):
        writer.raw("", with_wild_points(frame, i, ids))
    writer.seal(TakeCounts(N, N))
    return path


def seen(frame: MarkerFrame, hands: TrackedFrame) -> list[object]:
    """Poses to the bit, and which point each marker is, by its place."""
    return [
        (
            hand.side, hand.state, hand.theta_rad.tobytes(), hand.joints_world.tobytes(),
            [None if row == NO_POINT else frame.points_m[row].tobytes() for row in hand.point],
        )
        for hand in hands.hands
    ]  # fmt: skip


@pytest.mark.parametrize("ids", [True, False])
@pytest.mark.parametrize("way", [solve, relabelled])
def test_raw_frames_and_the_recording_of_them_give_the_same_poses(
    tmp_path: Path, worn: Profile, way: Callable[..., Sequence[TrackedFrame]], ids: bool
) -> None:
    path = write(tmp_path / "take.mcap", worn, ids)
    recording = list(read_recording(path).frames())
    with open_take(path) as take:
        raw = list(take.raw)
    assert [len(a.ids) - len(b.ids) for a, b in zip(raw, recording, strict=True)] == [4, 0, 0] * (N // 3)
    as_raw, as_recording = way(raw, worn), way(recording, worn)
    assert [seen(*pair) for pair in zip(raw, as_raw, strict=True)] == [
        seen(*pair) for pair in zip(recording, as_recording, strict=True)
    ]
    tracked = sum(frame.hands[0].state is HandState.TRACKED for frame in as_raw)
    assert tracked == N


def test_they_are_counted_and_said(tmp_path: Path, worn: Profile) -> None:
    path = write(tmp_path / "take.mcap", worn)
    recording = read_recording(path)
    third = N // 3
    assert recording.gaps == Gaps(absent=third, zero=third, far=2 * third)
    (warning,) = recording.warnings
    assert warning.startswith(f"{2 * third} points lie beyond 1000 m and are left out as gaps, the first in frame 1: ")
    report = verify(path)
    assert report.ok and report.gaps == recording.gaps
    assert report.points == int((~np.isnan(recording.points_m[:, :, 0])).sum())
    assert [finding.text for finding in report.findings if finding.level == "warning"] == [
        f"{4 * third} gaps ({third} at 0 0 0, {2 * third} beyond 1000 m) among its raw points, "
        f"{400 * third / (4 * third + report.points):.1f} %: none of them is used."
    ]


def test_one_wild_point_of_a_live_take_refuses_nothing() -> None:
    path = case_path("files", "06-one-wild-point-refuses-all", "nat_nanpts.mcap")
    recording = read_recording(path)
    assert (recording.n_frames, recording.gaps) == (598, Gaps(far=180))
    assert not (np.abs(recording.points_m) > 1000.0).any()
    (warning,) = recording.warnings
    assert warning == (
        "180 points lie beyond 1000 m and are left out as gaps, the first in frame 4: point 4 at x = 1e+07 m."
    )
    report = verify(path)
    assert report.ok
    assert any(finding.level == "warning" and "180 gaps beyond 1000 m" in finding.text for finding in report.findings)
