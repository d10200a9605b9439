"""How the 3D view shows what is a guess."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint

from app.viewport import colours
from core.hand.skeleton import DOF_NAMES, JOINT_NAMES
from tests.app.drawn import SIZE, pixels, show
from tests.app.hand_frames import hand_frame, profile, sample

RING = np.array(colours.rgb(colours.GUESS_CODE)) * 255


def unsure(hand, **degrees):
    """Sure of everything but the parameters whose names begin as these."""
    std = np.full(26, 1e-3)
    for k, name in enumerate(DOF_NAMES):
        std[k] = max([std[k], *(np.radians(value) for start, value in degrees.items() if name.startswith(start))])
    return replace(hand, theta_std=std, marker_std_m=np.full(len(hand.point), 5e-4))


def on_the_back_of(hand, joint: str) -> np.ndarray:
    """A point of the drawn skin, seen from above, of a bone that begins at a joint."""
    j = JOINT_NAMES.index(joint)
    return 0.6 * hand.joints_world[j, :3, 3] + 0.4 * hand.joints_world[j + 1, :3, 3]


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_joint_that_is_a_guess_is_glass_from_there_to_the_tip(viewport, qtbot, side):
    """The sure finger keeps its colour to the last digit; the other lets the floor through, and its edge glows."""
    hand = hand_frame(side, curl=0.1)
    hand = replace(hand, markers_world_m=np.full_like(hand.markers_world_m, np.nan))
    viewport.set_surface_shown(True)
    drawn = {}
    for name, std in (("sure", {}), ("pip", {"ring_pip": 20.0}), ("half", {"ring_pip": 5.0})):
        show(viewport, qtbot, None, sample(unsure(hand, **std))[1])
        viewport.view_fit()
        viewport.view_top()
        drawn[name] = pixels(viewport)
    viewport.set_surface_shown(False)
    empty = pixels(viewport)

    def at(name, joint):
        x, y, _ = viewport.points_on_screen(on_the_back_of(hand, joint)[None])[0]
        return drawn[name][round(y), round(x)]

    for joint in ("index_pip", "middle_mcp", "pinky_pip", "thumb_mcp"):
        assert (at("pip", joint) == at("sure", joint)).all(), joint
    skin, glass, between = (at(name, "ring_pip") for name in ("sure", "pip", "half"))
    assert skin.sum() > 1.5 * glass.sum() and skin.sum() > between.sum() > glass.sum()
    seen = np.abs(drawn["sure"] - empty).sum(axis=2) > 12
    still = np.abs(drawn["pip"] - empty).sum(axis=2) > 12
    assert (seen & still).sum() > 0.99 * seen.sum(), "glass still shows the whole finger"
    changed = np.abs(drawn["pip"] - drawn["sure"]).sum(axis=2) > 60
    assert changed.sum() > 300
    before, after = (
        drawn[name][changed] @ RING / np.linalg.norm(drawn[name][changed], axis=1) / np.linalg.norm(RING)
        for name in ("sure", "pip")
    )
    assert (after > before).mean() > 0.99, "more of the colour of a guess everywhere"


def test_what_is_not_known_looks_sure(viewport, qtbot):
    hand = hand_frame("right")
    drawn = []
    for known in (hand, unsure(hand)):
        show(viewport, qtbot, None, sample(known)[1])
        viewport.view_fit()
        drawn.append(pixels(viewport))
    assert (drawn[0] == drawn[1]).all()


def test_a_hidden_markers_ring_is_as_wide_as_its_error(viewport, qtbot):
    hand = unsure(hand_frame("right", hidden=(2,)))
    viewport.set_surface_shown(False)
    diameters_m = {}
    for std_m in (np.nan, 0.001, 0.008, 0.016, 0.2):
        hand.marker_std_m[2] = std_m
        show(viewport, qtbot, None, sample(replace(hand, side="right"))[1])
        viewport.camera.target_m, viewport.camera.distance_m = hand.markers_world_m[2], 0.3
        viewport.view_top()
        (x, y, _), (beside, _, _) = viewport.points_on_screen(hand.markers_world_m[2] + [(0, 0, 0), (0.01, 0, 0)])
        row = pixels(viewport)[round(y)]
        ring = np.flatnonzero(np.abs(row - RING).sum(axis=1) < 150)
        ring = ring[np.abs(ring - x) < 160]
        diameters_m[std_m] = 0.01 * np.ptp(ring) / abs(beside - x)
    unknown, small, middle, large, huge = diameters_m.values()
    assert unknown == small == pytest.approx(2 * 0.0042, rel=0.15)
    assert middle == pytest.approx(2 * 0.008, rel=0.1) and large == pytest.approx(2 * 0.016, rel=0.1)
    assert huge == pytest.approx(2 * 0.03, rel=0.1)


def test_the_legend_counts_guessed_joints_where_anything_is_known(viewport, qtbot):
    show(viewport, qtbot, None, sample(unsure(hand_frame("left"), ring_pip=20.0), hand_frame("right"))[1])
    assert "Guessed joints 2" in viewport.legend_text.splitlines()
    show(viewport, qtbot, None, sample(unsure(hand_frame("left"), wrist_r=20.0))[1])
    assert "Guessed joints 16" in viewport.legend_text.splitlines()
    show(viewport, qtbot, None, sample(hand_frame("left"))[1])
    assert "Guessed" not in viewport.legend_text


def test_the_pointer_asks_a_marker_how_sure_it_is(viewport, qtbot):
    hand = unsure(hand_frame("left", hidden=(3,)))
    hand.marker_std_m[3] = 0.0123
    show(viewport, qtbot, *sample(hand, extra_m=[hand.markers_world_m[9] + (0.0, 0.3, 0.0)]))
    viewport.view_fit()

    def words(point_m):
        x, y, _ = viewport.points_on_screen(np.asarray(point_m)[None])[0]
        return viewport.text_at(QPoint(round(x), round(y)))

    names = profile().layout.marker_names
    assert words(hand.markers_world_m[3]) == f"Left {names[3]}: hidden, predicted ±12 mm"
    assert words(hand.markers_world_m[16]) == f"Left {names[16]}: seen ±0.5 mm"
    assert words(hand.markers_world_m[9] + (0.0, 0.3, 0.0)) == "Unlabelled: part of no hand"
    assert viewport.text_at(QPoint(3, 3)) == ""
    assert "pale blue glass" in viewport.text_at(QPoint(SIZE[0] - 20, 20))
