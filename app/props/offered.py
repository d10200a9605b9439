"""Props that a system offers, as those of a profile; and back."""

from __future__ import annotations

from core.props.prop import Prop, PropModel
from devices.offers import OfferedProp, Offers


def props_of(offers: Offers) -> tuple[Prop, ...]:
    """The rigid things on offer. Raises FormatError for one that no profile could hold."""
    return tuple(_checked(offered) for offered in offers.props)


def offered(prop: Prop) -> OfferedProp:
    """A prop, as a device offers it."""
    return OfferedProp(prop.name, prop.markers_m, (), prop.model.shape, prop.model.size_m, prop.home)


def _checked(offered: OfferedProp) -> Prop:
    model = PropModel(offered.shape, offered.size_m)  # type: ignore[arg-type]  # checked in the next line
    prop = Prop(offered.name, offered.markers_m, model, offered.home)
    return Prop.from_dict(prop.to_dict(), "An offered prop")
