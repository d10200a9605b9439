"""`phalanx simulate` and `phalanx bench`: real servers on loopback."""

from __future__ import annotations

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from app.commands import simulate
from app.commands.motion_options import motion_of
from app.loopback import next_frame
from core.engine import Engine
from core.errors import PhalanxError
from core.motion.activities import ACTIVITIES
from core.motion.performer import Performer
from core.profile import load_profile
from devices.natnet.client import NatNetDevice
from tests.app.command import phalanx, serving


def frames_of(ports: tuple[int, int], n: int) -> list[object]:
    device = NatNetDevice(command_port=ports[0], data_port=ports[1])
    device.open()
    try:
        device.start()
        frames = []
        for _ in range(20 * n):
            frame = next_frame(device, 0.1)
            if frame is not None:
                frames.append(frame)
            if len(frames) == n:
                break
        return frames
    finally:
        device.stop()
        device.close()


def test_the_performer_is_served_on_the_wire() -> None:
    with serving("--motion", "demo", "--profile", "schroeder8", "--bitstream", "3.0", "--bodies", 1) as ports:
        frames = frames_of(ports, 30)
    assert len(frames) == 30
    assert all(len(frame.points_m) >= 16 for frame in frames)  # two hands of eight, four of the body
    assert all(len(frame.rigid_bodies) == 1 for frame in frames)
    assert frames[-1].rigid_bodies[0].name == "body1"  # names follow the first frames, when the client has asked


def test_the_performer_does_what_is_asked(tmp_path: Path) -> None:
    with serving("--motion", "demo", "--profile", "schroeder8", "--activity", "counting", "--seed", 4) as ports:
        frames = frames_of(ports, 10)
    expected = Performer(load_profile("schroeder8"), 4, "counting").at(frames[-1].sequence / 120.0)
    marker = expected.markers_world_m["right"][0]
    assert np.linalg.norm(frames[-1].points_m - marker, axis=1).min() < 0.002
    unknown = phalanx("simulate", "natnet", "--activity", "juggling")
    assert unknown.code == 1
    assert "No activity 'juggling'" in unknown.err and all(name in unknown.err for name in ACTIVITIES)
    refused = phalanx("simulate", "natnet", "--motion", tmp_path / "a.trc", "--activity", "piano")
    assert refused.code == 1
    assert "is for the built-in performer" in refused.err
    assert all(name in phalanx("simulate", "natnet", "--help").out for name in ACTIVITIES)


def test_what_the_performer_handles_is_served_with_a_profile_to_track_it_by(tmp_path: Path) -> None:
    profile = tmp_path / "things.json"
    with serving("--motion", "demo", "--activity", "grasping", "--seed", 1, "--props", profile) as ports:
        frames = frames_of(ports, 40)
    worn = load_profile(profile)
    assert len(worn.props) == 3 and all(len(frame.points_m) == 2 * 19 + 3 * 5 for frame in frames)
    engine = Engine(worn)
    for frame in frames:
        solved = engine.step(frame)
    truth = Performer(load_profile("han19"), 1, "grasping").props_world(frames[-1].sequence / 120.0)
    assert [prop.name for prop in solved.props] == list(truth)
    for prop in solved.props:
        assert prop.tracked and (prop.point >= 0).all()
        np.testing.assert_allclose(prop.transform_world, truth[prop.name], atol=0.01)
        np.testing.assert_allclose(prop.transform_world[:3, 3], truth[prop.name][:3, 3], atol=0.001)
    empty = phalanx("simulate", "natnet", "--activity", "piano", "--props", profile)
    assert empty.code == 1 and "handles nothing in the activity 'piano'" in empty.err
    refused = phalanx("simulate", "natnet", "--motion", tmp_path / "a.trc", "--props", profile)
    assert refused.code == 1 and "--props is for the built-in performer" in refused.err


def test_unlabelled_points_are_served_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    rows = [f"{f},{f / 50},{100 + f + p},{0.1 * p},{1.0 + 0.01 * f},0.25" for f in range(5) for p in range(3)]
    path.write_text("frame,time_s,id,x_m,y_m,z_m\n" + "\n".join(rows) + "\n")
    with serving("--motion", path) as ports:
        frames = frames_of(ports, 8)
    heights = [round(float(frame.points_m[0, 1]), 3) for frame in frames]
    assert {round(b - a, 3) for a, b in pairwise(heights)} <= {0.01, -0.04}
    assert all(len(frame.points_m) == 3 for frame in frames)
    refused = phalanx("simulate", "natnet", "--motion", path, "--ghosts", 1)
    assert refused.code == 1
    assert "without labels" in refused.err


def test_once_ends_with_the_recording(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("frame,time_s,id,x_m,y_m,z_m\n" + "".join(f"{f},{f / 50},1,0,1,0\n" for f in range(10)))
    ran = phalanx("simulate", "natnet", "--motion", path, "--once", "--command-port", 0, "--data-port", 0, "--json")
    assert ran.code == 0
    assert ran.figures["sent"] == 10
    assert ran.figures["rate_hz"] == pytest.approx(50)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--rate", "0"], "0"),
        (["--rate", "1e9"], "1000000000"),
        (["--hide", "2"], "2.0"),
        (["--ghosts", "-1"], "-1"),
        (["--bitstream", "nine"], "nine"),
        (["--bitstream", "9.9"], "9.9"),
        (["--host", "203.0.113.7"], "203.0.113.7"),
        (["--motion", "absent.trc"], "absent.trc"),
        (["--profile", "no-such-layout"], "no-such-layout"),
    ],
)
def test_what_cannot_be_served_is_said(words: list[str], said: str) -> None:
    ran = phalanx("simulate", "natnet", "--command-port", 0, "--data-port", 0, *words)
    assert ran.code == 1
    assert said in ran.err
    assert len(ran.err.splitlines()) == 1


def test_a_port_in_use_is_said() -> None:
    with serving() as (command_port, _):
        ran = phalanx("simulate", "natnet", "--command-port", command_port, "--data-port", 0)
    assert ran.code == 1
    assert f"Port {command_port}" in ran.err


def test_bench_receive_counts_every_frame() -> None:
    ran = phalanx("bench", "receive", "--seconds", 1, "--json")
    assert ran.code == 0, ran.err
    assert ran.figures["lost"] == 0
    assert ran.figures["received"] > 0
    assert 0 < ran.figures["latency_median_s"] <= ran.figures["latency_p99_s"] <= ran.figures["latency_max_s"]


def test_a_profile_for_each_performer_puts_them_side_by_side():
    parser = argparse.ArgumentParser()
    simulate.add(parser.add_subparsers())
    words = ["simulate", "natnet", "--profile", "han19", "--profile", "qualisys13", "--seed", "4"]
    motion = motion_of(parser.parse_args(words))
    assert motion.title == "2 performers with han19 and qualisys13"
    first = next(iter(motion.frames))
    assert len(first.points_m) == 2 * 19 + 13
    left, right = first.points_m[first.points_m[:, 0] < 0], first.points_m[first.points_m[:, 0] > 0]
    assert (len(left), len(right)) == (38, 13)
    with pytest.raises(PhalanxError, match="--props is for one performer"):
        motion_of(parser.parse_args([*words, "--activity", "everyday", "--props", "things.json"]))
