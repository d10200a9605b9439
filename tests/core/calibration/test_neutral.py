"""The zeros of joint angles: what a trial tells, what they do to an angle, and how a profile keeps them."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from core.calibration.fixed import FixedCovariance
from core.calibration.neutral import Neutral, NeutralHand
from core.calibration.neutral_trial import LEAST_FRAMES, MOST_MOVED_RAD, far_angles, held_hands, neutral_of
from core.calibration.priors import fixed_covariance
from core.calibration.record import Calibrated
from core.errors import FormatError, PhalanxError
from core.frames import HandFrame, HandState, Times, TrackedFrame
from core.hand.limits import JointLimits
from core.hand.poses import pose
from core.hand.shape import HandShape
from core.hand.skeleton import DIGIT_DOF_NAMES
from core.kinematics.forward import joints_world, markers_world
from core.profile import Profile, load_profile
from core.props.prop import Prop

PROFILE = replace(load_profile("han19"), scale=1.0)
RATE_HZ = 100.0
RING_DIP = DIGIT_DOF_NAMES.index("ring_dip_flexion")
STD_RAD = np.radians(1.5)
RANDOM = np.random.default_rng(6)


def hand(angles, side="right", state=HandState.TRACKED, hidden=()):
    theta = np.concatenate([[0.1, 1.0, 0.0, 0.1, 0.2, 0.3], angles])
    skeleton, layout = PROFILE.hand.skeleton, PROFILE.worn
    markers = markers_world(skeleton, theta, layout.joints, layout.positions_m)
    m = len(markers)
    point = np.arange(m)
    point[list(hidden)] = -1
    return HandFrame(
        side, state, theta, joints_world(skeleton, theta), markers, point, np.ones(m), np.full(26, STD_RAD),
        np.full(m, 1e-3), 0.001,
    )  # fmt: skip


def stretch(n=100, **sides):
    """Frames and times. sides: of each hand a function of the frame's number, or None for a hand never seen."""
    frames = [
        TrackedFrame(i, Times(i / RATE_HZ, i / RATE_HZ, 0.0), tuple(made(i) for made in sides.values()))
        for i in range(n)
    ]
    return frames, np.arange(n) / RATE_HZ


def still(angles, side="right", **more):
    return lambda i: hand(angles, side, **more)


def trial(zero_rad, std_rad=0.02, hidden=(), source="flat.c3d", from_s=2.0):
    return NeutralHand(
        np.full(20, zero_rad), np.full(20, std_rad), np.zeros(20), hidden, source, from_s, 4.0, "2026-03-01T09:00:00"
    )


def test_an_angle_is_reported_less_its_zero_and_as_sure_as_both():
    zero = replace(trial(0.0), zero_rad=RANDOM.normal(0.0, 0.2, 20), std_rad=RANDOM.uniform(0.0, 0.1, 20))
    theta, std = RANDOM.normal(0.0, 1.0, (7, 26)), RANDOM.uniform(0.01, 0.2, (7, 26))
    std[3] = np.nan
    kept = theta.copy(), std.copy()
    reported, sure = Neutral({"left": zero}).reported("left", theta, std)
    np.testing.assert_array_equal(reported[:, :6], theta[:, :6])
    np.testing.assert_array_equal(reported[:, 6:], theta[:, 6:] - zero.zero_rad)
    np.testing.assert_array_equal(sure[:, :6], std[:, :6])
    np.testing.assert_allclose(sure[:, 6:] ** 2, std[:, 6:] ** 2 + zero.std_rad**2, rtol=1e-12)
    assert np.isnan(sure[3]).all()
    np.testing.assert_array_equal(theta, kept[0])
    np.testing.assert_array_equal(std, kept[1])
    other, its = Neutral({"left": zero}).reported("right", theta, std)
    assert other is theta and its is std


