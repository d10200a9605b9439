from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app.reconstruction.known_hands import NOISE_M, Made, made
from core.calibration import hand as calibration
from core.calibration.findings import NOT_SEEN
from core.calibration.hand import HandCalibration, calibrate_hand, still_digits
from core.errors import CancelledError, PhalanxError
from core.frames import MarkerFrame
from core.hand.mirror import mirror_points
from core.hand.model import template
from core.hand.shape import SHAPE_NAMES
from core.hand.skeleton import DIGITS
from core.profile import Profile


@pytest.fixture(scope="module")
def swapped() -> HandCalibration:
    """Of a performance in which every 20th frame carries two wrong labels."""
    scene = made(1)
    return calibrate_hand(scene.frames, scene.given, labels=scene.labels, performer="Ada")


def _bone_errors_m(found: HandCalibration, scene: Made) -> np.ndarray:
    ours, theirs = found.profile.hand.skeleton, scene.truth.hand.skeleton
    return np.abs(ours.bone_lengths_m - theirs.bone_lengths_m)[1:]


def _marker_errors_m(profile: Profile, scene: Made) -> np.ndarray:
    return np.linalg.norm(profile.worn.positions_m - scene.truth.worn.positions_m, axis=1)


@pytest.mark.parametrize("seed", [1, 2])
def test_bones_and_markers_are_found_from_motion(seed: int) -> None:
    """Of an adult of the population: markers 4 mm off along the skin, 0.3 mm noise, labels swapped in 5 % of frames."""
    scene = made(seed)
    found = calibrate_hand(scene.frames, scene.given, labels=scene.labels)
    bones = _bone_errors_m(found, scene)
    assert bones.mean() < 0.0007
    assert bones.max() < 0.004  # a middle phalanx, whose ends no marker shows
    markers = _marker_errors_m(found.profile, scene)
    assert markers.mean() < 0.0008
    before = _marker_errors_m(replace(scene.given, shape=found.profile.shape), scene)
    assert markers.mean() < 0.3 * before.mean()
    # No size of the template's proportions comes as near.
    true = scene.truth.hand.skeleton.bone_lengths_m[1:]
    plain = template().skeleton.bone_lengths_m[1:]
    assert bones.mean() < 0.7 * min(np.abs(size * plain - true).mean() for size in np.linspace(0.7, 1.4, 100))
    assert found.noise_m == pytest.approx(NOISE_M, rel=0.15)
    assert found.held_out.after.overall_m < 2.0 * NOISE_M
    assert found.held_out.after.overall_m < 0.15 * found.held_out.before.overall_m


def test_true_errors_are_as_large_as_they_are_said_to_be(swapped: HandCalibration) -> None:
    scene = made(1)
    errors = np.log([m.ratio for m in swapped.measures]) - np.log(scene.truth.shape.ratios)
    scores = errors / [m.std for m in swapped.measures]
    assert 0.3 < np.sqrt((scores**2).mean()) < 2.0


def test_swapped_labels_are_left_aside(swapped: HandCalibration) -> None:
    assert 0.001 < swapped.mislabelled < 0.02  # 2 of 19 in every 20th frame: 0.5 %
    calm = made(1, swapped=0.0)
    clean = calibrate_hand(calm.frames, calm.given, labels=calm.labels)
    assert clean.mislabelled < 0.001
    errors, dirty = _bone_errors_m(clean, calm).mean(), _bone_errors_m(swapped, made(1)).mean()
    assert dirty < errors + 0.0004


def test_the_profile_holds_what_was_found(swapped: HandCalibration) -> None:
    profile, given = swapped.profile, made(1).given
    assert (profile.performer, profile.scale, profile.sides) == ("Ada", 1.0, given.sides)
    assert profile.subspace is given.subspace
    assert profile.layout.marker_names == given.layout.marker_names
    assert np.array_equal(profile.layout.joints, given.layout.joints)
    assert [m.name for m in swapped.measures] == list(SHAPE_NAMES)
    assert [m.ratio for m in swapped.measures] == profile.shape.ratios.tolist()
    moved = np.asarray([marker.moved_m for marker in swapped.markers])
    np.testing.assert_allclose(profile.layout.positions_m, given.layout.positions_m + moved, atol=1e-15)
    again = Profile.from_json(profile.to_json())
    np.testing.assert_allclose(again.worn.positions_m, profile.worn.positions_m, atol=2e-6)


