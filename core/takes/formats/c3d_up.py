"""Which axis of a C3D file's world points up.

The format has no field for it. POINT:X_SCREEN and Y_SCREEN say how a viewer should draw the world; they are its axes
in most programs and a mere view in others. So, the first that is there:

1. PHALANX:UP, in files of our own.
2. FORCE_PLATFORM:CORNERS: plates lie on the floor, so up is the axis across all of them.
3. POINT:Y_SCREEN, where it is +Y or +Z. QTM can turn its Z up world to Y up as it exports ("Convert to Y-axis
   upwards", Qualisys's manual, "C3D export"), so +Y is believed of it too.
4. Any other screen is a view. Worlds of Qualisys and Vicon are Z up; of others, up is the axis that the screen shows
   upright, whatever its sign. Without a screen the axes stay as they are written.

Where that is a guess there is a warning. Up is always the positive axis: QTM 2.7 and 2.17 write X_SCREEN -X and
Y_SCREEN -Z beside points that stand upright on +Z. X_SCREEN is not used: the heading stays the file's own.
"""

from __future__ import annotations

import re

import numpy as np

from core.takes.formats.c3d_parameters import Parameters

_Z_UP_MAKERS = ("Qualisys", "Vicon")

_UPRIGHT = 0.9
"""Least share of a plate's normal along one axis: plates of inclined treadmills tilt by up to 25 degrees."""


def up_axis(parameters: Parameters) -> tuple[str, list[str]]:
    """The axis that points up, "X", "Y" or "Z", and what is to be said of it, in sentences."""
    own, screen = _axis(parameters.text("PHALANX", "UP")), _axis(parameters.text("POINT", "Y_SCREEN"))
    if own is not None:
        return own[1], []
    plates = _across_plates(parameters)
    if plates is not None:
        contradicted = screen is not None and screen[1] != plates
        told = f"Its screen shows {''.join(screen or ())} upwards, but its force plates lie across {plates}"
        return plates, [f"{told}; {plates} is taken for up."] if contradicted else []
    maker = _z_up_maker(parameters)
    if screen is not None and screen in (("+", "Y"), ("+", "Z")):
        turned = maker == "Qualisys" and screen[1] == "Y"
        return screen[1], ["Worlds of Qualisys are Z up, but its screen shows +Y; Y is taken for up."] if turned else []
    if screen is not None:
        up = "Z" if maker else screen[1]
        return up, [f"Its screen shows {''.join(screen)} upwards, which is only a view; {up} is taken for up."]
    if maker:
        return "Z", [f"It does not say which axis is up; Z is taken, as worlds of {maker} have it."]
    return "Y", ["It does not say which axis is up; Y is taken, and nothing is turned."]


def _axis(text: str) -> tuple[str, str] | None:
    """Sign and letter of "+Y", "-Z", "z"; None if it is no axis."""
    found = re.fullmatch(r"([+-]?)([XYZ])", text.strip().upper())
    return (found[1] or "+", found[2]) if found else None


def _z_up_maker(parameters: Parameters) -> str:
    names = (parameters.text("MANUFACTURER", "COMPANY") + " " + parameters.text("MANUFACTURER", "SOFTWARE")).lower()
    return next((maker for maker in _Z_UP_MAKERS if maker.lower() in names), "")


def _across_plates(parameters: Parameters) -> str | None:
    """The axis across all force plates; None without plates, or where they do not agree."""
    corners = parameters.array("FORCE_PLATFORM", "CORNERS")
    used = min(parameters.count("FORCE_PLATFORM", "USED") or 0, len(corners) // 12)
    plates = corners[: 12 * used].reshape(used, 4, 3)
    with np.errstate(over="ignore", invalid="ignore"):  # a damaged file may hold any bits
        normals = np.cross(plates[:, 2] - plates[:, 0], plates[:, 3] - plates[:, 1])
        lengths = np.linalg.norm(normals, axis=1)
    usable = np.isfinite(lengths) & (lengths > 0.0)
    if not usable.any():
        return None
    shares = np.abs(normals[usable] / lengths[usable, None]).min(axis=0)
    return "XYZ"[int(shares.argmax())] if shares.max() > _UPRIGHT else None
