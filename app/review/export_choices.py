"""How an export is written, in its dialog: the options beside formats, range and folder. Remembered."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QCheckBox, QComboBox, QGridLayout, QWidget

from app.editing import leave_wheel_to_panel
from app.lights import label
from app.settings import Settings
from app.texts import give_way
from core.errors import ExportError
from core.takes.export import FORMATS, ExportOptions

JOINTS_SETTING = "export/joints"
MEASURED_SETTING = "export/measured"
UP_SETTING = "export/up"
UNIT_SETTING = "export/unit"
RATE_SETTING = "export/rate"
BONES_SETTING = "export/bones"
NEUTRAL_SETTING = "export/neutral"

UPS = {"y": "Y up", "z": "Z up"}
UNITS = {"": "As usual in each", "mm": "Millimetres", "cm": "Centimetres", "m": "Metres"}
BONES = {
    "phalanx": "Phalanx", "vrm": "VRM", "unreal": "Unreal", "unity": "Unity", "mixamo": "Mixamo", "mano": "MANO",
}  # fmt: skip
RATES_HZ = (24, 25, 30, 50, 60, 100, 120, 200, 240)
_OWN_RATE = "As recorded"


class ExportChoices(QWidget):
    """A small grid. What none of the chosen formats follows is greyed.

    neutral: phrases on the neutral trials of the performers (core.takes.export.counted); where there are none there is
    nothing to choose about them.
    """

    changed = Signal()

    def __init__(self, settings: Settings, neutral: Sequence[str] = ()) -> None:
        super().__init__()
        self._settings = settings
        self.measured = QCheckBox("Measured markers only")
        self.measured.setToolTip(
            "C3D and markers.csv have a gap where a marker was not seen, as TRC always has. Otherwise the model's "
            "prediction stands there, which many programs cannot tell from a measurement."
        )
        self.measured.setChecked(bool(settings.get(MEASURED_SETTING, False)))
        self.joints = QCheckBox("Joint centres and fingertips in C3D and TRC")
        self.joints.setToolTip("As markers of their own, named after the joint: R_index_pip_joint, R_index_tip_joint.")
        self.joints.setChecked(bool(settings.get(JOINTS_SETTING, False)))
        self.neutral = QCheckBox("Angles counted from the neutral trial", self)
        self.neutral.setToolTip(
            "In angles.csv: " + "; ".join(neutral) + ". Without it angles are as they were tracked. Skeletons, BVH and "
            "glTF never change."
        )
        self.neutral.setChecked(bool(settings.get(NEUTRAL_SETTING, True)))
        self._has_neutral = bool(neutral)
        self.up = _combo(UPS, settings.get(UP_SETTING, "y"))
        self.up.setToolTip("With Z up the files hold x, -z, y of the world. glTF is Y up by definition.")
        self.unit = _combo(UNITS, settings.get(UNIT_SETTING, ""))
        self.unit.setToolTip("Of lengths in C3D and TRC (usually mm) and BVH (cm). CSV and glTF are in metres.")
        self.rate = _combo(dict.fromkeys((_OWN_RATE, *(f"{rate} Hz" for rate in RATES_HZ))), _OWN_RATE)
        self.rate.setEditable(True)
        self.rate.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        self.rate.setToolTip(
            "Frames per second of C3D, TRC, BVH and glTF; write any. What lies between two frames is blended, never "
            "across a gap. CSV keeps the recording's own frames."
        )
        self.bones = _combo(BONES, settings.get(BONES_SETTING, "phalanx"))
        self.bones.setToolTip("What the joints are called in BVH and glTF: the names that another program knows.")
        self.rate.setCurrentText(str(settings.get(RATE_SETTING, _OWN_RATE)))
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(10)
        grid.setVerticalSpacing(8)
        grid.addWidget(self.measured, 0, 0, 1, 4)
        grid.addWidget(self.joints, 1, 0, 1, 4)
        grid.addWidget(self.neutral, 2, 0, 1, 4)
        self.neutral.setVisible(self._has_neutral)
        self._labels = {}
        for words, box, line, at in (
            ("Up axis", self.up, 3, 0), ("Unit", self.unit, 3, 2),
            ("Rate", self.rate, 4, 0), ("Bones", self.bones, 4, 2),
        ):  # fmt: skip
            text = label(words, "muted")
            text.setBuddy(box)
            self._labels[box] = text
            grid.addWidget(text, line, at, Qt.AlignmentFlag.AlignVCenter)
            grid.addWidget(box, line, at + 1)
        for choices in (1, 3):
            grid.setColumnStretch(choices, 1)
        for box in (self.measured, self.joints, self.neutral):
            box.toggled.connect(lambda _: self.changed.emit())
        for combo in (self.up, self.unit, self.rate, self.bones):
            combo.currentTextChanged.connect(lambda _: self.changed.emit())

    @property
    def fields(self) -> tuple[QWidget, ...]:
        """In the order in which they stand."""
        boxes = (self.measured, self.joints, *((self.neutral,) if self._has_neutral else ()))
        return (*boxes, self.up, self.unit, self.rate, self.bones)

    @property
    def rate_hz(self) -> float | None:
        """None: as recorded. Raises ExportError for what is no number."""
        text = self.rate.currentText().strip()
        if text in ("", _OWN_RATE):
            return None
        number = text.lower().removesuffix("hz").strip().replace(",", ".")
        try:
            return float(number)
        except ValueError:
            raise ExportError(f"{text!r} is no rate.", "Give frames per second, such as 60 Hz.") from None

    @property
    def options(self) -> ExportOptions:
        """What is chosen. Raises ExportError for a rate that is none."""
        return ExportOptions(
            joints=self.joints.isChecked(),
            measured=self.measured.isChecked(),
            up="z" if self.up.currentData() == "z" else "y",
            unit=self.unit.currentData() or None,
            rate_hz=self.rate_hz,
            bones=self.bones.currentData(),
            neutral=self.neutral.isChecked() or not self._has_neutral,
        )

    def remember(self) -> None:
        """For the next export."""
        if self._has_neutral:
            self._settings.set(NEUTRAL_SETTING, self.neutral.isChecked())
        for name, value in (
            (JOINTS_SETTING, self.joints.isChecked()),
            (MEASURED_SETTING, self.measured.isChecked()),
            (UP_SETTING, self.up.currentData()),
            (BONES_SETTING, self.bones.currentData()),
            (UNIT_SETTING, self.unit.currentData()),
            (RATE_SETTING, self.rate.currentText().strip() or _OWN_RATE),
        ):
            self._settings.set(name, value)

    def follow(self, formats: Collection[str], able: bool) -> None:
        """Grey what none of these formats follows; all while files are being written."""
        chosen = [FORMATS[name] for name in formats]
        self.measured.setEnabled(able and bool({"c3d", "csv"} & set(formats)))
        self.joints.setEnabled(able and bool({"c3d", "trc"} & set(formats)))
        self.neutral.setEnabled(able and "csv" in formats)
        followed = {
            box: any(one.follows(option) for one in chosen)
            for box, option in (
                (self.up, "up"),
                (self.unit, "unit"),
                (self.rate, "rate_hz"),
            )
        }
        followed[self.bones] = any(one.needs_hands for one in chosen)
        for box, useful in followed.items():
            box.setEnabled(able and useful)
            self._labels[box].setEnabled(able and useful)


def _combo(choices: dict[str, str | None], chosen: object) -> QComboBox:
    """choices: what is stored, and the words for it."""
    box = leave_wheel_to_panel(give_way(QComboBox()))
    for value, words in choices.items():
        box.addItem(words or value, value)
    box.setCurrentIndex(max(box.findData(chosen), 0))
    return box
