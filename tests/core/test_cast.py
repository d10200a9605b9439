from dataclasses import replace

import pytest

from core.cast import cast_of, hand_names, hands_of, performer_names, props_of, same_cast
from core.profile import Profile, load_profile
from tests.core.props.things import BALL, PEN

HAN19, GLOVE = load_profile("han19"), load_profile("qualisys13")


def named(*names: str) -> tuple[Profile, ...]:
    return tuple(replace(HAN19, performer=name) for name in names)


def test_hands_are_numbered_by_performer_then_side() -> None:
    assert hands_of((HAN19, GLOVE)) == ((0, "left"), (0, "right"), (1, "right"))
    assert list(hands_of((HAN19, HAN19))) == sorted(hands_of((HAN19, HAN19)))


def test_one_profile_is_a_cast_and_none_is_not() -> None:
    assert cast_of(HAN19) == (HAN19,) and same_cast(cast_of([HAN19, GLOVE]), (HAN19, GLOVE))
    with pytest.raises(ValueError, match="at least one"):
        cast_of([])


def test_the_same_cast_is_the_very_same_profiles() -> None:
    assert not same_cast((HAN19,), (replace(HAN19),)) and not same_cast((HAN19,), (HAN19, HAN19))


@pytest.mark.parametrize(
    ("given", "names"),
    [
        (("Anna",), ("",)),
        (("",), ("",)),
        (("Anna", "Ben"), ("Anna", "Ben")),
        (("", ""), ("1", "2")),
        (("Anna", "", "Anna"), ("Anna", "2", "Anna 3")),
        (("anna", "Anna"), ("anna", "Anna 2")),
        (("Anna", "Anna", "Anna 2"), ("Anna", "Anna 2", "Anna 2 3")),
        (("2", ""), ("2", "2 2")),
        ((" Anna \n Lena ", "Ben"), (r"Anna \n Lena", "Ben")),
    ],
)
def test_names_of_performers_are_all_different(given: tuple[str, ...], names: tuple[str, ...]) -> None:
    assert performer_names(named(*given)) == names


def test_nameless_performers_in_words() -> None:
    assert performer_names(named("", "Ben"), "Performer ") == ("Performer 1", "Ben")


def test_hands_are_named_after_their_performer_only_where_there_are_several() -> None:
    assert hand_names((HAN19,)) == {(0, "left"): "left", (0, "right"): "right"}
    both = hand_names((*named("Anna"), GLOVE))
    assert both == {(0, "left"): "Anna left", (0, "right"): "Anna right", (1, "right"): "2 right"}


def test_of_props_of_one_name_the_first_counts() -> None:
    other_pen = replace(BALL, name="pen")
    cast = (replace(HAN19, props=(PEN,)), replace(GLOVE, props=(other_pen, BALL)))
    assert props_of(cast) == (PEN, BALL)