def test_the_words_tell_hands_apart_only_where_they_differ():
    one, two = trial(0.1), trial(0.1, source="second.trc", from_s=1.25)
    both = ("left", "right")
    assert Neutral({"left": one, "right": one}).words(both) == "angles from the neutral trial of flat.c3d, 2.0 to 4.0 s"
    assert Neutral({"right": one}).words(("right",)) == "angles from the neutral trial of flat.c3d, 2.0 to 4.0 s"
    assert Neutral({"right": one}).words(both) == "right angles from the neutral trial of flat.c3d, 2.0 to 4.0 s"
    assert Neutral({"right": one}).words(("left",)) == ""
    assert Neutral({"right": two, "left": one}).words(both) == (
        "left angles from the neutral trial of flat.c3d, 2.0 to 4.0 s, "
        "right angles from the neutral trial of second.trc, 1.2 to 4.0 s"
    )


def test_a_profile_keeps_it_and_only_such_a_profile_is_of_the_newest_version():
    plain = load_profile("han19")
    zero = replace(
        trial(0.0, hidden=("ring_dip_flexion",)),
        zero_rad=RANDOM.normal(0.0, 0.2, 20).round(9),
        std_rad=RANDOM.uniform(0.0, 0.1, 20).round(9),
        given_rad=RANDOM.normal(0.0, 0.2, 20).round(9),
    )
    made = replace(plain, neutral=Neutral({"right": zero}))
    assert made.to_dict()["version"] == 4 and "neutral" not in plain.to_dict()
    read = Profile.from_json(made.to_json())
    assert read.to_json() == made.to_json()
    assert read.neutral is not None and list(read.neutral.hands) == ["right"]
    again = read.neutral.hands["right"]
    for name in ("zero_rad", "std_rad", "given_rad"):
        np.testing.assert_array_equal(getattr(again, name), getattr(zero, name))
    assert (again.hidden, again.source, again.from_s, again.to_s, again.date) == (
        zero.hidden, zero.source, zero.from_s, zero.to_s, zero.date,
    )  # fmt: skip
    assert replace(made, neutral=None).to_json() == plain.to_json()
    assert made.same_hands(plain), "the engine need not begin anew for it"


def test_another_hand_has_no_neutral_trial():
    made = replace(PROFILE, neutral=Neutral({"right": trial(0.1)}))
    assert made.with_hand(shape=HandShape.uniform(1.1), scale=1.0).neutral is None


def test_what_is_no_other_hand_keeps_trial_limits_and_calibration():
    record = Calibrated(FixedCovariance.of(fixed_covariance(PROFILE)), 0.0006, 120, 12.0, 0.001, 0.001)
    limits = JointLimits((("index_mcp_flexion", -20.0, 95.0),))
    zeros = trial(0.1)
    made = replace(PROFILE, neutral=Neutral({"right": replace(zeros, prior=("ring_dip_flexion",))}), limits=limits,
                   calibrated=record)  # fmt: skip
    pen = Prop("pen", np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.02, 0.05]]))
    for kept in (made.with_prop(pen), made.with_sides(("right",)), Profile.from_json(made.to_json())):
        for key in ("neutral", "limits", "calibrated"):
            assert kept.to_dict()[key] == made.to_dict()[key], key
    assert Profile.from_json(made.to_json()).neutral.hands["right"].prior == ("ring_dip_flexion",)
    other = made.with_hand(shape=HandShape.uniform(1.1))
    assert (other.neutral, other.calibrated, other.limits) == (None, None, limits)
    learnt = made.with_hand(subspace=made.subspace)
    assert (learnt.neutral, learnt.calibrated, learnt.limits) == (None, record, limits)


