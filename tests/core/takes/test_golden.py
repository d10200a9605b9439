"""Takes of every version as they lie on people's disks: whatever changes here, these must read as they did.

Run as a module with a folder and names, this file writes golden takes; that is only right for what is new in the
format, beside those of before."""

from __future__ import annotations

import sys
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from core.frames import HandFrame, HandState, InertialFrame, MarkerFrame, PropFrame, RigidBody, Times, TrackedFrame
from core.profile import load_profile
from core.streams import ClockSample, StreamInfo
from core.takes import writer as writer_module
from core.takes.reader import open_take
from core.takes.take import Mark, StreamCounts, TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.core.takes.frames import SPECIAL, bits
from tests.data import ROOT

FOLDER = ROOT / "tests" / "golden" / "takes"
INFO = TakeInfo(
    "golden_001", "Åsa", datetime(2025, 3, 14, 15, 9, 26, tzinfo=UTC), 119.88, {"kind": "natnet"}, "a note\n", "A"
)
COUNTS = TakeCounts(12, 10, {"queue full": 2}, lost=3, rejected=1, solved=10)
N = 10


def numbers(i: int, *shape: int) -> NDArray[np.float64]:
    """Numbers that depend on nothing but IEEE arithmetic, among them every special one."""
    size = int(np.prod(shape))
    return np.where(np.arange(size) % 11 < len(SPECIAL), (np.arange(size) + i) / 7, np.resize(SPECIAL, size)).reshape(
        shape
    )


def raw_frame(i: int) -> MarkerFrame:
    bodies = (RigidBody(i, "Schläger", numbers(i, 3), numbers(i, 4), i % 2 == 0, SPECIAL[i % len(SPECIAL)].item()),)
    times = Times(float("nan"), 1000 + i / 120, 1000.25 + i / 120)
    return MarkerFrame(
        10**12 + i, times, numbers(i, 2 * i, 3), np.arange(2 * i) - i, numbers(i, 2 * i), bodies[: i % 2]
    )


def deviations(i: int, n: int) -> NDArray[np.float64]:
    """Standard deviations that single precision holds."""
    return numbers(i, n).astype(np.float32).astype(np.float64)


