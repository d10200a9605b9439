"""What one test leaves for the next is found, and put back."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest

from tests import unchanged

pytest_plugins = ["pytester"]


def test_whatever_is_left_is_named_and_put_back(tmp_path: Path) -> None:
    before, handler = unchanged.now(), signal.getsignal(signal.SIGINT)
    os.environ["QT_QPA_PLATFORM"] = "offscreen"
    os.environ.pop("XDG_STATE_HOME")
    os.chdir(tmp_path)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    np.seterr(all="raise")
    said = " ".join(unchanged.put_back(before))
    assert "QT_QPA_PLATFORM was None, is 'offscreen'" in said and "XDG_STATE_HOME" in said
    for name in ("working folder", "handlers of signals", "numpy"):
        assert name in said
    assert unchanged.now() == before
    assert signal.getsignal(signal.SIGINT) is handler
    assert unchanged.put_back(before) == []


def test_the_test_that_left_it_fails_and_the_next_does_not(pytester: pytest.Pytester) -> None:
    conftest = Path(__file__).with_name("conftest.py").read_text(encoding="utf-8")
    pytester.makeconftest(conftest[: conftest.index("_session = ")] + conftest[conftest.index("@pytest.fixture") :])
    pytester.makepyfile(
        """
        import os

        def test_leaves():
            os.environ["QT_QPA_PLATFORM"] = "offscreen"

        def test_next():
            assert "QT_QPA_PLATFORM" not in os.environ
        """
    )
    outcome = pytester.runpytest_inprocess("-p", "no:cacheprovider")
    outcome.assert_outcomes(passed=2, errors=1)
    outcome.stdout.fnmatch_lines(["*environment: QT_QPA_PLATFORM was None, is 'offscreen'*"])
