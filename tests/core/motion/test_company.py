from itertools import islice

import numpy as np
import pytest

from core.errors import PhalanxError
from core.motion.company import APART_M, Company
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile
from core.props.marked import marked
from tests.some import some

LAYOUTS = ("han19", "qualisys13")


@pytest.fixture(scope="module")
def company() -> Company:
    return Company([Performer(load_profile(layout), seed) for seed, layout in enumerate(LAYOUTS, start=1)])


def test_everybody_moves_as_alone_and_stands_apart(company: Company) -> None:
    first, second = company.performers
    for (time_s, together), (_, one), (_, other) in some(
        islice(zip(company.positions(100.0), first.positions(100.0), second.positions(100.0), strict=False), 5)
    ):
        assert len(together) == len(company.labels) == 2 * 19 + 13
        np.testing.assert_allclose(together[:38], one - (APART_M / 2, 0.0, 0.0), atol=1e-12)
        np.testing.assert_allclose(together[38:], other + (APART_M / 2, 0.0, 0.0), atol=1e-12)
        assert time_s < 0.05


def test_labels_say_whose_marker_it_is(company: Company) -> None:
    names = [load_profile(layout).layout.marker_names for layout in LAYOUTS]
    sides = [(1, side, name) for side in ("left", "right") for name in names[0]]
    sides += [(2, "right", name) for name in names[1]]
    assert company.labels == tuple(f"{number}_{side}_{name}" for number, side, name in sides)
    assert len(set(company.labels)) == len(company.labels)


def test_one_performer_stands_where_he_would_alone(company: Company) -> None:
    alone = Company(company.performers[:1])
    (_, together), (_, one) = next(alone.positions(120.0)), next(company.performers[0].positions(120.0))
    np.testing.assert_array_equal(together, one)


def test_a_stream_of_them_is_like_any_other(company: Company) -> None:
    sent = next(MarkerStream(company, 120.0).labelled())
    assert sorted(sent.truth) == list(range(51)) and len(sent.frame.points_m) == 51


def test_nobody_is_no_company() -> None:
    with pytest.raises(PhalanxError, match="at least one"):
        Company([])


def test_what_the_first_handles_stands_where_the_first_stands() -> None:
    one, other = (Performer(load_profile("han19"), seed, "grasping") for seed in (1, 2))
    company = Company([one, other])
    assert set(company.props) == {*one.props, *other.props} and company.props["box"] is one.props["box"]
    placed, alone = company.props_world(2.5), one.props_world(2.5)
    for name, transform in alone.items():
        np.testing.assert_array_equal(placed[name][:3, :3], transform[:3, :3])
        np.testing.assert_allclose(placed[name][:3, 3], transform[:3, 3] + company.places_m[0], atol=1e-15)
    thing = marked("box", one.props["box"], 1)
    stream = MarkerStream(company, 120.0, 1, props=(thing,), noise_m=0.0)
    first = next(stream.labelled())
    own = [stream.labels[truth].startswith("box") for truth in first.truth]
    seen = first.frame.points_m[own]
    gaps_m = np.linalg.norm(seen[:, None] - thing.placed_m(company.props_world(0.0)["box"])[None], axis=2)
    assert len(seen) == 5 and gaps_m.min(axis=1).max() < 1e-12
