"""One look for the whole application: colours, type, spacing, and the red, amber and green of the lights."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtGui import QColor, QFont, QFontDatabase, QIcon, QPalette
from PySide6.QtWidgets import QApplication

from app.notifications import Severity
from core.frames import HandKey
from devices.device import Level

ICONS = Path(__file__).parent.parent / "resources" / "icons"

# Surfaces, from the back to the front.
GROUND = "#121417"
WINDOW = "#181b1f"
PANEL = "#1e2126"
RAISED = "#282c33"
HOVER = "#323741"
LINE = "#2d3138"
STRONG_LINE = "#3d434d"

TEXT = "#dde1e6"
MUTED = "#9aa2ad"
FAINT = "#6f7783"

LIVE = "#4a9eff"
REVIEW = "#b48cff"
ACCENT = LIVE
FOCUS = "#8cc2ff"
"""Around what the keyboard acts on; bright enough on every surface and beside every border."""
BAR = "#2c619b"
RECORD = "#e5383b"

GOOD = "#4cc38a"
WARNING = "#f0b13c"
PROBLEM = "#f2606b"
IDLE = "#59616c"

LEFT_HAND = "#8fd2ff"
RIGHT_HAND = "#bb46d0"
GUESS = "#a3c8ff"
"""What is predicted or a guess. Not amber: most good takes hold some, and nothing is wrong with them."""
MARK = "#dde1e6"

LEVEL_COLOURS = {Level.GOOD: GOOD, Level.WARNING: WARNING, Level.PROBLEM: PROBLEM, Level.IDLE: IDLE}
SEVERITY_COLOURS = {Severity.INFO: MUTED, Severity.WARNING: WARNING, Severity.PROBLEM: PROBLEM}
SIDE_COLOURS = {"left": LEFT_HAND, "right": RIGHT_HAND}
PERFORMER_COLOURS = (
    SIDE_COLOURS,
    {"left": "#3f73a1", "right": "#e8f25f"},
    {"left": "#a3ffed", "right": "#e170d9"},
)
"""Of the hands of each performer, from the first again after the last. Told apart from each other and from green, amber
and red by normal eyes and by those without red, green or blue cones; tests hold that."""

FAMILIES = ("Inter", "Segoe UI", "SF Pro Text", "Noto Sans", "DejaVu Sans")
BASE_PX = 12

# No label, tool tip or message box takes what it says for markup: a performer may be called <b>x</b>.
STYLE = f"""
* {{ font-size: {BASE_PX}px; }}
QLabel, QToolTip {{ qproperty-textFormat: PlainText; }}
QLabel[rich="true"] {{ qproperty-textFormat: RichText; }}
QWidget {{ color: {TEXT}; }}
QMainWindow, QDialog {{ background: {WINDOW}; }}
QMainWindow::separator {{ background: {GROUND}; width: 4px; height: 4px; }}
QMainWindow::separator:hover {{ background: {ACCENT}; }}
QToolTip {{ background: {RAISED}; color: {TEXT}; border: 1px solid {STRONG_LINE}; padding: 5px 7px; }}

QMenuBar {{ background: {WINDOW}; padding: 1px 4px; }}
QMenuBar::item {{ padding: 4px 9px; border-radius: 3px; color: {MUTED}; }}
QMenuBar::item:selected {{ background: {RAISED}; color: {TEXT}; }}
QMenu {{ background: {RAISED}; border: 1px solid {STRONG_LINE}; padding: 4px 0; }}
QMenu::item {{ padding: 5px 28px 5px 22px; }}
QMenu::item:selected {{ background: {HOVER}; }}
QMenu::item:disabled {{ color: {FAINT}; }}
QMenu::separator {{ height: 1px; background: {STRONG_LINE}; margin: 4px 8px; }}