def test_figures_are_of_frames_that_were_used_and_of_others(swapped: HandCalibration) -> None:
    assert swapped.key.shots == swapped.keyframes == calibration.KEYFRAMES
    assert swapped.held_out.shots == min(calibration.HELD_OUT, swapped.shots - swapped.keyframes)
    joints = swapped.profile.layout.joints
    for compared in (swapped.key, swapped.held_out):
        assert np.array_equal(compared.before.count, compared.after.count)
        assert set(compared.after.by_digit(joints)) == {"palm", *DIGITS}
        assert all(
            after < compared.before.by_digit(joints)[part] for part, after in compared.after.by_digit(joints).items()
        )
        squares = compared.after.count * compared.after.rms_m**2
        assert compared.after.overall_m == pytest.approx(np.sqrt(squares.sum() / compared.after.count.sum()))


def test_points_without_labels_are_labelled_first() -> None:
    scene = made(3, swapped=0.0, count=800, seconds=20.0)
    random = np.random.default_rng(0)
    frames = [replace(f, points_m=f.points_m[order := random.permutation(19)], ids=f.ids[order]) for f in scene.frames]
    found = calibrate_hand(frames, scene.given)
    assert _bone_errors_m(found, scene).mean() < 0.0015
    assert found.held_out.after.overall_m < 2.0 * NOISE_M


def test_left_hands_give_the_same_profile() -> None:
    """A left hand, and both hands: the mirror image of a performance calibrates to the same hand."""
    scene = made(1)
    found = calibrate_hand(scene.frames, scene.given, labels=scene.labels)
    mirrored = [replace(frame, points_m=mirror_points(frame.points_m)) for frame in scene.frames]
    labels = {identity: ("left", marker) for identity, (_, marker) in scene.labels.items()}
    left = calibrate_hand(mirrored, scene.given.with_sides(("left",)), labels=labels)
    np.testing.assert_allclose(left.profile.shape.ratios, found.profile.shape.ratios, rtol=1e-6)
    np.testing.assert_allclose(left.profile.layout.positions_m, found.profile.layout.positions_m, atol=1e-7)


def test_both_hands_count_as_one_performer() -> None:
    scene = made(2, sides=("left", "right"), count=200, swapped=0.0)
    found = calibrate_hand(scene.frames, scene.given, labels=scene.labels)
    assert found.shots == 400
    assert _bone_errors_m(found, scene).mean() < 0.001


def test_what_no_marker_saw_is_named() -> None:
    """A thumb in a splint: its bones are the population's, and that is said."""
    scene = made(1, still_thumb=True)
    found = calibrate_hand(scene.frames, scene.given, labels=scene.labels)
    seen = {m.name: m.seen for m in found.measures}
    assert found.still == ("thumb",)
    assert seen["thumb_distal"] < 0.1 < 0.8 < seen["index_proximal"]
    assert any(words.startswith("Thumb: length of its") for words in found.unseen)
    assert found.profile.calibrated is not None
    assert found.profile.calibrated.not_seen == (*found.unseen, "Hardly moved: thumb.")
    moving = calibrate_hand(made(1).frames, scene.given, labels=scene.labels)
    now = {m.name: m.seen for m in moving.measures}
    assert now["thumb_proximal"] > seen["thumb_proximal"] + 0.1
    assert moving.still == ()


def test_a_finger_without_markers_is_not_seen() -> None:
    """schroeder6 has none on the ring finger."""
    scene = made(4, "schroeder6", swapped=0.0)
    found = calibrate_hand(scene.frames, scene.given, labels=scene.labels)
    seen = {m.name: m.seen for m in found.measures}
    assert seen["ring_proximal"] < NOT_SEEN
    assert any(words.startswith("Ring: length of its bones") for words in found.unseen)


def test_a_hand_that_was_measured_stays_where_nothing_is_seen() -> None:
    """The ring finger of schroeder6 has no marker: it keeps the bones of the profile, or else gets the population's."""
    scene = made(4, "schroeder6", swapped=0.0)
    known = replace(scene.given, shape=scene.truth.shape)
    ring = [SHAPE_NAMES.index(f"ring_{bone}") for bone in ("proximal", "middle", "distal")]
    truth = np.log(scene.truth.shape.ratios[ring])
    errors = [
        np.abs(np.log(calibrate_hand(scene.frames, given, labels=scene.labels).profile.shape.ratios[ring]) - truth)
        for given in (known, scene.given)
    ]
    assert errors[0].max() < 0.03
    assert errors[0].mean() < 0.5 * errors[1].mean()


