"""Names that came with a recording: what is wrong over all of it is found, and what is right is left alone."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import islice

import numpy as np
import pytest

from core.engine import Engine
from core.frames import NO_ID, HandKey, HandState, MarkerFrame
from core.labelling.name_check import believed, check_names, check_sides
from core.labelling.name_moves import NameFits
from core.markers.layout import load_layout
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile
from tests.data import data_path

RATE_HZ = 100.0
RIGHT = HandKey(0, "right")


@cache
def frames(layout_name: str, misplaced_m: float = 0.005, n: int = 400) -> list[MarkerFrame]:
    """A right hand whose markers sit some millimetres off; id k is marker k."""
    layout = load_layout(layout_name)
    off = np.random.default_rng(1).normal(0.0, misplaced_m / np.sqrt(3), layout.positions_m.shape)
    worn = Profile("", replace(layout, positions_m=layout.positions_m + off), sides=("right",))
    sent = list(islice(MarkerStream(Performer(worn), RATE_HZ, noise_m=0.0003).frames(), n))
    first = {identity: k for k, identity in enumerate(sorted(sent[0].ids.tolist()))}
    return [replace(frame, ids=np.array([first[i] for i in frame.ids.tolist()])) for frame in sent]


def profile(layout_name: str, *sides: str) -> Profile:
    return Profile("", load_layout(layout_name), sides=sides or ("right",))


def names(layout_name: str, side: str = "right", **renamed: str) -> dict[int, tuple[str, int]]:
    """Id to hand and marker; renamed: of a marker, what its point is called."""
    markers = load_layout(layout_name).marker_names
    return {k: (side, markers.index(renamed.get(name, name))) for k, name in enumerate(markers)}


@pytest.mark.parametrize("layout", ["han19", "schroeder17", "alexanderson13", "qualisys13", "pavllo9", "schroeder6"])
def test_right_names_pass_though_every_marker_sits_5_mm_off(layout):
    assert check_names(frames(layout), RATE_HZ, profile(layout), names(layout)) == ()


@pytest.mark.parametrize("layout", ["han19", "alexanderson13", "schroeder8"])
def test_a_right_hand_taken_as_a_left_one(layout):
    (fault,) = check_names(frames(layout), RATE_HZ, profile(layout, "left"), names(layout, "left"))
    assert (fault.kind, fault.hand, fault.rows) == ("side", HandKey(0, "left"), None)
    assert fault.markers == fault.wanted == tuple(range(len(load_layout(layout).marker_names)))
    assert fault.better_m < 0.004 < fault.rms_m
    assert believed(frames(layout), names(layout, "left"), [fault])[1] == {}


@pytest.mark.parametrize("layout", ["han19", "qualisys13"])
def test_a_hand_that_was_named_here_and_is_the_other_one(layout):
    """The engine bends a left hand to a right one's points where no right hand is looked for."""
    unnamed = [replace(frame, ids=np.full(len(frame.ids), NO_ID)) for frame in frames(layout, 0.001, 200)]
    for side, wrong in (("left", True), ("right", False)):
        engine = Engine(profile(layout, side))
        solved = [engine.step(frame) for frame in unnamed]
        tracked = np.mean([frame.hands[0].state is HandState.TRACKED for frame in solved])
        faults = check_sides(unnamed, solved, engine.profiles)
        assert tracked > 0.2  # else there is nothing to be told
        if not wrong:
            assert faults == ()
            continue
        (fault,) = faults
        assert (fault.kind, fault.hand, fault.rows) == ("side", HandKey(0, "left"), None)
        assert fault.better_m < 0.003 < fault.rms_m


def test_sides_are_not_doubted_where_both_are_looked_for():
    engine = Engine(profile("han19", "left", "right"))
    sent = frames("han19", n=60)
    assert check_sides(sent, [engine.step(frame) for frame in sent], engine.profiles) == ()


@pytest.mark.parametrize(
    "layout, one, other",
    [
        ("han19", "IndexTip", "MiddleTip"),
        ("han19", "BackHand1", "BackHand2"),
        ("han19", "RingTip", "RingPIP"),
        ("qualisys13", "index_tip", "middle_tip"),
    ],
)
def test_two_names_exchanged_throughout(layout, one, other):
    given = names(layout, **{one: other, other: one})
    (fault,) = check_names(frames(layout), RATE_HZ, profile(layout), given)
    markers = load_layout(layout).marker_names
    wrong = {markers.index(one), markers.index(other)}
    assert fault.kind == "names" and set(fault.markers) == wrong and fault.rows is None
    assert fault.wanted == fault.markers[::-1]
    kept_frames, kept = believed(frames(layout), given, [fault])
    assert kept_frames == frames(layout)
    assert kept == {k: name for k, name in given.items() if name[1] not in wrong}