QDockWidget {{
    color: {MUTED}; font-weight: 600;
    titlebar-close-icon: url("{{icons}}/close.svg"); titlebar-normal-icon: url("{{icons}}/float.svg");
}}
QDockWidget::close-button, QDockWidget::float-button {{
    border: none; background: transparent; padding: 0; icon-size: 14px; subcontrol-origin: padding;
    subcontrol-position: top right; top: 5px; width: 16px; height: 16px;
}}
QDockWidget::close-button {{ right: 8px; }}
QDockWidget::float-button {{ right: 26px; }}
QDockWidget::close-button:hover, QDockWidget::float-button:hover {{ background: {HOVER}; }}
QDockWidget::title {{ background: {PANEL}; padding: 6px 10px 5px 10px; border-bottom: 1px solid {LINE}; }}
QDockWidget > QWidget {{ background: {PANEL}; }}
#tally {{ border: 2px solid {GROUND}; background: {GROUND}; }}
#tally[recording="true"] {{ border-color: {RECORD}; }}
QTabBar {{ background: {WINDOW}; qproperty-drawBase: 0; }}
QTabBar::tab {{ background: {WINDOW}; color: {MUTED}; padding: 5px 14px; border: none; }}
QTabBar::tab:selected {{ background: {PANEL}; color: {TEXT}; border-bottom: 2px solid {ACCENT}; }}
QTabBar::tab:hover:!selected {{ color: {TEXT}; }}
QTabBar::tab:selected:focus {{ border: 1px solid {FOCUS}; border-bottom: 2px solid {FOCUS}; }}

#panel, #panelBody {{ background: {PANEL}; }}
#card {{ background: {WINDOW}; border: 1px solid {LINE}; border-radius: 5px; }}
#card[selected="true"] {{ border-color: {STRONG_LINE}; }}
#deck {{ background: {WINDOW}; border-bottom: 1px solid {GROUND}; }}
#strip {{ background: {WINDOW}; border-top: 1px solid {GROUND}; }}
QStatusBar {{ background: {WINDOW}; }}
QStatusBar::item {{ border: none; }}

QLabel[role="heading"] {{ color: {TEXT}; font-weight: 600; }}
QLabel[role="section"] {{ color: {MUTED}; font-size: 11px; font-weight: 600; }}
QLabel[role="muted"] {{ color: {MUTED}; }}
QLabel[role="faint"] {{ color: {FAINT}; }}
QLabel[role="small"] {{ color: {MUTED}; font-size: 11px; }}
QLabel[role="number"] {{ font-size: 20px; font-weight: 600; }}
QLabel[role="take"] {{ font-size: 17px; font-weight: 600; }}
QLabel[role="empty"] {{ color: {MUTED}; padding: 14px; }}
QLabel[level="problem"] {{ color: {PROBLEM}; }}
QLabel[level="warning"] {{ color: {WARNING}; }}
QLabel[level="good"] {{ color: {GOOD}; }}
QLabel[level="guess"] {{ color: {GUESS}; }}
QLabel[level="recording"] {{ color: {RECORD}; }}

