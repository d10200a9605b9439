"""The viewport as it is drawn: pixels, not calls."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QImage, QPainter, QPolygonF
from PySide6.QtWidgets import QLabel, QMainWindow

from app.viewport import colours
from app.viewport.drawing_surface import DrawingSurface
from app.viewport.gl_support import gl_support
from app.viewport.hand_visual import skinning_uniforms, vertex_normals
from app.viewport.marker_states import MarkerState
from app.viewport.name_tags import NameTags
from app.viewport.viewport import Viewport
from core.frames import HandState, RigidBody
from core.hand.mirror import mirror_points, mirror_transforms
from core.hand.model import skin, template
from core.hand.shape import HandShape
from core.hand.skeleton import DOF_NAMES, JOINT_NAMES
from tests.app.hand_frames import hand_frame, profile, sample
from tests.data import ROOT

SIZE = (640, 480)


@pytest.fixture
def viewport(qtbot):
    if gl_support().reason:
        pytest.skip(gl_support().reason)
    widget = Viewport()
    qtbot.addWidget(widget)
    widget.resize(*SIZE)
    with qtbot.waitExposed(widget):
        widget.show()
    return widget


def show(viewport: Viewport, qtbot, *args) -> None:
    with qtbot.waitSignal(viewport.drawn):
        viewport.show_frame(*args, profile())


def pixels(viewport: Viewport) -> np.ndarray:
    """(height, width, 3) int, the scene without what lies over it."""
    image = viewport.findChild(DrawingSurface).image().convertToFormat(QImage.Format.Format_RGB888)
    raw = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    return raw[:, : image.width() * 3].reshape(image.height(), image.width(), 3).astype(int)


def pixel_at(viewport: Viewport, point_m) -> np.ndarray:
    x, y, _ = viewport.points_on_screen(np.asarray(point_m, float)[None])[0]
    return pixels(viewport)[round(y), round(x)]


def surface_m(hand, model=None) -> np.ndarray:
    """What core says the skin of a hand of either side is. model: the template unless given."""
    model = (model or template()).scaled(hand.scale)
    if hand.side == "right":
        return skin(model, hand.joints_world)
    return mirror_points(skin(model, mirror_transforms(hand.joints_world)))


def silhouette(viewport: Viewport, vertices_m: np.ndarray) -> np.ndarray:
    """(height, width) bool: the surface, projected and filled without OpenGL."""
    screen = viewport.points_on_screen(vertices_m)
    width, height = viewport.width(), viewport.height()
    image = QImage(width, height, QImage.Format.Format_Grayscale8)
    image.fill(0)
    painter = QPainter(image)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(Qt.GlobalColor.white)
    for corners in screen[template().faces][:, :, :2]:
        painter.drawPolygon(QPolygonF([QPointF(x, y) for x, y in corners]))
    painter.end()
    return np.frombuffer(image.constBits(), np.uint8).reshape(height, image.bytesPerLine())[:, :width] > 0


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("scale", [1.0, 0.8])
def test_the_drawn_hand_covers_what_core_skins(viewport, qtbot, side, scale):
    hand = hand_frame(side, scale=scale)
    hand = replace(hand, markers_world_m=np.full_like(hand.markers_world_m, np.nan))  # they would hide skin
    show(viewport, qtbot, None, sample(hand)[1])
    viewport.view_fit()
    for turn in (0.0, 1.7):
        viewport.camera.orbit(turn, 0.1)
        viewport.set_surface_shown(False)
        without = pixels(viewport)
        viewport.set_surface_shown(True)
        drawn = np.abs(pixels(viewport) - without).sum(axis=2) > 12
        expected = silhouette(viewport, surface_m(hand))
        assert expected.sum() > 8000
        assert (drawn & expected).sum() / (drawn | expected).sum() > 0.985


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_drawn_hand_has_the_shape_of_the_profile(viewport, qtbot, side):
    """Two performers one after the other: each is drawn as broad and long as core skins them, skeleton and all."""
    for stout in (True, False):
        ratios = np.ones(23)
        ratios[:3], ratios[3:18], ratios[18:] = (1.25, 0.85, 0.75) if stout else (0.8, 1.25, 1.1)
        worn = replace(profile(), shape=HandShape(ratios))
        hand = hand_frame(side, scale=1.05, worn=worn)
        hand = replace(hand, markers_world_m=np.full_like(hand.markers_world_m, np.nan))
        with qtbot.waitSignal(viewport.drawn):
            viewport.show_frame(None, sample(hand)[1], worn)
        viewport.view_fit()
        viewport.set_skeleton_shown(False)
        viewport.set_surface_shown(False)
        without = pixels(viewport)
        viewport.set_surface_shown(True)
        drawn = np.abs(pixels(viewport) - without).sum(axis=2) > 12
        expected = silhouette(viewport, surface_m(hand, worn.hand))
        generic = silhouette(viewport, surface_m(hand))
        assert (drawn & expected).sum() / (drawn | expected).sum() > 0.985
        assert (drawn & generic).sum() / (drawn | generic).sum() < 0.9
        viewport.set_surface_shown(False)
        viewport.set_skeleton_shown(True)
        tip = worn.hand.skeleton.scaled(1.05).tip_positions_m[2]
        at = hand.joints_world if side == "right" else mirror_transforms(hand.joints_world)
        beyond = tip - worn.hand.skeleton.scaled(1.05).joint_positions_m[9]
        tip_m = at[9, :3, 3] + at[9, :3, :3] @ beyond * 0.97
        x, y, _ = viewport.points_on_screen((tip_m if side == "right" else mirror_points(tip_m))[None])[0]
        around = pixels(viewport)[round(y) - 3 : round(y) + 4, round(x) - 3 : round(x) + 4]
        assert around.sum(axis=2).max() > 500


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_matrices_for_the_graphics_card_skin_as_core_does(side):
    hand = hand_frame(side, scale=1.1)
    model = template()
    guess = np.linspace(0.0, 1.0, 16)
    matrices = skinning_uniforms(model.skeleton.scaled(1.1), side, hand.joints_world, guess).transpose(0, 2, 1)
    assert matrices[:, 3, 0] == pytest.approx(guess)
    blended = np.einsum("vk,vkij->vij", model.skin_weights, matrices[model.skin_joints])
    homogeneous = np.concatenate([model.vertices_m * 1.1, np.ones((len(model.vertices_m), 1))], axis=1)
    assert np.einsum("vij,vj->vi", blended, homogeneous)[:, :3] == pytest.approx(surface_m(hand), abs=1e-6)
    normals = np.einsum("vij,vj->vi", blended[:, :3, :3], vertex_normals(model.vertices_m, model.faces))
    faces = model.faces if side == "right" else model.faces[:, ::-1]
    outward = vertex_normals(surface_m(hand), faces)
    cosines = (normals * outward).sum(axis=1) / np.linalg.norm(normals, axis=1)
    assert np.median(cosines) > 0.99 and (cosines > 0).mean() > 0.98


def test_both_hands_are_lit_and_told_apart(viewport, qtbot):
    hands = hand_frame("left"), hand_frame("right")
    show(viewport, qtbot, None, sample(*hands)[1])
    viewport.view_top()
    backs = [pixel_at(viewport, hand.joints_world[[0, 7], :3, 3].mean(axis=0)) for hand in hands]
    for back in backs:
        assert back.mean() > 110
    left, right = backs
    assert left[2] > left[0] and right[0] > right[2]


def test_each_state_has_its_colour_where_its_marker_is(viewport, qtbot):
    for side in ("left", "right"):
        hand = hand_frame(side, hidden=(2,))
        ghost = hand.markers_world_m[9] + (0.0, 0.03, 0.0)
        far = hand.markers_world_m[9] + (0.0, 0.2, 0.0)
        frame, tracked = sample(hand, extra_m=[ghost, far])
        show(viewport, qtbot, frame, tracked)
        viewport.set_surface_shown(False)
        viewport.camera.fit(frame.points_m, SIZE[0] / SIZE[1])
        expected = {
            MarkerState.LABELLED: hand.markers_world_m[9],
            MarkerState.GHOST: ghost,
            MarkerState.UNLABELLED: far,
        }
        for state, place in expected.items():
            wanted = colours.STATE_COLORS[state, :3] * 255
            seen = pixel_at(viewport, place)
            cosine = seen @ wanted / np.linalg.norm(seen) / np.linalg.norm(wanted)
            assert cosine > 0.99 and seen.max() > 0.7 * wanted.max(), state


def test_a_predicted_marker_is_hollow(viewport, qtbot):
    hand = hand_frame("right", hidden=(2,))
    show(viewport, qtbot, *sample(hand))
    viewport.set_surface_shown(False)
    viewport.camera.target_m, viewport.camera.distance_m = hand.markers_world_m[2], 0.15
    x, y, _ = viewport.points_on_screen(hand.markers_world_m[2][None])[0]
    around = pixels(viewport)[round(y) - 40 : round(y) + 40, round(x)]
    amber = colours.STATE_COLORS[MarkerState.PREDICTED, :3] * 255
    assert np.abs(around - amber).sum(axis=1).min() < 20, "its ring"
    assert around[40].sum() < 0.5 * amber.sum(), "its middle"


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
    assert (after > before).mean() > 0.99, "more amber everywhere"


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
    assert "amber glass" in viewport.text_at(QPoint(SIZE[0] - 20, 20))


def test_a_lost_hand_is_a_grey_guess(viewport, qtbot):
    back = hand_frame("right").joints_world[[0, 7], :3, 3].mean(axis=0)
    seen = {}
    for state in HandState:
        show(viewport, qtbot, None, sample(hand_frame("right", state=state), sequence=len(seen))[1])
        viewport.camera.target_m, viewport.camera.distance_m = back, 0.6
        viewport.view_top()
        seen[state] = pixel_at(viewport, back)
    empty, lost, tracked = seen[HandState.SEARCHING], seen[HandState.LOST], seen[HandState.TRACKED]
    assert empty.sum() + 30 < lost.sum() < tracked.sum() - 60
    assert np.ptp(lost) < 25


def test_colour_by_digit(viewport, qtbot):
    hand = hand_frame("right")
    show(viewport, qtbot, *sample(hand))
    viewport.set_surface_shown(False)
    viewport.set_colour_by_digit(True)
    marker = profile().layout.joints.tolist().index(7)  # carried by the middle finger
    wanted = colours.DIGIT_COLORS[2, :3] * 255
    seen = pixel_at(viewport, hand.markers_world_m[marker])
    assert seen @ wanted / np.linalg.norm(seen) / np.linalg.norm(wanted) > 0.99


def test_the_skeleton_shows_through_the_skin(viewport, qtbot):
    hand = hand_frame("right")
    show(viewport, qtbot, None, sample(hand)[1])
    bone = hand.joints_world[[7, 8], :3, 3].mean(axis=0)
    viewport.set_skeleton_shown(True)
    x, y, _ = viewport.points_on_screen(bone[None])[0]
    around = pixels(viewport)[round(y) - 3 : round(y) + 4, round(x) - 3 : round(x) + 4]
    assert around.sum(axis=2).max() > 600


def test_props_are_axes_with_names(viewport, qtbot):
    body = RigidBody(1, "Sword", np.array([0.0, 1.2, 0.0]), np.array([1.0, 0.0, 0.0, 0.0]))
    show(viewport, qtbot, *sample(hand_frame("right"), bodies=(body,)))
    viewport.camera.target_m, viewport.camera.distance_m = body.position_m, 0.5
    viewport.view_front()
    red, green, blue = pixel_at(viewport, body.position_m + np.array([0.03, 0.0, 0.0]))
    assert red > 150 > max(green, blue)
    assert viewport.findChild(NameTags).names == ("Sword",)


def test_names_of_markers_on_demand(viewport, qtbot):
    tags = viewport.findChild(NameTags)
    show(viewport, qtbot, *sample(hand_frame("right"), hand_frame("left")))
    assert tags.names == ()
    with qtbot.waitSignal(viewport.drawn):
        viewport.set_names_shown(True)
    assert sorted(tags.names) == sorted(profile().layout.marker_names * 2)


def test_the_view_is_fitted_to_the_first_hands_until_somebody_turns_it(viewport, qtbot):
    nobody = sample(extra_m=[(3.0, 0.0, 0.0), (-3.0, 2.0, 0.0)])
    show(viewport, qtbot, *nobody)
    far = viewport.camera.distance_m
    show(viewport, qtbot, *sample(hand_frame("right")))
    near = viewport.camera.distance_m
    assert near < far / 2
    viewport.view_top()
    drag(qtbot, viewport, Qt.MouseButton.LeftButton)
    target = viewport.camera.target_m
    show(viewport, qtbot, *nobody)
    show(viewport, qtbot, *sample(hand_frame("left")))
    assert (viewport.camera.target_m == target).all()


def test_the_legend_counts(viewport, qtbot):
    frame, tracked = sample(hand_frame("left", hidden=(1, 2)), extra_m=[(0, 3, 0)])
    show(viewport, qtbot, frame, tracked)
    assert viewport.legend_text.splitlines() == [
        "Left hand tracked", "Labelled 17", "Predicted 2", "Unlabelled 1", "Ghost 0",
    ]  # fmt: skip


def test_an_empty_view_says_what_to_do(viewport, qtbot):
    assert "Devices panel" in viewport.message
    viewport.show_empty("No frames yet", "Check the cameras.")
    assert viewport.message == "No frames yet\nCheck the cameras."
    show(viewport, qtbot, *sample(hand_frame("left")))
    assert viewport.message == ""


def test_shaders_are_linked_once(viewport, qtbot, monkeypatch):
    from vispy.gloo import gl

    viewport.set_skeleton_shown(True)
    show(viewport, qtbot, *sample(hand_frame("right"), hand_frame("left")))
    links = []
    link = gl.glLinkProgram
    monkeypatch.setattr(gl, "glLinkProgram", lambda program: (links.append(program), link(program)))
    states = [HandState.TRACKED, HandState.LOST, HandState.SEARCHING]
    for i in range(30):
        hands = (
            hand_frame("right", state=states[i % 3], scale=1 + i / 100),
            hand_frame("left", hidden=tuple(range(i % 9))),
        )
        with qtbot.waitSignal(viewport.drawn):
            worn = replace(profile(), shape=HandShape.uniform(1 + (i % 3) / 10))
            viewport.show_frame(*sample(*hands, extra_m=np.ones((i * 7, 3))), worn)
        viewport.set_skeleton_shown(bool(i % 2))
        viewport.camera.orbit(0.1, 0.05)
    viewport.resize(500, 400)
    pixels(viewport)
    assert links == []


def test_five_thousand_updates(viewport, qtbot, qapp):
    frames = [sample(hand_frame("right"), hand_frame("left"), extra_m=np.ones((n, 3)), sequence=n) for n in range(7)]
    drawings = []
    viewport.drawn.connect(lambda: drawings.append(1))
    for i in range(5000):
        viewport.show_frame(*frames[i % 7], profile())
        viewport.update()
        if i % 10 == 0:
            qapp.processEvents()
    show(viewport, qtbot, *sample(hand_frame("right")))
    assert viewport.failure == "" and drawings
    assert viewport.legend_text.splitlines()[1] == "Labelled 19"


def test_keys_turn_the_camera(viewport, qtbot):
    show(viewport, qtbot, *sample(hand_frame("right")))
    looks = {}
    for key in (Qt.Key.Key_1, Qt.Key.Key_3, Qt.Key.Key_7):
        qtbot.keyClick(viewport, key)
        looks[key] = (viewport.camera.azimuth_rad, viewport.camera.elevation_rad)
    assert looks[Qt.Key.Key_1] == (0.0, 0.0)
    assert looks[Qt.Key.Key_3] == pytest.approx((np.pi / 2, 0.0))
    assert looks[Qt.Key.Key_7] == pytest.approx((0.0, np.pi / 2))
    viewport.camera.target_m = np.array([9.0, 9.0, 9.0])
    qtbot.keyClick(viewport, Qt.Key.Key_F)
    x, y, _ = viewport.points_on_screen(hand_frame("right").joints_world[:, :3, 3]).T
    assert x.min() > 0 and x.max() < SIZE[0] and y.min() > 0 and y.max() < SIZE[1]


def drag(qtbot, widget, button, modifier=Qt.KeyboardModifier.NoModifier):
    qtbot.mousePress(widget, button, modifier, QPoint(100, 100))
    # pytest-qt's mouseMove holds no button
    from PySide6.QtGui import QMouseEvent
    from PySide6.QtWidgets import QApplication

    move = QMouseEvent(
        QMouseEvent.Type.MouseMove, QPointF(150, 120), widget.mapToGlobal(QPointF(150, 120)), button, button, modifier
    )
    QApplication.sendEvent(widget, move)
    qtbot.mouseRelease(widget, button, modifier, QPoint(150, 120))


def test_the_mouse_orbits_and_pans(viewport, qtbot):
    camera = viewport.camera
    azimuth, target = camera.azimuth_rad, camera.target_m
    drag(qtbot, viewport, Qt.MouseButton.LeftButton)
    assert camera.azimuth_rad != azimuth and (camera.target_m == target).all()
    for button, modifier in (
        (Qt.MouseButton.MiddleButton, Qt.KeyboardModifier.NoModifier),
        (Qt.MouseButton.LeftButton, Qt.KeyboardModifier.ShiftModifier),
    ):
        azimuth = camera.azimuth_rad
        # what was under the pointer goes with it
        x, y, _ = viewport.points_on_screen(camera.target_m[None])[0]
        target = camera.target_m
        drag(qtbot, viewport, button, modifier)
        assert viewport.points_on_screen(target[None])[0, :2] == pytest.approx((x + 50, y + 20), abs=1e-6)
        assert camera.azimuth_rad == azimuth


def test_following_keeps_the_hand_in_the_middle(viewport, qtbot):
    viewport.set_follow_hand(True)
    hand = hand_frame("right")
    for i in range(60):
        show(viewport, qtbot, *sample(hand, sequence=i))
    x, y, _ = viewport.points_on_screen(hand.joints_world[:, :3, 3].mean(axis=0)[None])[0]
    assert abs(x - SIZE[0] / 2) < 40 and abs(y - SIZE[1] / 2) < 40


def test_it_draws_on_after_a_move_to_another_window(viewport, qtbot):
    show(viewport, qtbot, *sample(hand_frame("right")))
    window = QMainWindow()
    qtbot.addWidget(window)
    window.setCentralWidget(viewport)
    window.resize(*SIZE)
    with qtbot.waitExposed(window):
        window.show()
    qtbot.waitUntil(lambda: viewport.width() == SIZE[0])
    hand = hand_frame("left")
    show(viewport, qtbot, *sample(hand, sequence=2))
    viewport.view_fit()
    viewport.view_top()
    assert pixel_at(viewport, hand.joints_world[[0, 7], :3, 3].mean(axis=0)).mean() > 110
    assert viewport.failure == ""
    window.takeCentralWidget()


def test_a_driver_that_fails_leaves_a_reason_and_a_living_application(viewport, qtbot, monkeypatch, caplog):
    def broken(*args):
        raise RuntimeError("out of texture memory")

    monkeypatch.setattr("app.viewport.scene.Scene.draw", broken)
    viewport.show_frame(*sample(hand_frame("right")), profile())
    qtbot.waitUntil(lambda: bool(viewport.failure))
    assert "out of texture memory" in viewport.findChild(QLabel).text()
    viewport.show_frame(*sample(hand_frame("left")), profile())
    viewport.view_fit()
    viewport.set_names_shown(True)


WITHOUT_GL = """
from PySide6.QtWidgets import QApplication, QLabel
from app.viewport.viewport import Viewport
from tests.app.hand_frames import hand_frame, profile, sample
application = QApplication([])
viewport = Viewport()
viewport.show()
viewport.show_frame(*sample(hand_frame("right")), profile())
viewport.view_fit(); viewport.view_top(); viewport.set_names_shown(True); viewport.show_empty("a", "b")
application.processEvents()
print(viewport.findChild(QLabel).text())
"""


def test_without_opengl_it_says_so():
    result = subprocess.run(
        [sys.executable, "-c", WITHOUT_GL],
        cwd=ROOT,
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stderr
    assert "No 3D view" in result.stdout and "no OpenGL" in result.stdout
