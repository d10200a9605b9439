"""A real glove's recording as a take, read back from several threads at once."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from core.profile import load_profile
from core.takes.formats import read_recording
from core.takes.reader import Take, open_take
from core.takes.take import TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import TakeWriter
from tests.core.takes.frames import bits
from tests.data import data_path

N = 1500


@pytest.mark.parametrize("sealed", [False, True])
def test_every_frame_of_a_real_recording(tmp_path: Path, sealed: bool) -> None:
    recording = read_recording(data_path("qualisys_hand", "recording.tsv"))
    frames = [frame for _, frame in zip(range(N), recording.frames(), strict=False)]
    assert len({len(frame.points_m) for frame in frames}) > 1  # it has gaps
    writer = TakeWriter(
        tmp_path / "take.mcap", TakeInfo("glove", rate_hz=recording.rate_hz), load_profile("qualisys13")
    )
    for frame in frames:
        writer.raw("", frame)
    if sealed:
        writer.seal(TakeCounts(N, N))
    else:
        writer.close()
    with open_take(writer.path) as take:
        assert take.duration_s == pytest.approx((N - 1) / recording.rate_hz, abs=1e-6)
        np.testing.assert_allclose(take.raw.times_s, recording.times_s[:N] - recording.times_s[0], atol=1e-6)

        def check(seed: int, take: Take = take) -> None:
            for i in np.random.default_rng(seed).permutation(N)[:300]:
                assert bits(take.raw[int(i)]) == bits(frames[i])

        with ThreadPoolExecutor(4) as pool:
            list(pool.map(check, range(4)))
        assert bits(tuple(take.raw)) == bits(tuple(frames))
    assert verify(writer.path).ok
