"""Names of markers in the 3D view: which, where, and what is said under the pointer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt

from app import theme
from app.viewport import colours
from app.viewport.camera import OrbitCamera
from app.viewport.marker_states import MarkerState, marker_view
from app.viewport.name_tags import HoverTag, NameTags
from app.viewport.tag_places import TagPlaces
from app.viewport.tags import TOO_FAR, tags_of_markers
from tests.app.drawn import show
from tests.app.hand_frames import hand_frame, profile, sample
from tests.some import some

ROOM = (960.0, 620.0)
NAMES = profile().layout.marker_names


def crowd(seed: int, n: int = 38):
    """Keys, anchors, sizes and centres of the names of two hands."""
    rng = np.random.default_rng(seed)
    centres = np.repeat([[300.0, 280.0], [620.0, 350.0]], n // 2, axis=0)
    sizes = np.stack([rng.uniform(40, 80, n), np.full(n, 14.0)], axis=1)
    return list(range(n)), centres + rng.normal(0.0, 45.0, (n, 2)), sizes, centres


def overlaps(corners, sizes) -> int:
    low, high = corners, corners + sizes
    over = ((low[:, None] < high[None]) & (low[None] < high[:, None])).all(axis=2)
    return int(over.sum() - len(corners)) // 2


@pytest.mark.parametrize("seed", range(6))
def test_no_name_lies_over_another_while_hands_move(seed):
    keys, anchors, sizes, centres = crowd(seed)
    places, steps = TagPlaces(), []
    last = None
    for i in range(40):
        moved = anchors + 2.0 * np.sin(i / 9 + np.arange(len(keys))[:, None]) + 1.5 * i
        corners = places.place(keys, moved, sizes, centres + 1.5 * i, ROOM, moved, 4.0)
        assert overlaps(corners, sizes) == 0
        assert (corners >= 0).all() and (corners + sizes <= ROOM).all()
        offset = corners - moved
        steps += [] if last is None else [np.abs(offset - last).max(axis=1)]
        last = offset
    # the way in which a name hangs on its marker hardly ever changes
    assert (np.concatenate(steps) > 4.0).mean() < 0.03


def test_a_lone_name_is_beside_its_marker_and_away_from_the_hand():
    for angle in some(np.linspace(0.0, 2 * np.pi, 9)):
        way = np.array([np.cos(angle), np.sin(angle)])
        anchor, size = np.array([[400.0, 300.0]]), np.array([[60.0, 14.0]])
        corner = TagPlaces().place(["a"], anchor, size, anchor - 80 * way, ROOM, anchor, 4.0)
        low, high = corner[0] - anchor[0], corner[0] + size[0] - anchor[0]
        gap = np.linalg.norm(np.clip(0.0, low, high))
        assert 2.0 < gap < 20.0, "beside, and not on it"
        assert ((low + high) / 2) @ way > 0.85 * np.linalg.norm((low + high) / 2)


def test_a_view_from_elsewhere_places_names_as_if_it_were_the_first():
    keys, anchors, sizes, centres = crowd(3)
    places = TagPlaces()
    places.place(keys, anchors, sizes, centres, ROOM, anchors, 4.0)
    turned = centres + (anchors - centres)[:, ::-1] * (1.0, -1.4)
    again = places.place(keys, turned, sizes, centres, ROOM, turned, 4.0)
    np.testing.assert_array_equal(again, TagPlaces().place(keys, turned, sizes, centres, ROOM, turned, 4.0))


def tags(distance_m: float, by_digit: bool = False):
    left, right = hand_frame("left", hidden=(3,)), hand_frame("right")
    frame, tracked = sample(left, right)
    view = marker_view(frame, tracked, profile().layout)
    camera = OrbitCamera(np.array([0.0, 1.0, 0.0]), distance_m)
    return tags_of_markers(view, camera.project(view.positions_m, ROOM), tracked, profile().layout, by_digit)


def test_names_say_what_is_hidden_and_whose_digit_it_is():
    near = tags(1.0)
    assert [tag.text for tag in near] == [*NAMES, *NAMES]
    assert len({tag.key for tag in near}) == 2 * len(NAMES)
    predicted = colours.STATE_CODES[MarkerState.PREDICTED]
    assert [i for i, tag in enumerate(near) if tag.bar == predicted] == [3]
    assert near[3].ink == predicted and {tag.ink for i, tag in enumerate(near) if i != 3} == {theme.TEXT}
    layout = profile().layout
    for i, tag in enumerate(tags(1.0, by_digit=True)):
        joint = layout.joints[i % len(NAMES)]
        assert tag.bar == colours.DIGIT_CODES[(joint - 1) // 3 if joint else -1]


def test_hands_that_are_far_say_so_instead():
    far = tags(6.0)
    assert [tag.text for tag in far] == [f"Left: {TOO_FAR}", f"Right: {TOO_FAR}"]
    behind = tags(-2.0)
    assert behind == []


def test_names_are_drawn_beside_their_markers(viewport, qtbot):
    hand = hand_frame("right")
    show(viewport, qtbot, *sample(hand))
    viewport.set_names_shown(True)
    viewport.view_top()
    shown = viewport.findChild(NameTags)
    qtbot.waitUntil(lambda: len(shown.names) == len(NAMES))
    boxes = list(shown.boxes.values())
    assert len(boxes) == len(NAMES)
    corners = np.array([(box.x(), box.y()) for box in boxes])
    sizes = np.array([(box.width(), box.height()) for box in boxes])
    assert overlaps(corners, sizes) == 0
    screen = viewport.points_on_screen(hand.markers_world_m)[:, :2]
    assert np.linalg.norm(np.clip(screen, corners, corners + sizes) - screen, axis=1).max() < 120.0
    image = shown.grab().toImage()
    for (x, y), tag in zip(corners, shown._tags, strict=True):
        bar = image.pixelColor(round(x) + 1, round(y) + 7)
        assert (bar.red(), bar.green(), bar.blue()) == pytest.approx(np.array(colours.rgb(tag.bar)) * 255, abs=12)
    viewport.set_names_shown(False)
    qtbot.waitUntil(lambda: shown.names == ())


def test_the_pointer_names_one_marker_at_once_and_follows_it(viewport, qtbot):
    hand = replace(hand_frame("right"), marker_std_m=np.full(19, 4e-4))
    show(viewport, qtbot, *sample(hand))
    said = viewport.findChild(HoverTag)
    x, y, _ = viewport.points_on_screen(hand.markers_world_m)[9]
    qtbot.mouseMove(viewport, QPoint(5, 5))
    assert said.text == ""
    qtbot.mouseMove(viewport, QPoint(round(x), round(y)))
    qtbot.waitUntil(lambda: said.text == f"Right {NAMES[9]}: seen ±0.4 mm")
    box = said.geometry()
    beside = np.array([x, y]) - np.clip([x, y], (box.left(), box.top()), (box.right(), box.bottom()))
    assert 5 < np.linalg.norm(beside) < 25 and viewport.rect().contains(box)
    show(viewport, qtbot, *sample(replace(hand, point=np.where(np.arange(19) == 9, -1, hand.point)), sequence=1))
    assert said.text == f"Right {NAMES[9]}: hidden, predicted ±0.4 mm"
    qtbot.mousePress(viewport, Qt.MouseButton.LeftButton, pos=QPoint(round(x), round(y)))
    show(viewport, qtbot, *sample(hand, sequence=2))
    assert said.text == "", "not while the view is turned"
    qtbot.mouseRelease(viewport, Qt.MouseButton.LeftButton, pos=QPoint(round(x), round(y)))
    show(viewport, qtbot, *sample(hand_frame("left"), sequence=3))
    away = viewport.points_on_screen(hand_frame("left").markers_world_m)[:, :2] - (x, y)
    assert np.hypot(*away.T).min() > 12 and said.text == ""


def test_a_doubted_name_has_a_question_mark_and_says_how_much(viewport, qtbot):
    sure = np.full(19, 0.998)
    sure[[4, 9]] = 0.31, 0.72
    hand = replace(hand_frame("right"), label_confidence=sure)
    hidden = replace(hand_frame("right", hidden=(2,)), label_confidence=sure)
    frame, tracked = sample(hand)
    view = marker_view(frame, tracked, profile().layout)
    screen = OrbitCamera(np.array([0.0, 1.0, 0.0]), 1.0).project(view.positions_m, ROOM)
    shown = tags_of_markers(view, screen, tracked, profile().layout, False)
    doubted = {tag.text: tag.ink for tag in shown if tag.ink != theme.TEXT}
    assert doubted == {f"{NAMES[4]} ?": theme.PROBLEM, f"{NAMES[9]} ?": theme.WARNING}
    show(viewport, qtbot, frame, tracked)
    viewport.view_top()

    def said(marker):
        x, y, _ = viewport.points_on_screen(hand.markers_world_m)[marker]
        return viewport.text_at(QPoint(round(x), round(y)))

    assert said(4) == f"Right {NAMES[4]}: seen\n31 % sure that its label is right"
    assert said(16) == f"Right {NAMES[16]}: seen\n>99 % sure that its label is right"
    show(viewport, qtbot, *sample(hidden, sequence=1))
    assert said(2) == f"Right {NAMES[2]}: hidden, predicted\n>99 % sure that it is really hidden"
