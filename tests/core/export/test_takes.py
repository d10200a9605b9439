"""From a take on disk: read as a recording, and exported."""

import numpy as np
import pytest

from core.takes.export import FORMATS, content, export
from core.takes.formats import read_recording
from core.takes.reader import open_take
from core.takes.solution import Solution
from core.takes.take import TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from tests.core.export.recordings import RATE, START_S, solution


@pytest.fixture(scope="module")
def take_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("take") / "take 1.mcap"
    source = solution()
    writer = TakeWriter(path, TakeInfo("take 1", rate_hz=RATE), source.cast)
    for raw, solved in zip(source.raw, source.solved, strict=True):
        writer.raw("", raw)
        writer.solved(solved)
    n = len(source.raw)
    writer.seal(TakeCounts(received=n, written=n, solved=n))
    return path


def test_a_take_is_read_as_a_recording(take_path):
    recording = read_recording(take_path)
    assert (recording.name, recording.rate_hz, recording.labels) == ("take 1", RATE, ())
    for read, sent in zip(recording.frames(), solution().raw, strict=True):
        assert read.sequence == sent.sequence
        assert read.times.host_s == pytest.approx(sent.times.host_s - START_S, abs=1e-9)
        assert np.array_equal(read.ids, sent.ids)
        assert np.allclose(read.points_m, sent.points_m, atol=1e-6)


@pytest.mark.parametrize("in_memory", [30_000, 10], ids=["in memory", "from disk"])
def test_a_take_exports_as_its_frames_do(take_path, tmp_path, monkeypatch, in_memory):
    monkeypatch.setattr(content, "MOST_IN_MEMORY", in_memory)
    direct = export(solution(), ["csv", "trc", "bvh"], tmp_path / "direct")
    with open_take(take_path) as take:
        paths = export(Solution.of_take(take), list(FORMATS), tmp_path / "take")
    assert len(paths) == 10
    angles = next(path for path in paths if path.name == "angles.csv").read_text()
    assert angles == direct[1].read_text()
    assert (tmp_path / "take" / "take 1.trc").stat().st_size == pytest.approx(direct[3].stat().st_size, rel=0.01)
