"""Rigid things that a system offers become props of a profile: as they are, or not at all."""

from __future__ import annotations

import numpy as np
import pytest

from app.props.offered import offered, props_of
from core.errors import FormatError
from core.props.prop import Prop, PropModel
from devices.offers import OfferedProp, Offers
from tests.some import some

MARKERS_M = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.04]])
PEN = Prop("pen", MARKERS_M, PropModel("cylinder", (0.01, 0.15)), np.diag([1.0, -1.0, -1.0]))
TABLE = Prop("table", MARKERS_M + 0.1)


def test_a_prop_comes_through_whole() -> None:
    through = props_of(Offers((offered(PEN), offered(TABLE))))
    assert [got.name for got in through] == ["pen", "table"]
    for prop, got in some(zip((PEN, TABLE), through, strict=True)):
        assert (got.name, got.model) == (prop.name, prop.model)
        np.testing.assert_allclose(got.markers_m, prop.markers_m, atol=1e-6)
        assert (got.home is None) == (prop.home is None)
        if prop.home is not None:
            np.testing.assert_allclose(got.home, prop.home, atol=1e-6)


@pytest.mark.parametrize(
    ("thing", "said"),
    [
        (OfferedProp("stick", MARKERS_M[:2]), "markers of shape 2x3"),
        (OfferedProp("wand", MARKERS_M * 100.0), "further than"),
        (OfferedProp("ball", MARKERS_M, shape="donut", size_m=(0.1,)), "model"),
        (OfferedProp("  ", MARKERS_M), "name"),
    ],
)
def test_what_no_profile_could_hold_is_refused(thing: OfferedProp, said: str) -> None:
    with pytest.raises(FormatError, match=said):
        props_of(Offers((thing,)))
