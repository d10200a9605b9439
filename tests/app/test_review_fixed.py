"""The deviation of what is the same in all frames, in review: the export's, for the frame under the playhead."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.review.analysis import Cell, analyse
from app.review.fixed_shown import FixedShown
from app.review.moment import moment_words
from core.calibration.fixed import FixedCovariance
from core.calibration.neutral import Neutral, NeutralHand
from core.calibration.priors import fixed_covariance
from core.calibration.record import Calibrated
from core.hand.skeleton import DOF_NAMES
from core.takes.export import export
from core.takes.solution import Solution
from tests.core.export.recordings import solution


def _recordings() -> list[Solution]:
    """Of a layout alone, of the same calibrated, and of this with a neutral trial."""
    alone = solution(n_frames=40)
    record = Calibrated(
        FixedCovariance.of(0.04 * fixed_covariance(alone.cast[0])), 0.0006, 120, 12.0, 0.001, 0.001
    )  # fmt: skip
    known = replace(alone.cast[0], scale=1.0, calibrated=record)
    trial = NeutralHand(np.full(20, 0.2), np.zeros(20), np.zeros(20), ("ring_dip_flexion",), "flat.c3d", 0.0, 1.0, "")
    zeroed = replace(known, neutral=Neutral({"right": trial}))
    return [alone, replace(alone, profiles=known), replace(alone, profiles=zeroed)]


@pytest.mark.parametrize("recording", _recordings(), ids=["layout", "calibrated", "neutral"])
def test_review_says_what_is_exported(tmp_path: Path, recording: Solution) -> None:
    export(recording, ["csv"], tmp_path)
    with (tmp_path / "angles.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    analysis = analyse(list(recording.solved), np.arange(len(recording.solved)), recording.cast)
    assert analysis is not None
    shown = FixedShown(analysis)
    for i, hand in enumerate(analysis.hands):
        own = [row for row in rows if row["hand"] == hand.side]
        for frame in (12, 29, 38):
            if analysis.states[i, frame] != Cell.TRACKED:
                continue
            exported = np.array([float(own[frame][f"{name}_std_fixed"]) for name in DOF_NAMES[6:]])
            np.testing.assert_allclose(shown.std(i, frame)[6:], exported, rtol=1e-3)
    dof, right = DOF_NAMES.index("index_pip_flexion"), analysis.sides.index("right")
    words = f"° (in all frames ±{np.degrees(shown.std(right, 12)[dof]):.0f}°)"
    assert words in moment_words(analysis, 12, dof, shown).splitlines()[right]
    assert "in all frames" not in moment_words(analysis, 12, 0, shown)
    assert "in all frames" not in moment_words(analysis, 12, dof)
