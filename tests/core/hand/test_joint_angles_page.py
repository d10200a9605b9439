"""What docs/joint-angles.md says of zero, limits, names, and the code it gives."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.hand.joint_axes import joint_axes
from core.hand.model import template
from core.hand.skeleton import DIGIT_DOF_NAMES, DIGITS, DOF_JOINTS, DOF_NAMES, JOINT_NAMES
from core.kinematics.forward import joints_world

PAGE = (Path(__file__).parents[3] / "docs" / "joint-angles.md").read_text(encoding="utf-8")
SKELETON = template().skeleton


@pytest.fixture
def given(tmp_path) -> dict[str, Any]:
    """What the page's own code defines."""
    code = re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert code
    program = tmp_path / "isb.py"
    program.write_text(code.group(1), encoding="utf-8")
    return runpy.run_path(str(program))


def test_the_names_stand_in_their_order():
    table = PAGE[PAGE.index("| number |") : PAGE.index("## The axes")]
    assert re.findall(r"`(\w+)`", table) == list(DOF_NAMES)


def test_limits_are_the_models():
    rows = re.findall(r"^\| (finger|thumb) (\w+) (\w+) \| (−?\d+)° \| (−?\d+)° \|$", PAGE, re.MULTILINE)
    said = {(digit, f"{joint.lower()}_{what}"): (low, high) for digit, joint, what, low, high in rows}
    for name, limits in zip(DIGIT_DOF_NAMES, np.degrees(SKELETON.limits_rad), strict=True):
        digit, what = name.split("_", 1)
        low, high = said["thumb" if digit == "thumb" else "finger", what]
        assert (float(low.replace("−", "-")), float(high)) == pytest.approx(tuple(limits))
    assert len(said) == 8


def test_the_zero_is_the_models():
    rows = re.findall(r"^\| (\w+)(?:, (\w+))? \| (\d+)° to the (thumb|little finger) \| (\d+)° \|$", PAGE, re.MULTILINE)
    assert len(rows) == 7
    bones = joint_axes(SKELETON, "right").bones
    for digit, bone, aside, way, down in rows:
        joint = 1 + 3 * DIGITS.index(digit) + ("metacarpal", "proximal", "distal").index(bone or "metacarpal")
        x, y, z = bones[joint]
        assert round(abs(np.degrees(np.arctan2(x, -z)))) == int(aside)
        assert bool(x < 0) is (way == "thumb")
        assert round(np.degrees(np.arcsin(-y))) == int(down)


@pytest.mark.parametrize("digit", DIGITS[1:])
def test_the_code_gives_isb_angles(given, digit):
    isb_angles, axes = given["isb_angles"], joint_axes(SKELETON, "right")
    first = DIGIT_DOF_NAMES.index(f"{digit}_mcp_abduction")
    outward = 1.0 if digit in ("ring", "pinky") else -1.0  # positive abduction, to the little finger

    def of(joint: str, *degrees: float) -> np.ndarray:
        theta = np.zeros(26)
        theta[6 + first : 6 + first + len(degrees)] = np.radians(degrees)
        world = joints_world(SKELETON, theta)
        k = JOINT_NAMES.index(f"{digit}_{joint}")
        parent = 0 if joint == "mcp" else k - 1
        turned = (Rotation.from_matrix(world[j, :3, :3]) for j in (parent, k))
        return isb_angles(*turned, axes.bones[k], axes.flexion[k])

    np.testing.assert_allclose(of("mcp", 0, 60), [60, 0, 0], atol=0.05)
    np.testing.assert_allclose(of("mcp", 10, 0), [0, outward * 10, 0], atol=0.05)
    np.testing.assert_allclose(of("mcp", 15, 70), [70.6, outward * 5.1, -outward * 14.1], atol=0.1)
    assert DOF_JOINTS[first] == DOF_JOINTS[first + 1]
    np.testing.assert_allclose(of("pip", 5, 30, 80), [80, 0, 0], atol=5.0)  # its axis is within 5 degrees of square
