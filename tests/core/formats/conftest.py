"""C3D files made of bytes, read."""

import numpy as np
import pytest

from core.takes.formats import read_recording
from tests.core.formats.c3d_bytes import build


@pytest.fixture
def points():
    return np.random.default_rng(1).uniform(-900, 900, (50, 4, 3))


@pytest.fixture
def written(tmp_path):
    """Reads what `build` makes of its arguments."""

    def read(*arguments, cut=None, **keywords):
        path = tmp_path / "file.c3d"
        path.write_bytes(build(*arguments, **keywords)[:cut])
        return read_recording(path)

    return read
