"""Several performers in one volume: how their hands are numbered, and what they are called.

A cast is the profiles of one session or take, in order: the index of a profile is the `performer` of its hands. With
one performer nothing is named after anybody, so that everything is called as if there were no such thing as a cast.
"""

from __future__ import annotations

from collections.abc import Sequence

from core.frames import HandKey
from core.profile import Profile
from core.props.prop import Prop

Cast = tuple[Profile, ...]


def cast_of(profiles: Profile | Sequence[Profile]) -> Cast:
    """One performer or several, as a cast. Raises ValueError for none."""
    cast = (profiles,) if isinstance(profiles, Profile) else tuple(profiles)
    if not cast:
        raise ValueError("a cast has at least one performer")
    return cast


def same_cast(one: Cast, other: Cast) -> bool:
    """Are these the very same profiles? Profiles hold arrays, and are told apart by identity."""
    return len(one) == len(other) and all(a is b for a, b in zip(one, other, strict=True))


def with_profile(cast: Cast, performer: int, profile: Profile) -> Cast:
    """The same performers, one of them with another profile."""
    return (*cast[:performer], profile, *cast[performer + 1 :])


def hands_of(cast: Cast) -> tuple[HandKey, ...]:
    """Every hand that is looked for, in the order in which the engine has them: by performer, then by side."""
    return tuple(HandKey(performer, side) for performer, profile in enumerate(cast) for side in profile.sides)


def props_of(cast: Cast) -> tuple[Prop, ...]:
    """The props of all performers, in their order. Of one name there is one thing, and the first says what it is."""
    props: dict[str, Prop] = {}
    for profile in cast:
        for prop in profile.props:
            props.setdefault(prop.name, prop)
    return tuple(props.values())


def performer_names(cast: Cast, nameless: str = "") -> tuple[str, ...]:
    """What each performer is called, all different; ("",) for a single one.

    It is the name in the profile, where that is taken with a number ("Anna 2"), and the number alone where there is
    none ("2"). nameless: what to put before such a number, "Performer " for whom a bare number would not tell.
    """
    if len(cast) == 1:
        return ("",)
    names: list[str] = []
    for number, profile in enumerate(cast, start=1):
        name = " ".join(profile.performer.split()) or f"{nameless}{number}"
        while name.casefold() in (other.casefold() for other in names):
            name = f"{name} {number}"
        names.append(name)
    return tuple(names)


def hand_names(cast: Cast) -> dict[HandKey, str]:
    """Each hand in words: "right", with several performers "Anna right" or "2 right"."""
    names = performer_names(cast)
    return {key: f"{names[key.performer]} {key.side}".strip() for key in hands_of(cast)}