@pytest.mark.parametrize(
    ("keys", "value", "told"),
    [
        ((), [], r"neutral trial \[\].*must hold"),
        ((), {}, "must hold"),
        (("middle",), {}, "must hold"),
        (("right",), 3, "right is 3, not an object"),
        (("right", "zero_rad", "index_pip_flexion"), 4.0, "zero_rad: index_pip_flexion 4.0 must be a number between"),
        (("right", "zero_rad", "index_pip_flexion"), float("nan"), "index_pip_flexion nan"),
        (("right", "zero_rad", "index_pip_flexion"), True, "index_pip_flexion True"),
        (("right", "zero_rad", "sixth_pip_flexion"), 0.0, "must name all 20 angles"),
        (("right", "std_rad", "index_pip_flexion"), -0.1, "std_rad: index_pip_flexion -0.1"),
        (("right", "given_rad"), None, "given_rad None must name all 20"),
        (("right", "hidden"), ["ring_dip"], "hidden .'ring_dip'."),
        (("right", "hidden"), "all", "hidden 'all'"),
        (("right", "prior"), ["ring_dip"], "prior .'ring_dip'."),
        (("right", "from_s"), float("inf"), "from_s inf must be a number 0 or more"),
        (("right", "from_s"), 5.0, "ends at 4 s, before it begins at 5 s"),
        (("right", "source"), None, "source None must be a text"),
        (("right", "date"), "x" * 2000, "date 'x+.* must be a text of at most 1,000"),
    ],
)
def test_what_is_wrong_is_told(keys, value, told):
    data = replace(PROFILE, neutral=Neutral({"right": trial(0.1)})).to_dict()
    if not keys:
        data["neutral"] = value
    else:
        part = data["neutral"]
        for key in keys[:-1]:
            part = part[key]
        part[keys[-1]] = value
    with pytest.raises(FormatError, match=told):
        Profile.from_dict(json.loads(json.dumps(data)))


def test_a_held_hand_tells_its_median_and_noise_is_no_motion():
    angles, noise = pose("flat"), RANDOM.normal(0.0, np.radians(1.5), (200, 20))
    frames, times = stretch(200, right=lambda i: hand(angles + noise[i]))
    assert np.ptp(noise, axis=0).min() > MOST_MOVED_RAD, "frame by frame it seems to move"
    held = held_hands(frames, times, PROFILE, ("left", "right"))
    assert list(held) == ["right"]
    one = held["right"]
    assert not one.hidden.any() and one.frames == 200
    np.testing.assert_allclose(one.angle_rad, np.median(angles + noise, axis=0), atol=1e-12)
    assert one.moved_rad.max() < MOST_MOVED_RAD
    blocks = (angles + noise).reshape(10, 20, 20)
    np.testing.assert_allclose(one.std_rad, np.median(blocks, axis=1).std(axis=0, ddof=1), atol=1e-12)
    np.testing.assert_allclose(one.known_rad, STD_RAD)
    assert one.wrist_moved_m == 0.0


def test_the_zero_is_what_was_tracked_less_what_was_given():
    angles = pose("flat") + 0.1
    frames, times = stretch(right=still(angles), left=still(angles + 0.05, "left"))
    held = held_hands(frames, times, PROFILE, ("left", "right"))
    given = {"left": np.zeros(20), "right": pose("flat")}
    neutral = neutral_of(held, given, None, "flat.c3d", 2.0, 3.0, "2026-03-01")
    np.testing.assert_allclose(neutral.hands["right"].zero_rad, 0.1, atol=1e-9)
    np.testing.assert_allclose(neutral.hands["left"].zero_rad, angles + 0.05, atol=1e-9)
    np.testing.assert_allclose(neutral.hands["right"].std_rad, 0.0, atol=1e-9)
    theta, _ = neutral.reported("right", frames[0].hands[0].theta_rad, np.zeros(26))
    np.testing.assert_allclose(theta[6:], pose("flat"), atol=1e-9)
    assert neutral.hands["right"].hidden == ()


def test_only_the_hands_that_are_held_get_new_zeros():
    frames, times = stretch(right=still(pose("flat")))
    before = Neutral({"left": trial(0.3, source="before.c3d"), "right": trial(0.4)})
    held = held_hands(frames, times, PROFILE, ("left", "right"))
    after = neutral_of(held, {"right": np.zeros(20)}, before, "new.c3d", 0.0, 1.0, "2026-03-02")
    assert after.hands["left"] is before.hands["left"]
    assert after.hands["right"].source == "new.c3d"
    np.testing.assert_allclose(after.hands["right"].zero_rad, pose("flat"), atol=1e-9)