QPushButton, QToolButton {{
    background: {RAISED}; border: 1px solid {STRONG_LINE}; border-radius: 4px; padding: 4px 11px; min-height: 17px;
}}
QPushButton:hover, QToolButton:hover {{ background: {HOVER}; }}
QPushButton:pressed, QToolButton:pressed {{ background: {LINE}; }}
QPushButton:disabled, QToolButton:disabled {{ color: {FAINT}; background: {PANEL}; border-color: {LINE}; }}
QPushButton:default, QPushButton[primary="true"] {{ background: #24507f; border-color: #34689f; }}
QPushButton[primary="true"]:hover {{ background: {BAR}; }}
QPushButton[primary="true"]:disabled {{ background: {PANEL}; border-color: {LINE}; }}
QToolButton[flat="true"] {{
    background: transparent; border: 1px solid transparent; padding: 2px 5px; color: {MUTED};
}}
QToolButton[flat="true"]:hover {{ background: {RAISED}; color: {TEXT}; }}
QToolButton[small="true"] {{ padding: 4px 2px; }}
QToolButton::menu-indicator {{ image: none; }}
QPushButton:focus, QPushButton:default:focus, QPushButton[primary="true"]:focus, QPushButton[segment="true"]:focus,
QToolButton:focus, QToolButton[flat="true"]:focus {{ border: 1px solid {FOCUS}; }}

QPushButton#record {{ font-weight: 700; padding: 6px 14px; }}
QPushButton#record[recording="true"] {{ background: {RECORD}; border-color: {RECORD}; color: white; }}
QPushButton#record[recording="true"]:hover {{ background: #c92f32; }}
QPushButton[segment="true"] {{
    background: {PANEL}; border: 1px solid {STRONG_LINE}; border-radius: 0; padding: 6px 16px; color: {MUTED};
}}
QPushButton[segment="true"]:hover {{ color: {TEXT}; }}
QPushButton#live:checked {{ background: #1d3d63; border-color: {LIVE}; color: {TEXT}; }}
QPushButton#review:checked {{ background: #3f3162; border-color: {REVIEW}; color: {TEXT}; }}
QPushButton#live {{ border-top-left-radius: 4px; border-bottom-left-radius: 4px; }}
QPushButton#review {{ border-top-right-radius: 4px; border-bottom-right-radius: 4px; }}

QLineEdit, QPlainTextEdit, QSpinBox, QDoubleSpinBox, QComboBox {{
    background: {GROUND}; border: 1px solid {STRONG_LINE}; border-radius: 3px; padding: 3px 6px; min-height: 17px;
    selection-background-color: {BAR};
}}
QLineEdit:focus, QPlainTextEdit:focus, QSpinBox:focus, QDoubleSpinBox:focus, QComboBox:focus {{
    border-color: {FOCUS};
}}
QLineEdit:disabled, QSpinBox:disabled, QDoubleSpinBox:disabled, QComboBox:disabled {{
    color: {FAINT}; background: {PANEL}; border-color: {LINE};
}}
QLineEdit[wrong="true"] {{ border-color: {PROBLEM}; }}
QComboBox::drop-down {{ border: none; width: 18px; }}
QComboBox::down-arrow {{ image: url("{{icons}}/chevron_down.svg"); width: 10px; height: 10px; }}
QComboBox QAbstractItemView {{
    background: {RAISED}; border: 1px solid {STRONG_LINE}; selection-background-color: {HOVER};
}}
QSpinBox::up-button, QSpinBox::down-button, QDoubleSpinBox::up-button, QDoubleSpinBox::down-button {{
    background: transparent; border: none; width: 14px;
}}
QSpinBox::up-arrow, QDoubleSpinBox::up-arrow {{ image: url("{{icons}}/chevron_up.svg"); width: 8px; height: 8px; }}
QSpinBox::down-arrow, QDoubleSpinBox::down-arrow {{
    image: url("{{icons}}/chevron_down.svg"); width: 8px; height: 8px;
}}
QCheckBox, QRadioButton {{ border: 1px solid transparent; border-radius: 3px; padding: 1px 2px; }}
QCheckBox:focus, QRadioButton:focus {{ border-color: {FOCUS}; }}
QCheckBox {{ spacing: 7px; }}
QCheckBox::indicator {{
    width: 13px; height: 13px; border: 1px solid {STRONG_LINE}; border-radius: 3px; background: {GROUND};
}}
QCheckBox::indicator:checked {{ background: {ACCENT}; border-color: {ACCENT}; image: url("{{icons}}/check.svg"); }}

QRadioButton {{ spacing: 7px; }}
QRadioButton::indicator {{
    width: 13px; height: 13px; border: 1px solid {STRONG_LINE}; border-radius: 7px; background: {GROUND};
}}
QRadioButton::indicator:checked {{
    border-color: {ACCENT};
    background: qradialgradient(
        cx: 0.5, cy: 0.5, radius: 0.5, fx: 0.5, fy: 0.5, stop: 0.55 {ACCENT}, stop: 0.65 {GROUND}
    );
}}
QCheckBox:disabled, QRadioButton:disabled {{ color: {FAINT}; }}
QCheckBox::indicator:disabled, QRadioButton::indicator:disabled {{ border-color: {LINE}; }}
QDialogButtonBox, QMessageBox {{ dialogbuttonbox-buttons-have-icons: 0; }}

QTableView, QTreeView, QListView, QTableWidget {{
    background: {PANEL}; alternate-background-color: {WINDOW}; border: 1px solid {PANEL}; gridline-color: {LINE};
    selection-background-color: {HOVER}; selection-color: {TEXT};
}}
QTableView:focus, QTreeView:focus, QListView:focus, QTableWidget:focus {{ border-color: {FOCUS}; }}
QHeaderView::section {{
    background: {PANEL}; color: {FAINT}; border: none; border-bottom: 1px solid {LINE};
    padding: 3px 6px; font-size: 11px;
}}
QTableCornerButton::section {{ background: {PANEL}; border: none; }}
QScrollArea {{ border: none; background: {PANEL}; }}
QScrollBar:vertical {{ background: transparent; width: 9px; margin: 0; }}
QScrollBar:horizontal {{ background: transparent; height: 9px; margin: 0; }}
QScrollBar::handle {{ background: {STRONG_LINE}; border-radius: 4px; min-height: 24px; min-width: 24px; }}
QScrollBar::handle:hover {{ background: {FAINT}; }}
QScrollBar[idle="true"]::handle {{ background: transparent; }}
QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; }}
QScrollBar::add-page, QScrollBar::sub-page {{ background: transparent; }}
QProgressBar {{
    background: {GROUND}; border: 1px solid {LINE}; border-radius: 3px; text-align: center; min-height: 14px;
}}
QProgressBar::chunk {{ background: {BAR}; border-radius: 2px; }}
QSplitter::handle {{ background: {GROUND}; }}
QSlider:focus {{ border: 1px solid {FOCUS}; border-radius: 3px; }}
QSlider::groove:horizontal {{ height: 3px; background: {STRONG_LINE}; border-radius: 1px; }}
QSlider::handle:horizontal {{ width: 12px; margin: -5px 0; border-radius: 6px; background: {TEXT}; }}
"""


def hand_colour(hand: HandKey) -> str:
    """The colour of a hand in plots and lists, '#rrggbb'."""
    return PERFORMER_COLOURS[hand.performer % len(PERFORMER_COLOURS)][hand.side]


def apply(application: QApplication) -> None:
    """Give the application its look; once, for every widget there is looks at it anew."""
    sheet = STYLE.replace("{icons}", ICONS.as_posix())
    if application.styleSheet() == sheet:
        return
    application.setStyle("Fusion")
    known = set(QFontDatabase.families())
    font = QFont(next((family for family in FAMILIES if family in known), application.font().family()))
    font.setPixelSize(BASE_PX)
    application.setFont(font)
    application.setPalette(palette())
    application.setStyleSheet(sheet)
    application.setWindowIcon(icon("phalanx"))


def palette() -> QPalette:
    """The palette beneath the style sheet, for what the sheet does not reach."""
    role = QPalette.ColorRole
    colours = QPalette()
    for which, colour in (
        (role.Window, WINDOW), (role.Base, GROUND), (role.AlternateBase, PANEL), (role.Button, RAISED),
        (role.WindowText, TEXT), (role.Text, TEXT), (role.ButtonText, TEXT), (role.ToolTipBase, RAISED),
        (role.ToolTipText, TEXT), (role.Highlight, BAR), (role.HighlightedText, TEXT), (role.Link, ACCENT),
        (role.PlaceholderText, FAINT), (role.BrightText, PROBLEM),
    ):  # fmt: skip
        colours.setColor(which, QColor(colour))
    for which in (role.WindowText, role.Text, role.ButtonText):
        colours.setColor(QPalette.ColorGroup.Disabled, which, QColor(FAINT))
    return colours


def icon(name: str) -> QIcon:
    """A drawing of resources/icons by its name."""
    return QIcon(str(ICONS / f"{name}.svg"))
