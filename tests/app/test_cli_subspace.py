"""`phalanx subspace`: takes and recordings give a subspace that serves their performer better than the generic one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from core.engine import Engine
from core.motion.performer import PERIOD_S, Performer
from core.motion.stream import MarkerStream
from core.motion.subspace import load_subspace, shipped_subspace
from core.profile import Profile, load_profile
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.app.command import phalanx

RATE_HZ = 30.0
ACTIVITY, PERSON = "counting", 5
LEARNT_SEED, UNSEEN_SEED = 10, 20  # two minutes in which the same person counts on the fingers


@pytest.fixture(scope="module")
def worn() -> Profile:
    return replace(load_profile("han19"), sides=("right",), scale=1.0, performer="Ada")


@pytest.fixture(scope="module")
def take(worn: Profile, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A minute of the performer, some markers hidden, captured and solved."""
    path = tmp_path_factory.mktemp("takes") / "ada.mcap"
    performer = Performer(worn, LEARNT_SEED, ACTIVITY, PERSON)
    stream = MarkerStream(performer, RATE_HZ, 1, hidden=0.05)
    writer = TakeWriter(path, TakeInfo("ada", "Ada", rate_hz=RATE_HZ), worn)
    engine, n = Engine(worn), round(PERIOD_S * RATE_HZ)
    for frame in islice(stream.frames(), n):
        writer.raw("", frame)
        writer.solved(engine.step(frame))
    writer.seal(TakeCounts(n, n, solved=n))
    return path


@pytest.fixture(scope="module")
def unseen(worn: Profile) -> np.ndarray:
    """The performer's true postures in another minute."""
    performer = Performer(worn, UNSEEN_SEED, ACTIVITY, PERSON)
    return np.stack([performer.theta("right", t)[6:] for t in np.arange(0.0, PERIOD_S, 0.05)])


def test_a_performer_s_own_subspace_serves_better_than_the_generic_one(
    take: Path, unseen: np.ndarray, worn: Profile, tmp_path: Path
) -> None:
    out, profile = tmp_path / "ada.json", tmp_path / "profile.json"
    ran = phalanx("subspace", take, "--out", out, "--dimensions", 5, "--write-profile", profile, "--json")
    assert ran.code == 0, ran.err
    own, generic = load_subspace(out), shipped_subspace("generic").truncated(5)
    errors = [np.sqrt(np.mean((subspace.nearest(unseen) - unseen) ** 2)) for subspace in (own, generic)]
    assert errors[0] < 0.85 * errors[1]
    figures = ran.figures
    assert (figures["name"], figures["dimensions"]) == ("ada", own.dimensions) == ("ada", 5)
    (motion,) = figures["motions"].values()
    assert motion["tracked"] > 0.97 * PERIOD_S * RATE_HZ
    assert motion["tracked"] > motion["sure"] > motion["postures"] == figures["postures"] > 100
    np.testing.assert_allclose(figures["explained"], own.explained, atol=1e-6)
    assert "ada: 5 dimensions from" in ran.out
    after = load_profile(profile)
    assert after.subspace.to_dict() == own.to_dict()
    assert replace(after, subspace=worn.subspace).to_dict() == worn.to_dict()


def test_variance_chooses_the_dimensions_and_a_recording_is_solved_first(take: Path, tmp_path: Path) -> None:
    folder = tmp_path / "trc"
    assert phalanx("export", take, "--to", "trc", "--out", folder).code == 0
    (recording,) = folder.rglob("*.trc")
    out = tmp_path / "hands.json"
    ran = phalanx("subspace", recording, "--out", out, "--name", "hands", "--variance", 0.8, "--profile", "han19")
    assert ran.code == 0, ran.err
    subspace = load_subspace(out)
    assert subspace.name == "hands"
    assert subspace.explained[-1] >= 0.8 > subspace.explained[-2]


def wrong() -> Iterator[tuple[list[object], str]]:
    yield ["--variance", 1.5], "--variance 1.5"
    yield ["--dimensions", 0], "--dimensions 0"
    yield ["--name", "generic"], "'generic' is the name of a subspace of Phalanx"


@pytest.mark.parametrize(("words", "told"), list(wrong()))
def test_what_cannot_be_is_told_and_nothing_written(take: Path, tmp_path: Path, words: list[object], told: str) -> None:
    ran = phalanx("subspace", take, "--out", tmp_path / "out.json", *words)
    assert ran.code == 1
    assert told in ran.err
    assert list(tmp_path.iterdir()) == []


def test_too_little_motion_says_how_much_there_was(tmp_path: Path) -> None:
    from tests.app.takes import write_take

    ran = phalanx("subspace", write_take(tmp_path, "still"), "--out", tmp_path / "out.json")
    assert ran.code == 1
    assert "different postures" in ran.err
    assert not (tmp_path / "out.json").exists()


def test_both_sizes_at_once_are_wrong_usage(take: Path, tmp_path: Path) -> None:
    words = ["--variance", 0.9, "--dimensions", 3, "--out", tmp_path / "out.json"]
    assert phalanx("subspace", take, *words).code == 2