def test_an_angle_whose_markers_are_hidden_keeps_its_zero():
    names = PROFILE.layout.marker_names
    hidden = tuple(k for k in range(len(names)) if PROFILE.layout.joints[k] in (10, 11, 12))  # the ring finger
    frames, times = stretch(right=still(pose("flat"), hidden=hidden))
    one = held_hands(frames, times, PROFILE, ("right",))["right"]
    ring = np.array([name.startswith("ring") for name in DIGIT_DOF_NAMES])
    np.testing.assert_array_equal(one.hidden, ring)
    assert np.isnan(one.angle_rad[ring]).all() and np.isfinite(one.angle_rad[~ring]).all()
    given = {"right": np.zeros(20)}
    first = neutral_of({"right": one}, given, None, "a", 0.0, 1.0, "d").hands["right"]
    assert first.hidden == tuple(name for name in DIGIT_DOF_NAMES if name.startswith("ring"))
    assert not first.zero_rad[ring].any() and not first.std_rad[ring].any()
    later = neutral_of({"right": one}, given, Neutral({"right": trial(0.3, 0.02)}), "a", 0.0, 1.0, "d").hands["right"]
    np.testing.assert_array_equal(later.zero_rad[ring], 0.3)
    np.testing.assert_array_equal(later.std_rad[ring], 0.02)
    np.testing.assert_array_equal(later.zero_rad[~ring], first.zero_rad[~ring])
    # Hidden for less than half of it: what is seen tells.
    frames, times = stretch(right=lambda i: hand(pose("flat"), hidden=hidden if i % 5 < 2 else ()))
    assert not held_hands(frames, times, PROFILE, ("right",))["right"].hidden.any()


def test_motion_is_refused_with_its_joint_and_degrees():
    def moving(degrees):
        def made(i):
            angles = pose("flat").copy()
            angles[RING_DIP] += np.radians(degrees) * i / 99
            return hand(angles)

        return stretch(right=made)

    with pytest.raises(
        PhalanxError, match=r"moved: its ring_dip_flexion by (9|10)\.\d degrees \(known to \+-1\.5\); at most 5"
    ):
        held_hands(*moving(12.0), PROFILE, ("right",))
    one = held_hands(*moving(4.0), PROFILE, ("right",))["right"]
    assert one.most_moved == RING_DIP
    assert one.std_rad[RING_DIP] > np.radians(1.0), "what was held badly is less sure"
    assert np.delete(one.std_rad, RING_DIP).max() < 1e-12


def test_a_stretch_that_is_too_short_or_without_a_hand_is_refused():
    flat = still(pose("flat"))
    with pytest.raises(PhalanxError, match=r"40 frames over 0\.39 s; at least 10 frames over 0\.5 s"):
        held_hands(*stretch(40, right=flat), PROFILE, ("right",))
    frames, times = stretch(LEAST_FRAMES - 1, right=flat)
    with pytest.raises(PhalanxError, match="9 frames over 8"):
        held_hands(frames, times * RATE_HZ, PROFILE, ("right",))
    with pytest.raises(PhalanxError, match="0 frames over"):
        held_hands([], np.zeros(0), PROFILE, ("right",))
    lost = stretch(right=lambda i: hand(pose("flat"), state=HandState.LOST if i < 11 else HandState.TRACKED))
    with pytest.raises(PhalanxError, match=r"right hand was tracked in 89 of 100 frames.*--side"):
        held_hands(*lost, PROFILE, ("left", "right"))
    with pytest.raises(PhalanxError, match="left hand was not tracked in the stretch"):
        held_hands(*lost, PROFILE, ("left",))


def test_a_zero_that_is_rather_another_stance_is_told():
    zero = replace(trial(0.1, hidden=("index_pip_flexion",)), zero_rad=np.where(np.arange(20) < 7, -0.6, 0.5))
    told = dict(far_angles(zero))
    assert list(told) == ["thumb_mcp_flexion", "thumb_ip_flexion", "index_mcp_abduction", "index_mcp_flexion"]
    assert set(told.values()) == {-0.6}
    held = held_hands(*stretch(right=still(pose("fist"))), PROFILE, ("right",))
    with pytest.raises(PhalanxError, match=r"right \w+ would have a zero of \d+ degrees"):
        neutral_of(held, {"right": np.full(20, -2.6)}, None, "a", 0.0, 1.0, "d")