def solved_frame(i: int, deviations_kept: bool, prop_points_kept: bool, performers_kept: bool) -> TrackedFrame:
    """Of a take made before standard deviations, the points of props, or performers and the confidence of labels were
    kept, or after."""

    def unsure(n_markers: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if deviations_kept:
            return deviations(i, 26), deviations(i, n_markers)
        return np.full(26, np.nan), np.full(n_markers, np.nan)

    hands = (
        HandFrame("left", HandState.TRACKED, numbers(i, 26), numbers(i, 16, 4, 4), numbers(i, 5, 3), np.arange(5) - 1,
                  numbers(i, 5), *unsure(5), 1e-3 * i, 0.9),
        HandFrame("right", HandState.LOST, numbers(i, 26), numbers(-i, 16, 4, 4), numbers(i, 0, 3), np.arange(0),
                  numbers(i, 0), *unsure(0), float("nan")),
    )  # fmt: skip
    if performers_kept:
        hands = (
            replace(hands[0], label_confidence=deviations(i, 5)),
            replace(hands[1], performer=1, why="out of shape"),
        )
    props = (PropFrame("box", numbers(i, 4, 4), True),)
    if prop_points_kept:
        props = (replace(props[0], point=np.arange(4) - 1, rms_m=1e-4 * i, markers_world_m=numbers(i, 4, 3)),)
    return TrackedFrame(10**12 + i, raw_frame(i).times, hands[: i % 3], props[: i % 2], {"solve": i / 7, "label": 0.0})


def write(path: Path, sealed: bool, *kept: bool) -> None:
    writer_module.library_versions = lambda: {"python": "3.11"}
    layouts = ("schroeder6", "schroeder8") if kept[-1] else ("schroeder6",)
    writer = TakeWriter(path, INFO, [load_profile(layout) for layout in layouts])
    for i in range(N):
        writer.raw("", raw_frame(i))
        writer.solved(solved_frame(i, *kept))
    writer.mark(Mark(0.05, "clap"))
    if sealed:
        writer.seal(COUNTS)
    else:
        writer.close()


TAKES = {
    "v1_sealed": (True, False, False, False),
    "v1_unsealed": (False, False, False, False),
    "v1_deviations": (True, True, False, False),
    "v1_props": (True, True, True, False),
    "v2_performers": (True, True, True, True),
}
"""Whether each is sealed, and whether it holds standard deviations, the points of props, and two performers."""


@pytest.mark.parametrize("name", TAKES)
def test_a_golden_take(name: str) -> None:
    sealed, *kept = TAKES[name]
    with open_take(FOLDER / f"{name}.mcap") as take:
        assert take.complete and take.sealed == sealed
        assert take.info == INFO and take.marks == (Mark(0.05, "clap"),)
        assert take.counts == (COUNTS if sealed else None)
        layouts = [profile.layout.name for profile in take.profiles]
        assert take.profile.layout.name == "schroeder6" and layouts == ["schroeder6", "schroeder8"][: 1 + kept[-1]]
        assert bits(tuple(take.raw)) == bits(tuple(raw_frame(i) for i in range(N)))
        assert bits(tuple(take.solved)) == bits(tuple(solved_frame(i, *kept) for i in range(N)))
        assert verify(take.path).ok


STREAMS = (
    StreamInfo("neuron-1/left", "neuron", "Nöuron", "inertial", 59.94, rotations="sensor", bone_names=("Hand", "手"),
               sides=("left",), axes="Z up"),
    StreamInfo("natnet-1/markers", "natnet", "Motive 3.1", "markers", 119.88, "sight", "residual", clock_hz=1e7),
    StreamInfo("phasespace-1/markers", "phasespace", "Impulse", "markers", 960.0, "marker", "condition", axes="mm"),
)  # fmt: skip
STREAM_COUNTS = replace(
    COUNTS, late=2, repeated=1, untimed=3, length_s=0.5, first_s=0.25,
    others={"neuron-1/left": StreamCounts(6, 5, {"queue full": 1}, 2, 1, late=1),
            "phasespace-1/markers": StreamCounts(0, 0)},
)  # fmt: skip
STREAM_TAKES = {"v3_sealed": True, "v3_unsealed": False}


def bones(i: int) -> InertialFrame:
    some_known = (numbers(i, 2, 3), np.full((2, 3), np.nan))
    return InertialFrame(
        7 * i, Times(i / 60, 1000 + i / 60, 1000.25 + i / 60), ("Hand", "手"), numbers(i, 2, 4),
        (None, "left", "right")[i % 3], some_known[i % 2], some_known[(i + 1) % 2], numbers(-i, 2, 3),
        np.array([i % 5, 0], np.int8),
    )  # fmt: skip


def sample(i: int) -> ClockSample:
    return ClockSample(i / 7, 1000.0 + i, SPECIAL[i % len(SPECIAL)].item())


def timed(i: int) -> MarkerFrame:
    return replace(raw_frame(i), timecode=f"15:09:26:{i:02}")


def sourced(i: int) -> TrackedFrame:
    """Of streams, and of everything that a pose may say of where it is from."""
    frame = solved_frame(i, True, True, True)
    hands = tuple(
        replace(hand, angle_source=np.arange(20, dtype=np.int8) % 7, held_by="glove",
                marker_source=(np.arange(len(hand.point), dtype=np.int8) + 1) % 7)
        for hand in frame.hands
    )  # fmt: skip
    sources = (("natnet-1/markers", 10**12 + i), ("neuron-1/left", 7 * i))
    return replace(frame, hands=hands, at_host_s=1000.125 + i, of=sources)


def write_streams(path: Path, sealed: bool) -> None:
    writer_module.library_versions = lambda: {"python": "3.11"}
    cast = [load_profile(layout) for layout in ("schroeder6", "schroeder8")]
    writer = TakeWriter(path, INFO, cast, STREAMS, "natnet-1/markers")
    for i in range(N):
        if i % 2 == 0:
            writer.raw("neuron-1/left", bones(i // 2))
        writer.raw("natnet-1/markers", timed(i))
        writer.solved(sourced(i))
        if i % 4 == 0:
            writer.raw(STREAMS[i // 4].key, sample(i))
    writer.mark(Mark(0.05, "clap"))
    if sealed:
        writer.seal(STREAM_COUNTS)
    else:
        writer.close()


@pytest.mark.parametrize("name", STREAM_TAKES)
def test_a_golden_take_of_several_streams(name: str) -> None:
    with open_take(FOLDER / f"{name}.mcap") as take:
        assert take.complete and take.sealed == STREAM_TAKES[name] and take.info == INFO
        assert take.marks == (Mark(0.05, "clap"),) and take.counts == (STREAM_COUNTS if take.sealed else None)
        glove, optical, silent = STREAMS
        assert bits(tuple(one.info for one in take.streams.values())) == bits((optical, glove, silent))
        assert bits(tuple(take.raw)) == bits(tuple(map(timed, range(N))))
        assert bits(tuple(take.solved)) == bits(tuple(map(sourced, range(N))))
        assert bits(tuple(take.streams[glove.key].frames)) == bits(tuple(map(bones, range(N // 2))))
        assert [bits(tuple(take.streams[one.key].clock)) for one in STREAMS] == [
            bits((sample(4 * k),)) for k in range(3)
        ]
        assert len(take.streams[silent.key].frames) == 0
        assert verify(take.path).ok


if __name__ == "__main__":
    for name in sys.argv[2:]:
        target = Path(sys.argv[1]) / f"{name}.mcap"
        if name in STREAM_TAKES:
            write_streams(target, STREAM_TAKES[name])
        else:
            write(target, *TAKES[name])
