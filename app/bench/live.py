"""A labelled recording served as unlabelled points over loopback, received and solved live: labels, residual, loss."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np

from app.loopback import next_frame, served
from core.engine import Engine, warm_up
from core.errors import DeviceError
from core.frames import HandState, MarkerFrame, TrackedFrame
from core.motion.stream import LabelledFrame, MarkerStream, RecordingMotion
from core.profile import Profile, load_profile
from core.takes.formats import read_recording

QUIET_S = 3.0
"""No frame for so long: the recording is over."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument("--motion", metavar="FILE", type=Path, required=True, help="a recording with labels")
    parser.add_argument("--profile", metavar="P", required=True, help="profile or layout whose markers it names")
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="order of the points; default %(default)s")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """The server runs in its own process at the recording's rate, with all of the recording's markers."""
    recording = read_recording(arguments.motion)
    profile = load_profile(arguments.profile)
    stream = MarkerStream(RecordingMotion(recording), recording.rate_hz, arguments.seed, noise_m=0.0)
    truth = {sent.frame.sequence: sent for sent in stream.labelled()}
    warm_up()
    options = ["--once", "--motion", str(arguments.motion), "--noise", "0", "--seed", str(arguments.seed)]
    with served(options) as device:
        pairs, latency_s = _solve_live(device, profile)
        health = device.health()
    figures = _figures(profile, stream.labels, truth, pairs)
    figures |= {
        "sent": len(truth), "lost": health.lost, "rejected": health.rejected, "rate_hz": recording.rate_hz,
        "solved_after_median_s": float(np.median(latency_s)), "solved_after_p99_s": float(np.percentile(latency_s, 99)),
    }  # fmt: skip
    print(
        f"{figures['received']:,} of {figures['sent']:,} frames received at {recording.rate_hz:g} Hz, "
        f"{health.lost:,} lost\n"
        f"{100 * figures['labels_right']:.3f} % of {figures['labelled_points']:,} observed hand markers are right\n"
        f"tracked in {100 * figures['tracked']:.2f} % of frames, RMS {1e3 * figures['rms_m']:.2f} mm, "
        f"first pose {1e3 * figures['first_pose_s']:.0f} ms after the first frame\n"
        f"{figures['gaps_right_at_once']} of {figures['gaps']} gaps: the marker is right at its first sample after it; "
        f"the latest is right {figures['gaps_latest_frames']} frames later\n"
        f"exposure to pose: median {1e3 * figures['solved_after_median_s']:.2f} ms, "
        f"99 % below {1e3 * figures['solved_after_p99_s']:.2f} ms"
    )
    return figures


def _solve_live(device: Any, profile: Profile) -> tuple[list[tuple[MarkerFrame, TrackedFrame]], list[float]]:
    """Every frame as it comes, solved at once; and the time from exposure to pose [s]."""
    engine = Engine(profile)
    device.start()
    pairs: list[tuple[MarkerFrame, TrackedFrame]] = []
    latency_s: list[float] = []
    last = time.monotonic()
    while time.monotonic() - last < QUIET_S:
        frame = next_frame(device, 0.1)
        if frame is None:
            continue
        last = time.monotonic()
        pairs.append((frame, engine.step(frame)))
        latency_s.append(time.monotonic() - frame.times.host_s)
    if not pairs:
        raise DeviceError("No frame arrived.", device.health().reason)
    return pairs, latency_s


def _figures(
    profile: Profile,
    labels: tuple[str, ...],
    truth: dict[int, LabelledFrame],
    pairs: list[tuple[MarkerFrame, TrackedFrame]],
) -> dict[str, Any]:
    names = profile.layout.marker_names
    columns = [labels.index(name) for name in names]
    present = np.zeros((len(pairs), len(names)), dtype=np.bool_)
    right = np.zeros_like(present)
    tracked, squares, points, first = 0, 0.0, 0, float("nan")
    for i, (frame, solved) in enumerate(pairs):
        sent = truth[frame.sequence]
        row_of = {int(column): row for row, column in enumerate(sent.truth)}
        hand = max(solved.hands, key=lambda h: h.observed.sum())
        if hand.state is HandState.TRACKED:
            tracked += 1
            squares += int(hand.observed.sum()) * hand.rms_m**2
            points += int(hand.observed.sum())
            if np.isnan(first):
                first = frame.times.device_s - pairs[0][0].times.device_s
        for k, column in enumerate(columns):
            if column in row_of:
                present[i, k] = True
                # Points keep their order on the wire: the row sent is the row received.
                right[i, k] = hand.state is HandState.TRACKED and hand.point[k] == row_of[column]
    gaps = [(i, k) for k in range(len(names)) for i in np.flatnonzero(present[1:, k] & ~present[:-1, k]) + 1]
    late = [int(np.argmax(right[i:, k])) if right[i:, k].any() else len(pairs) for i, k in gaps]
    return {
        "received": len(pairs),
        "labelled_points": int(present.sum()),
        "labels_right": float(right.sum() / max(present.sum(), 1)),
        "tracked": tracked / len(pairs),
        "rms_m": float(np.sqrt(squares / max(points, 1))),
        "first_pose_s": first,
        "gaps": len(gaps),
        "gaps_right_at_once": late.count(0),
        "gaps_latest_frames": max(late, default=0),
    }
