"""With which profile a take is solved again, and from what its points are named."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtWidgets import QCheckBox, QComboBox, QDialog, QDialogButtonBox, QFileDialog, QWidget

from app.editing import leave_wheel_to_panel
from app.hand_size import CALIBRATED, hand_size
from app.lights import label
from app.panels.panel import column
from app.props.picking import with_props
from app.texts import give_way
from core.cast import Cast, cast_of, props_of
from core.errors import PhalanxError
from core.hand.sizes import SIZES
from core.markers.layout import layout_names
from core.profile import Profile, load_profile

_FILE = "Profile file…"


class SolveDialog(QDialog):
    """The take's own profile, the one in use, a layout on a generic hand, or a file."""

    def __init__(
        self,
        recorded: Profile | Sequence[Profile] | None,
        live: Profile | Sequence[Profile],
        parent: QWidget,
        whole: bool = True,
    ) -> None:
        """recorded, live: of each performer. whole: whether points are named from the whole take, to begin with."""
        super().__init__(parent)
        self.setWindowTitle("Solve again")
        self._cast: Cast = ()
        self.choice = leave_wheel_to_panel(give_way(QComboBox()))
        if recorded is not None:
            self._offer("As recorded", cast_of(recorded))
        self._offer("In use now", cast_of(live))
        if recorded is not None:
            known = {prop.name for profile in cast_of(recorded) for prop in profile.props}
            new = tuple(prop for prop in props_of(cast_of(live)) if prop.name not in known)
            if new:
                first, *others = cast_of(recorded)
                names = " and ".join(prop.name for prop in new)
                self._offer(f"As recorded, with {names}", (with_props(first, new), *others))
        for name in layout_names():
            self.choice.addItem(f"Layout {name} on a generic hand", name)
        self.choice.addItem(_FILE, None)
        self.whole = QCheckBox("Name points from the whole take")
        self.whole.setChecked(whole)
        self.whole.setToolTip(
            "On: every frame is gone through forward and backward in time, and what is one marker is named as one; "
            "takes about three times as long. Off: each point is named from what was before it alone, as live."
        )
        self.error = label("", "small", wrap=True, lines=2)
        self.error.setProperty("level", "problem")
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel)
        buttons.button(QDialogButtonBox.StandardButton.Ok).setText("Solve")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        layout = column(self, 16, 10)
        layout.addWidget(label("Profile", "section"))
        layout.addWidget(self.choice)
        layout.addWidget(label("Labels", "section"))
        layout.addWidget(self.whole)
        words = (
            "The frames of the take are solved anew from the first to the last. While markers are hidden, joints are "
            "led smoothly from where they were to where they are seen again. The file is not changed."
        )
        layout.addWidget(label(words, "small", wrap=True))
        layout.addWidget(self.error)
        layout.addWidget(buttons)
        self.setMinimumWidth(420)

    def _offer(self, words: str, cast: Cast) -> None:
        self.choice.addItem(f"{words}: {' and '.join(map(profile_title, cast))}", cast)

    @property
    def profiles(self) -> Cast:
        """What was chosen, for each performer; after the dialog was accepted."""
        assert self._cast
        return self._cast

    @property
    def profile(self) -> Profile:
        """That of the first performer."""
        return self.profiles[0]

    def accept(self) -> None:
        """Take the choice, if it can be read."""
        chosen = self.choice.currentData()
        try:
            if isinstance(chosen, tuple):
                self._cast = chosen
            elif self.choice.currentText() == _FILE:
                path, _ = QFileDialog.getOpenFileName(self, "Profile", "", "Profiles (*.json)")
                if not path:
                    return
                self._cast = (load_profile(Path(path)),)
            else:
                self._cast = (load_profile(chosen),)
        except PhalanxError as error:
            self.error.setText(str(error))
            return
        super().accept()


def profile_title(profile: Profile) -> str:
    """A profile in a list: whose, which glove, which hands, of what size."""
    size = hand_size(profile)
    hand = f"hand size {size}" if size in SIZES else "calibrated hand" if size == CALIBRATED else ""
    return " · ".join(filter(None, (profile.performer, profile.layout.name, " + ".join(profile.sides), hand)))
