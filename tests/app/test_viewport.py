"""Hands, markers and props as they are drawn: pixels, not calls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.viewport import colours
from app.viewport.hand_visual import skinning_uniforms, vertex_normals
from app.viewport.marker_states import MarkerState
from app.viewport.name_tags import NameTags
from core.frames import HandState, RigidBody
from core.hand.mirror import mirror_points, mirror_transforms
from core.hand.model import template
from core.hand.shape import HandShape
from tests.app.drawn import SIZE, pixel_at, pixels, show, silhouette, surface_m
from tests.app.hand_frames import hand_frame, profile, sample


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
    wanted = colours.STATE_COLORS[MarkerState.PREDICTED, :3] * 255
    assert np.abs(around - wanted).sum(axis=1).min() < 20, "its ring"
    assert around[40].sum() < 0.5 * wanted.sum(), "its middle"


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


def test_the_legend_counts(viewport, qtbot):
    frame, tracked = sample(hand_frame("left", hidden=(1, 2)), extra_m=[(0, 3, 0)])
    show(viewport, qtbot, frame, tracked)
    assert viewport.legend_text.splitlines() == [
        "Left hand tracked", "Labelled 17", "Predicted 2", "Unlabelled 1", "Ghost 0",
    ]  # fmt: skip
