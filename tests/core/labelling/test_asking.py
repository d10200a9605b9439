from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.engine import Engine
from core.errors import FormatError
from core.labelling import asking
from core.labelling.asking import Asker
from core.labelling.network import LabelNetwork, network_at
from core.profile import load_profile
from tests.data import ROOT

SHIPPED = ROOT / "resources" / "networks" / "labeller.onnx"


class Recorded:
    """Stands for a network, to see which is asked."""

    def __init__(self, network: LabelNetwork) -> None:
        self.network, self.asked = network, 0

    def labels_at(self, *question: object) -> object:
        self.asked += 1
        return self.network.labels_at(*question)


def test_each_performer_is_named_by_the_network_of_the_profile(tmp_path: Path, monkeypatch) -> None:
    own = tmp_path / "own.onnx"
    own.write_bytes(SHIPPED.read_bytes())
    networks: dict[str | None, Recorded] = {}
    monkeypatch.setattr(asking, "network_at", lambda path: networks.setdefault(path, Recorded(network_at(path))))
    plain = load_profile("han19")
    asker = Asker([plain, replace(plain, network=str(own))])
    points_m = plain.worn.positions_m + np.array([1.0, 2.0, 3.0])
    for performer, expected in ((0, {None: 1, str(own): 0}), (1, {None: 1, str(own): 1})):
        named = asker.name(performer, points_m, 1.0)
        assert named is not None and {path: known.asked for path, known in networks.items()} == expected


def test_an_engine_refuses_a_profile_whose_network_is_gone(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"gone\.onnx.*The profile names it"):
        Engine(replace(load_profile("han19"), network=str(tmp_path / "gone.onnx")))
