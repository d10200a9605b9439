"""Which recordings of other programs are imported, and whose hands are in them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QFileDialog,
    QGridLayout,
    QPushButton,
    QToolButton,
    QWidget,
)

from app.editing import leave_wheel_to_panel
from app.lights import elided, label
from app.panels.panel import clear, column, row
from app.review.solve_dialog import profile_title
from app.settings import IMPORT_FOLDER, Settings
from app.texts import give_way
from core.cast import Cast
from core.errors import PhalanxError
from core.markers.layout import layout_names
from core.profile import Profile, load_profile
from core.takes.take import EXTENSION, MOST_PERFORMERS

FILTER = "Recordings (*.c3d *.trc *.tsv *.csv);;All files (*)"
_FILE = "Profile file…"


def choose_recordings(parent: QWidget, settings: Settings, takes: Path, start: Path | None = None) -> tuple[Path, ...]:
    """Ask for recordings, beginning where the last ones were, or else in the folder of the takes; () if none was
    chosen."""
    last = settings.get(IMPORT_FOLDER, "")
    places = [start, Path(last) if last else None, takes, *takes.parents]
    folder = next((place for place in places if place is not None and os.path.isdir(place)), takes)  # noqa: PTH112
    chosen, _ = QFileDialog.getOpenFileNames(parent, "Import recording", str(folder), FILTER)
    return tuple(Path(path) for path in chosen)


class ImportDialog(QDialog):
    """Files, one profile for each performer, and from what points are named."""

    def __init__(
        self,
        paths: Sequence[Path],
        live: Sequence[Profile],
        folder: Path,
        parent: QWidget,
        whole: bool = True,
        settings: Settings | None = None,
    ) -> None:
        """live: the profiles of the session, offered first. folder: of the takes. whole: whether points are named from
        the whole recording, to begin with."""
        super().__init__(parent)
        self.setWindowTitle("Import recording")
        self.paths: tuple[Path, ...] = ()
        self._takes = folder
        self._settings = settings or Settings(None)
        self.profiles: Cast = ()
        self._offered: list[Profile] = list(live)
        self.files = elided("", "", Qt.TextElideMode.ElideMiddle)
        self.choose = QPushButton("Choose…")
        self.choose.setToolTip("C3D, TRC, Qualisys TSV, Motive CSV or points.csv; several are imported one by one.")
        self.choose.clicked.connect(self.choose_files)
        self.performers: list[QComboBox] = []
        self.rows = QGridLayout()
        self.rows.setHorizontalSpacing(8)
        self.rows.setVerticalSpacing(6)
        self.rows.setColumnStretch(1, 1)
        self.add = QPushButton("Add a performer")
        self.add.setToolTip("Somebody else's hands are in the volume, too.")
        self.add.clicked.connect(lambda: self._add_performer(None))
        self.whole = QCheckBox("Name points from the whole recording")
        self.whole.setChecked(whole)
        self.whole.setToolTip(
            "For points without labels. On: every frame is gone through forward and backward in time, and what is one "
            "marker is named as one; takes about three times as long. Off: each point is named from what was before it "
            "alone, as live. Labels that the file gives are used where they fit."
        )
        words = (
            f"Every recording is solved from its first frame to its last and becomes a take in {folder}. The file is "
            "not changed, and no take is overwritten."
        )
        self.error = label("", "small", wrap=True, lines=2)
        self.error.setProperty("level", "problem")
        self.start = QPushButton("Import")
        self.start.setDefault(True)
        self.start.clicked.connect(self.accept)
        cancel = QPushButton("Cancel")
        cancel.clicked.connect(self.reject)
        layout = column(self, 16, 10)
        layout.addWidget(label("Recording", "section"))
        files = row(self.files, self.choose)
        files.setStretch(0, 1)
        layout.addLayout(files)
        layout.addWidget(label("Profile of each performer", "section"))
        layout.addLayout(self.rows)
        layout.addLayout(row(self.add, None))
        layout.addWidget(label("Labels", "section"))
        layout.addWidget(self.whole)
        layout.addWidget(label(words, "small", wrap=True))
        layout.addWidget(self.error)
        layout.addLayout(row(None, cancel, self.start))
        for button in (self.choose, self.add, cancel):
            button.setAutoDefault(False)
        self.setMinimumWidth(480)
        for profile in live:
            self._add_performer(profile)
        self.set_files(paths)

    def choose_files(self) -> bool:
        """Ask for the recordings; False if none was chosen."""
        chosen = choose_recordings(self, self._settings, self._takes, self.paths[0].parent if self.paths else None)
        if chosen:
            self.set_files(chosen)
        return bool(chosen)

    def set_files(self, paths: Sequence[Path]) -> None:
        """Show what will be imported."""
        self.paths = tuple(paths)
        names = ", ".join(path.name for path in paths)
        self.files.setText(names if len(paths) < 2 else f"{len(paths)} files: {names}")
        self.files.setToolTip("\n".join(map(str, paths)))
        if not paths:
            self.files.setText("None chosen yet")
        self.start.setEnabled(bool(paths))
        self.start.setToolTip("" if paths else "Choose a recording first.")
        self.error.setText("")

    def accept(self) -> None:
        """Take the choice, if it can be read."""
        take = next((path for path in self.paths if path.suffix.lower() == EXTENSION), None)
        if take is not None:
            self.error.setText(f"{take.name} is a take already. Open it with File > Open take.")
            return
        try:
            self.profiles = tuple(self._profile(box) for box in self.performers)
        except PhalanxError as error:
            self.error.setText(str(error))
            return
        super().accept()

    def _profile(self, box: QComboBox) -> Profile:
        chosen = box.currentData()
        return chosen if isinstance(chosen, Profile) else load_profile(chosen)

    def _add_performer(self, profile: Profile | None) -> None:
        box = leave_wheel_to_panel(give_way(QComboBox()))
        for known in self._offered:
            box.addItem(profile_title(known), known)
        for name in layout_names():
            box.addItem(f"Layout {name} on a generic hand", name)
        box.addItem(_FILE, _FILE)
        box.setCurrentIndex(next((i for i, known in enumerate(self._offered) if known is profile), 0))
        box.activated.connect(lambda _: self._chosen(box))
        self.performers.append(box)
        self._show_rows()

    def _remove(self, box: QComboBox) -> None:
        self.performers.remove(box)
        box.deleteLater()
        self._show_rows()

    def _show_rows(self) -> None:
        for box in self.performers:
            self.rows.removeWidget(box)
        clear(self.rows)
        several = len(self.performers) > 1
        for i, box in enumerate(self.performers):
            number = label(str(i + 1), "small")
            remove = QToolButton(text="Remove")
            remove.setToolTip("Nobody else's hands are in the volume.")
            remove.clicked.connect(lambda _=False, box=box: self._remove(box))
            for place, widget in enumerate((number, box, remove) if several else (None, box)):
                if widget is not None:
                    self.rows.addWidget(widget, i, place, Qt.AlignmentFlag.AlignVCenter)
                    widget.show()  # Qt would do so later, and has no room for what is not shown
        self.add.setEnabled(len(self.performers) < MOST_PERFORMERS)
        self._grow()

    def _grow(self) -> None:
        """As high as what it holds now, and no less wide."""
        layout = self.layout()
        if layout is not None and self.isVisible():
            layout.activate()
            self.resize(self.width(), layout.totalHeightForWidth(self.width()))

    def _chosen(self, box: QComboBox) -> None:
        """A profile file is asked for at once, and then is one of the choices of every performer."""
        if box.currentData() != _FILE:
            return
        box.setCurrentIndex(0)
        path, _ = QFileDialog.getOpenFileName(self, "Profile", "", "Profiles (*.json)")
        if not path:
            return
        try:
            profile = load_profile(Path(path))
        except PhalanxError as error:
            self.error.setText(str(error))
            return
        self.error.setText("")
        self._offered.append(profile)
        for one in self.performers:
            one.insertItem(len(self._offered) - 1, profile_title(profile), profile)
        box.setCurrentIndex(len(self._offered) - 1)
