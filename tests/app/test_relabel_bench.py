"""`phalanx bench relabel`: what it counts where everything is known, and what it needs."""

from __future__ import annotations

from app.bench.relabel import METHODS
from tests.app.command import phalanx


def test_of_a_hand_that_is_seen_whole_every_method_is_right() -> None:
    ran = phalanx(
        "bench", "relabel", "--only", "one hand", "real glove", "--seconds", "1", "--seeds", "1", "--hide", "0",
        "--ghosts", "0", "--json",
    )  # fmt: skip
    assert ran.code == 0, ran.err
    row = ran.figures["one hand"]
    assert row["frames"] == 120
    assert row["frames_right"] == row["labels_right"] == dict.fromkeys(METHODS, 100.0)
    assert row["ghosts_named"] == dict.fromkeys(METHODS, 0)
    assert "real glove" not in ran.figures and "--data" in ran.out
