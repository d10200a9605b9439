"""The props of the profile in use, and what an operator does with them, each as one step that can be undone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from app.undo import UndoStack
from app.worker import SessionWorker
from core.errors import PhalanxError
from core.profile import Profile
from core.props.prop import Prop, load_prop, save_prop


class PropDesk:
    """Props come and go with the profile: every change is seen by the solver from the next frame on."""

    def __init__(self, worker: SessionWorker, undo: UndoStack) -> None:
        self.worker, self._undo = worker, undo

    @property
    def props(self) -> tuple[Prop, ...]:
        """Of the profile in use."""
        return self.worker.session.profile.props

    def free_name(self, wanted: str = "prop") -> str:
        """`wanted`, or with the first number that no prop has."""
        names, number, name = {prop.name for prop in self.props}, 1, wanted
        while name in names:
            number += 1
            name = f"{wanted} {number}"
        return name

    def add(self, prop: Prop) -> None:
        """One prop more; one of the same name is replaced."""
        self._change(f"add {prop.name}", lambda profile: profile.with_prop(prop))

    def remove(self, name: str) -> None:
        """One prop less."""
        self._change(
            f"remove {name}",
            lambda profile: replace(profile, props=tuple(prop for prop in profile.props if prop.name != name)),
        )

    def rename(self, name: str, new: str) -> None:
        """Another name. One that is empty or another prop's is told and not taken."""
        new = new.strip()
        if new == name:
            return
        if not new or any(prop.name == new for prop in self.props):
            what = f"Another prop is called {new!r} already." if new else "A prop needs a name."
            self._tell(PhalanxError(what, "Choose another name."))
            return
        self._each(f"rename {name}", name, lambda prop: replace(prop, name=new))

    def replace(self, name: str, other: Prop) -> None:
        """Other markers or another model for a prop, in its place."""
        self._each(f"change {name}", name, lambda prop: other)

    def open(self, path: Path) -> None:
        """Add the prop of a file. What cannot be read is told."""
        try:
            self.add(load_prop(path))
        except PhalanxError as error:
            self._tell(error)

    def save(self, name: str, path: Path) -> None:
        """Write a prop as a file. What cannot be written is told."""
        try:
            save_prop(next(prop for prop in self.props if prop.name == name), path)
        except PhalanxError as error:
            self._tell(error)
        else:
            self.worker.notifications.info(f"{path.name} holds the prop {name}.", source="Props")

    def _tell(self, error: PhalanxError) -> None:
        self.worker.notifications.error(error, "Props")

    def _each(self, text: str, name: str, change: Callable[[Prop], Prop]) -> None:
        self._change(
            text,
            lambda profile: replace(
                profile, props=tuple(change(prop) if prop.name == name else prop for prop in profile.props)
            ),
        )

    def _change(self, text: str, change: Callable[[Profile], Profile]) -> None:
        before, after = self.props, change(self.worker.session.profile).props
        self._undo.change(text, lambda: self._carry(before, after), lambda: self._carry(after, before))

    def _carry(self, before: Sequence[Prop], after: Sequence[Prop]) -> None:
        """Make one change of the props to those in use now. The rest of the profile, and other props, may have become
        others since: they are steps of another room."""
        profile = self.worker.session.profile
        self.worker.set_profile(replace(profile, props=carried(profile.props, before, after)))


def carried(props: Sequence[Prop], before: Sequence[Prop], after: Sequence[Prop]) -> tuple[Prop, ...]:
    """`props` with the change that made `after` of `before`: what went goes, what came comes."""
    if tuple(map(id, props)) == tuple(map(id, before)):
        return tuple(after)
    went = {prop.name for prop in before if not any(prop is kept for kept in after)}
    came = [prop for prop in after if not any(prop is old for old in before)]
    names = went | {prop.name for prop in came}
    return (*(prop for prop in props if prop.name not in names), *came)