def test_names_one_finger_on():
    """Tips alone: those names are not used. Whole fingers: more is wrong than right, and nothing is."""
    fingers = ["Index", "Middle", "Ring", "Pinky"]
    on = dict(zip(fingers, [*fingers[1:], fingers[0]], strict=True))
    markers = load_layout("han19").marker_names
    tips = {f"{finger}Tip": f"{following}Tip" for finger, following in on.items()}
    (fault,) = check_names(frames("han19"), RATE_HZ, profile("han19"), names("han19", **tips))
    called = {markers[k]: markers[w] for k, w in zip(fault.markers, fault.wanted, strict=True)}
    assert called == {name: tip for tip, name in tips.items()}
    whole = {f"{a}{part}": f"{b}{part}" for a, b in on.items() for part in ("MCP", "PIP", "Tip")}
    (fault,) = check_names(frames("han19"), RATE_HZ, profile("han19"), names("han19", **whole))
    assert fault.kind == "names" and fault.markers == tuple(range(19))
    called = {markers[k]: markers[w] for k, w in zip(fault.markers, fault.wanted, strict=True) if k != w}
    assert called == {name: marker for marker, name in whole.items()}


@pytest.mark.parametrize("factor", [1000.0, 0.001, 10.0, 0.1])
def test_another_unit(factor):
    wrong = [replace(frame, points_m=frame.points_m * factor) for frame in frames("han19")]
    (fault,) = check_names(wrong, RATE_HZ, profile("han19"), names("han19"))
    assert fault.kind == "unit" and fault.markers == tuple(range(19))
    assert fault.rms_m / fault.better_m == pytest.approx(factor, rel=0.7)


def test_names_exchanged_in_a_part_of_the_recording(monkeypatch):
    """The stretch is found to within a frame or two of where it begins and ends; only there the points lose names. Its
    bounds are looked for near its ends alone."""
    fitted, costs_m2 = [], NameFits.costs_m2
    monkeypatch.setattr(NameFits, "costs_m2", lambda fits, shots: fitted.extend(shots) or costs_m2(fits, shots))
    one, other = (load_layout("han19").marker_names.index(name) for name in ("IndexTip", "MiddleTip"))
    swap = {one: other, other: one}
    sent = [
        replace(frame, ids=np.array([swap.get(i, i) for i in frame.ids.tolist()])) if 150 <= row < 230 else frame
        for row, frame in enumerate(frames("han19"))
    ]
    (fault,) = check_names(sent, RATE_HZ, profile("han19"), names("han19"))
    assert fault.kind == "names" and set(fault.markers) == {one, other}
    assert fault.rows is not None
    assert abs(fault.rows[0] - 150) <= 2 and abs(fault.rows[1] - 229) <= 2
    assert 4 <= len(fitted) < 50  # all of the stretch were 182
    kept, given = believed(sent, names("han19"), [fault])
    assert given == names("han19")
    first, last = fault.rows
    for row, (frame, before) in enumerate(zip(kept, sent, strict=True)):
        if first <= row <= last:
            assert sorted(frame.ids.tolist()) == sorted([NO_ID, NO_ID, *(set(range(19)) - {one, other})])
            assert frame.points_m is before.points_m
        else:
            assert frame is before


def test_one_stray_point_is_not_a_matter_of_names():
    """A marker 200 mm off throughout is left out frame by frame; no other names explain it."""
    tip = load_layout("han19").marker_names.index("ThumbTip")
    off = []
    for frame in frames("han19"):
        points = frame.points_m.copy()
        points[frame.ids == tip] += (0.0, 0.2, 0.0)
        off.append(replace(frame, points_m=points))
    assert check_names(off, RATE_HZ, profile("han19"), names("han19")) == ()


@pytest.mark.parametrize("user", [1, 2, 3, 4])
def test_real_recordings_pass(user):
    from app.labels import label_map
    from core.takes.formats import read_recording

    paths = sorted(data_path("han2018", "trc").glob(f"user{user}_*.trc"))
    assert len(paths) == 2  # a left and a right hand
    for path in paths:
        recording, worn = read_recording(path), profile("han19", "left", "right")
        given = label_map(recording, worn)
        assert given is not None and {hand for hand, _ in given.values()} == {path.stem.rpartition("_")[2]}
        assert check_names(list(recording.frames()), recording.rate_hz, worn, given) == ()


def test_a_real_glove_passes_for_all_of_its_minute():
    from app.labels import label_map
    from core.takes.formats import read_recording

    recording, worn = read_recording(data_path("qualisys_hand", "recording.tsv")), profile("qualisys13", "right")
    given = label_map(recording, worn)
    assert given is not None and len(given) == 13
    assert check_names(list(recording.frames()), recording.rate_hz, worn, given) == ()
