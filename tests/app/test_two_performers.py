"""Two performers from the wire to the exports: streamed, tracked live, recorded, read again, solved again, exported."""

from __future__ import annotations

import csv
import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from app.commands.result import Exit
from app.notifications import Severity
from app.session import Session
from core.cast import hands_of
from core.errors import PhalanxError
from core.frames import HandState
from core.hand.sizes import SIZES
from core.motion.company import Company
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile, load_profile, save_profile
from core.takes.export import FORMATS, export
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.reprocess import solve
from core.takes.solution import Solution
from core.takes.take import TakeInfo
from core.takes.verify import verify
from devices.natnet.client import NatNetDevice
from devices.natnet.simulator import NatNetSimulator
from tests.app.stage import settings_for, until

RATE_HZ = 30.0
N_FRAMES = 300


def performer(name: str, size: str) -> Profile:
    return replace(load_profile("han19"), performer=name, shape=SIZES[size], scale=1.0)


ANN, BEN = performer("Ann", "XL"), performer("Ben", "S")


@pytest.fixture(scope="module")
def company() -> Company:
    return Company([Performer(ANN, 1), Performer(BEN, 12)])


@pytest.fixture(scope="module")
def take_path(company: Company, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some two seconds of both, received over the wire and recorded while they were tracked."""
    path = tmp_path_factory.mktemp("takes") / "duet.mcap"
    stream = MarkerStream(company, RATE_HZ, 1, hidden=0.03, ghosts=0.5)
    frames = tuple(itertools.islice(stream.frames(), N_FRAMES))
    session = Session((ANN, BEN), warm_up=lambda: None)  # the first frames do that here
    with NatNetSimulator(frames, RATE_HZ, command_port=0, data_port=0, loop=True, name="Duet") as simulator:
        simulator.start()
        try:
            session.start()
            session.wait_ready()
            session.connect(session.add_device(NatNetDevice, settings_for(simulator)))
            until(lambda: four_tracked(session), "all four hands")
            session.start_recording(path, TakeInfo("duet", "Ann and Ben", rate_hz=RATE_HZ))
            with pytest.raises(PhalanxError, match="locked while a take is recorded"):
                session.set_profiles((ANN,))
            until(lambda: (r := session.numbers().recording) and r.solved >= 60, "frames in the take")
            assert session.trail.view(10.0).hands == hands_of((ANN, BEN))
            assert np.isfinite(session.trail.view(10.0).rms_m).any(axis=0).all()
            assert session.stop_recording().result(120.0).sealed
            assert not [note for note in session.notifications.history if note.severity is Severity.PROBLEM]
        finally:
            session.close()
    return path


def four_tracked(session: Session) -> bool:
    latest = session.latest.peek()
    hands = latest.solved.hands if latest is not None else ()
    return len(hands) == 4 and all(hand.state is HandState.TRACKED for hand in hands)


def test_the_take_holds_both_and_everybody_is_where_he_stands(company: Company, take_path: Path) -> None:
    assert verify(take_path).ok
    with open_take(take_path) as take:
        assert [profile.to_json() for profile in take.profiles] == [ANN.to_json(), BEN.to_json()]
        frames = [frame for frame in take.solved if all(hand.state is HandState.TRACKED for hand in frame.hands)]
        assert len(frames) > 0.9 * len(take.solved) > 50
    off_m = []
    for frame in frames:
        assert [hand.key for hand in frame.hands] == [(0, "left"), (0, "right"), (1, "left"), (1, "right")]
        truth = [one.at((frame.sequence % N_FRAMES) / RATE_HZ) for one in company.performers]
        for hand in frame.hands:
            wrist_m = truth[hand.performer].joints_world[hand.side][0, :3, 3] + company.places_m[hand.performer]
            off_m.append(np.linalg.norm(hand.joints_world[0, :3, 3] - wrist_m))
            assert hand.scale == 1.0
    # A busy machine leaves frames out, after which a pose may take a frame to settle; nobody is ever another.
    assert np.median(off_m) < 0.002 and max(off_m) < 0.1


def test_solved_again_each_is_himself(take_path: Path) -> None:
    with open_take(take_path) as take:
        solved = solve(list(take.raw)[:40], take.profiles)
        recorded = {frame.sequence: frame for frame in take.solved}
    assert len(solved) == 40
    for frame in solved[20:]:
        assert len(frame.hands) == 4
        for hand, before in zip(frame.hands, recorded[frame.sequence].hands, strict=True):
            assert hand.key == before.key and hand.state is HandState.TRACKED
            assert np.abs(hand.joints_world[:, :3, 3] - before.joints_world[:, :3, 3]).max() < 0.005


def test_every_export_names_both(take_path: Path, tmp_path: Path) -> None:
    with open_take(take_path) as take:
        paths = export(Solution.of_take(take), list(FORMATS), tmp_path)
        n = len(take.solved)
    assert [path.name for path in paths] == [
        "duet.c3d", "duet.trc", "markers.csv", "angles.csv", "joints.csv", "points.csv", "duet_Ann_left.bvh",
        "duet_Ann_right.bvh", "duet_Ben_left.bvh", "duet_Ben_right.bvh", "duet.glb",
    ]  # fmt: skip
    assert {label.partition("_")[0] for label in read_recording(tmp_path / "duet.c3d").labels} == {
        "Ann:L", "Ann:R", "Ben:L", "Ben:R",
    }  # fmt: skip
    with (tmp_path / "angles.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 4 * n
    assert [(row["performer"], row["hand"]) for row in rows[:4]] == [
        ("Ann", "left"), ("Ann", "right"), ("Ben", "left"), ("Ben", "right"),
    ]  # fmt: skip


def test_what_the_command_line_makes_of_both(
    take_path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file with labels is tracked as they say whose each is; and `info` knows who is in a take."""
    for profile in (ANN, BEN):
        save_profile(profile, tmp_path / f"{profile.performer}.json")
    with open_take(take_path) as take:
        export(Solution.of_take(take), ["c3d"], tmp_path)
    profiles = [word for name in ("Ann", "Ben") for word in ("--profile", str(tmp_path / f"{name}.json"))]
    assert main(["track", str(tmp_path / "duet.c3d"), *profiles, "--out", str(tmp_path / "out"), "--json"]) == Exit.DONE
    (found,) = json.loads(capsys.readouterr().out.splitlines()[-1])["files"]
    assert list(found["hands"]) == ["Ann left", "Ann right", "Ben left", "Ben right"]
    assert found["labels_given"] and found["labels_right"] is None and found["losses"] == []
    assert all(hand["rms_m"] < 0.001 for hand in found["hands"].values())
    with (tmp_path / "out" / "duet" / "joints.csv").open() as stream:
        assert {row["performer"] for row in csv.DictReader(stream)} == {"Ann", "Ben"}
    assert main(["info", str(take_path), "--json"]) == Exit.DONE
    told = capsys.readouterr().out
    assert "han19, left and right hands of Ben" in told
    performers = json.loads(told.splitlines()[-1])["performers"]
    assert [(one["name"], one["layout"]) for one in performers] == [("Ann", "han19"), ("Ben", "han19")]


@pytest.mark.parametrize("command", [("calibrate", "hand"), ("subspace",)])
def test_what_is_of_one_performer_asks_which(
    take_path: Path, tmp_path: Path, command: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*command, str(take_path), "--out", str(tmp_path / "out.json")]) == Exit.FAILED
    told = capsys.readouterr().err
    assert "duet.mcap holds the hands of 2 performers" in told and "Give --profile" in told
    assert not list(tmp_path.iterdir())