def test_markers_alone_on_a_hand_that_is_known() -> None:
    """As Han 2018, 4.5: the shape stays to the bit, and the markers are nearer than if the shape had to be found."""
    scene = made(2)
    known = replace(scene.given, shape=scene.truth.shape, scale=1.0)
    kept = calibrate_hand(scene.frames, known, labels=scene.labels, keep_shape=True)
    np.testing.assert_allclose(kept.profile.shape.ratios, scene.truth.shape.ratios, rtol=1e-12)
    assert (kept.measures, kept.unseen) == ((), [])
    errors = _marker_errors_m(kept.profile, scene)
    assert errors.mean() < 0.0006
    assert errors.mean() < _marker_errors_m(known, scene).mean() / 8.0
    assert kept.held_out.after.overall_m < 2.0 * NOISE_M
    said = [marker.std_m for marker in kept.markers]
    free = [marker.std_m for marker in calibrate_hand(scene.frames, scene.given, labels=scene.labels).markers]
    assert all(k < f for k, f in zip(said, free, strict=True))


def test_progress_rises_to_the_end_and_cancels() -> None:
    scene = made(1)
    told: list[tuple[float, str]] = []
    calibrate_hand(
        scene.frames, scene.given, labels=scene.labels, progress=lambda share, text: told.append((share, text))
    )
    shares = [share for share, _ in told]
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] < shares[-1] == 1.0
    assert {text for _, text in told} >= {"Finding the hand's shape", "Finding shape and markers", "Done"}
    for stop_at in ("Solving", "Finding the hand's shape", "Finding shape and markers", "Trying the result"):
        with pytest.raises(CancelledError):
            calibrate_hand(
                scene.frames, scene.given, labels=scene.labels, progress=lambda _, text, at=stop_at: at not in text
            )


def test_a_recording_too_short_to_hold_frames_back() -> None:
    scene = made(2, count=60, seconds=10.0, swapped=0.0)
    found = calibrate_hand(scene.frames, scene.given, labels=scene.labels)
    assert (found.keyframes, found.held_out.shots) == (60, 0)
    assert np.isnan(found.held_out.after.overall_m)
    assert found.key.after.overall_m < 2.0 * NOISE_M


def test_equal_frames_give_equal_bits() -> None:
    scene = made(2, count=100, seconds=10.0)
    first, second = (calibrate_hand(scene.frames, scene.given, labels=scene.labels, keyframes=40) for _ in range(2))
    assert first.profile.to_json() == second.profile.to_json()


def _frozen(frame: MarkerFrame, at: int) -> MarkerFrame:
    return replace(frame, points_m=made(1).frames[0].points_m + 0.0001 * np.sin(at))


def test_too_little_is_told() -> None:
    scene = made(1)
    with pytest.raises(PhalanxError, match=r"tracked well in 0 of 0 frames; at least 20.*layout"):
        calibrate_hand([], scene.given, labels=scene.labels)
    with pytest.raises(PhalanxError, match=r"in 10 of 10 frames"):
        calibrate_hand(scene.frames[30:40], scene.given, labels=scene.labels)
    with pytest.raises(PhalanxError, match=r"hardly moves.*bend and spread every finger"):
        frozen = [_frozen(frame, i) for i, frame in enumerate(scene.frames[:60])]
        calibrate_hand(frozen, scene.given, labels=scene.labels)
    empty = [replace(f, points_m=np.zeros((0, 3)), ids=np.zeros(0, np.int64)) for f in scene.frames[:30]]
    with pytest.raises(PhalanxError, match=r"in 0 of 30 frames"):
        calibrate_hand(empty, scene.given, labels=scene.labels)


def test_still_digits() -> None:
    thetas = np.zeros((100, 26))
    thetas[:, 6 + 4 + 1] = np.linspace(0.0, 1.0, 100)  # index flexes
    thetas[:, 6 + 8] = np.linspace(0.0, 0.4, 100)  # middle spreads, which does not bend it
    assert still_digits(thetas) == ("thumb", "middle", "ring", "pinky")
