"""The bench of known angles: what is called true is true, and what is printed is what was measured."""

from __future__ import annotations

import argparse
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.angle_bench import cases, gaps
from app.angle_bench.certainty import stated_fixed
from app.angle_bench.figures import KINDS, Tracked, by_joint, by_kind, correlated, figures
from app.angle_bench.mapping import mapped, zeros_rad
from app.angle_bench.motion import Motion, held_first, held_rows, independent, moving_rows
from app.angle_bench.own_error import own_error
from app.angle_bench.put_on import off, places, put_on
from app.angle_bench.rig import read_rig
from app.angle_bench.subjects import Person, Setting, WebXR, names, seen
from app.angle_bench.tracked import TRUE_HAND, WAYS, collected, generic, measured
from app.bench import angles
from core.calibration.fixed_error import SAMPLE
from core.calibration.neutral import Neutral, NeutralHand
from core.errors import FormatError, PhalanxError
from core.frames import NO_POINT, HandState
from core.hand.imports.gltf import JOINTS
from core.hand.model import skin, template
from core.hand.skeleton import DIGIT_DOF_NAMES
from core.kinematics.forward import joints_world
from core.markers.layout import load_layout
from core.takes.export import ExportOptions
from core.takes.export.fixed_std import FixedErrors
from core.takes.reprocess import solve
from tests.app.command import phalanx
from tests.data import data_path

CLEAN = Setting(rate_hz=60.0, seconds=8.0, noise_m=1e-5, skin_m=0.0)


def rig_folder():
    return data_path("hands", "webxr_generic_hand", "right.glb").parent


def test_what_is_tracked_is_what_was_true_where_nothing_is_wrong():
    person, layout = Person(901, 1.0, CLEAN), load_layout("han19")
    never = np.random.default_rng(0)
    solved = measured(person, person.wear(layout, 0.0, never), person.true(layout, 0.0, never), CLEAN, 901)
    assert solved.lost == 0.0
    found = figures([solved.moving], range(20))
    assert found.frames == len(person.measured.angles_rad) - moving_rows(60.0).start
    assert found.rmse < 0.6
    assert found.r > 0.999
    assert found.slope == pytest.approx(1.0, abs=0.01)
    np.testing.assert_allclose(np.degrees(solved.trial.zero_rad), 0.0, atol=1.0)


def test_a_hand_is_held_flat_before_it_moves():
    waves = independent(np.random.default_rng(1), 8.0, 60.0)
    motion = held_first(waves, np.random.default_rng(2), 60.0, np.zeros(20))
    assert np.ptp(np.degrees(motion.digits_rad[held_rows(60.0)]), axis=0).max() < 1.0
    assert len(motion.digits_rad[held_rows(60.0)]) == 120
    np.testing.assert_array_equal(motion.digits_rad[moving_rows(60.0)], waves.digits_rad[moving_rows(60.0)])
    steps = np.degrees(np.abs(np.diff(motion.digits_rad, axis=0)))
    assert steps.max() < 5.0, "no jump from one to the other"


def test_our_own_hand_is_mapped_to_itself():
    motion = independent(np.random.default_rng(3), 1.0, 20.0)
    found = mapped(template().skeleton, motion)
    np.testing.assert_allclose(found.angles_rad, motion.digits_rad, atol=1e-5)
    assert found.off_m.max() < 1e-6


def test_a_constant_turn_of_an_axis_is_all_that_a_zero_takes_up():
    """A hand whose index finger is bound bent by 10 degrees at the PIP has its zero there, and no other."""
    own, bent = template().skeleton, np.zeros(26)
    bent[6 + 6] = np.radians(10.0)
    world = joints_world(own, bent)
    tips = own.tip_positions_m.copy()
    tips[1] = world[6, :3, 3] + world[6, :3, :3] @ (own.tip_positions_m[1] - own.joint_positions_m[6])
    theirs = replace(own, joint_positions_m=world[:, :3, 3].copy(), tip_positions_m=tips)
    expected = np.zeros(20)
    expected[6] = 10.0
    np.testing.assert_allclose(np.degrees(zeros_rad(theirs)), expected, atol=0.01)


def test_the_webxr_hand_is_read_as_it_is_bound():
    hand = read_rig(rig_folder())
    assert hand.vertices_m.shape == (1360, 3)
    assert len(JOINTS) == 16
    np.testing.assert_allclose(hand.skeleton.joint_positions_m[0], 0.0, atol=1e-9)
    assert hand.skeleton.joint_positions_m[7, 2] == pytest.approx(-0.0917, abs=1e-3), "middle knuckle before the wrist"
    np.testing.assert_allclose(hand.skin_weights.sum(axis=1), 1.0, atol=1e-12)
    rest = joints_world(hand.skeleton, np.zeros(26))
    np.testing.assert_allclose(skin(hand, rest), hand.vertices_m, atol=1e-8)


@pytest.mark.parametrize("finger", range(1, 5))
def test_an_angle_of_the_webxr_hand_is_the_angle_between_its_bones(finger: int):
    """Closing the PIP by 40 degrees turns the middle phalanx by 40 against the proximal one, to the palm."""
    skeleton = read_rig(rig_folder()).skeleton

    def bones(flexion_deg: float) -> np.ndarray:
        theta = np.zeros(26)
        theta[6 + 4 * finger + 2] = np.radians(flexion_deg)
        centres = joints_world(skeleton, theta)[:, :3, 3]
        return np.diff(centres[3 * finger + 1 : 3 * finger + 4], axis=0)

    (_, before), (proximal, after) = bones(0.0), bones(40.0)
    turned = np.degrees(np.arccos(before @ after / np.linalg.norm(before) / np.linalg.norm(after)))
    assert turned == pytest.approx(40.0, abs=0.5)
    assert after[1] < before[1], "to the palm"
    assert proximal @ after < proximal @ before


def test_the_mappings_own_error_is_small_in_flexion_and_said():
    subject = WebXR(rig_folder(), 902, replace(CLEAN, rate_hz=20.0))
    found = own_error(subject)
    assert found["off_mm"]["rms"] < 3.0
    for kind in ("MCP flexion", "PIP flexion", "DIP flexion", "thumb MCP flexion", "thumb IP flexion"):
        assert found["kinds"][kind]["rmse_centred"] < 3.0
        assert found["kinds"][kind]["slope"] == pytest.approx(1.0, abs=0.1)
    assert set(found["joints"]) == set(found["zeros_deg"]) == set(DIGIT_DOF_NAMES)
    known = subject.measured
    zeros = np.radians(list(found["zeros_deg"].values()))
    np.testing.assert_allclose(known.angles_rad - known.motion.digits_rad, np.tile(zeros, (len(known.angles_rad), 1)))


def test_a_hand_that_is_not_the_webxr_one_is_told(tmp_path):
    with pytest.raises(FormatError, match=r"cannot be read as the generic hand of WebXR"):
        read_rig(tmp_path)
    (tmp_path / "right.glb").write_bytes(b"glTF")
    with pytest.raises(FormatError, match="it has 4 bytes"):
        read_rig(tmp_path)


@pytest.mark.parametrize("layout", ["han19", "qualisys13", "schroeder8"])
def test_markers_come_to_their_own_places_on_the_template(layout: str):
    layout = load_layout(layout)
    spots = np.array([put_on(template(), place).point_m for place in places(layout)])
    # The last tenth of a digit has no side; a marker that a layout has there is put on before it.
    np.testing.assert_allclose(spots, layout.positions_m, atol=1e-9)


def test_markers_are_off_by_what_is_said():
    hand, random, belong = template(), np.random.default_rng(4), places(load_layout("han19"))
    assert len(belong) == 19
    for place in belong:
        at = put_on(hand, place).point_m
        assert off(hand, place, 0.0, random) == place
        away = [np.linalg.norm(put_on(hand, off(hand, place, 0.003, random)).point_m - at) for _ in range(20)]
        assert np.median(away) == pytest.approx(0.003, rel=0.25)


def test_markers_of_the_webxr_hand_ride_on_its_skin():
    subject, layout = WebXR(rig_folder(), 903, CLEAN), load_layout("han19")
    worn = subject.wear(layout, 0.0, np.random.default_rng(0))
    spots = np.array([put_on(subject.hand, place).point_m for place in places(layout)])
    roots = np.array([np.zeros(6), [0.1, 0.2, 0.3, 0.0, 0.5, 0.0]])
    still, turned = worn.moved(Motion(np.zeros((2, 20)), roots))
    np.testing.assert_allclose(still, spots, atol=1e-9)
    turn = joints_world(subject.hand.skeleton, np.concatenate([roots[1], np.zeros(20)]))[0]
    np.testing.assert_allclose(turned, spots @ turn[:3, :3].T + turn[:3, 3], atol=1e-9)
    bent = np.zeros((1, 20))
    bent[0, 6] = np.radians(60.0)  # the index finger's PIP
    moved = np.linalg.norm(worn.moved(Motion(bent, roots[:1]))[0] - spots, axis=1)
    at = dict(zip(layout.marker_names, 1e3 * moved, strict=True))
    assert at["IndexTip"] > 25.0
    assert at["IndexPIP"] > 1.0
    assert max(value for name, value in at.items() if not name.startswith("Index")) < 0.5


def test_points_carry_the_names_of_their_markers():
    person, layout = Person(904, 0.75, replace(CLEAN, seconds=8.0), waves=True), load_layout("schroeder8")
    moved = person.wear(layout, 0.0, np.random.default_rng(0)).moved(person.calibration.motion)
    frame = seen(moved, layout, CLEAN, 1)[100]
    assert set(frame.ids.tolist()) == set(names(layout)) == set(range(8))
    np.testing.assert_allclose(frame.points_m, moved[100][frame.ids], atol=1e-4)


def run_of(random: np.random.Generator, n: int, fixed: bool = True) -> Tracked:
    true = random.normal(0.0, 0.3, (n, 20))
    tracked = 0.1 + 0.8 * true + random.normal(0.0, 0.05, (n, 20))
    std = random.uniform(0.02, 0.1, (n, 20))
    return Tracked(tracked, true, std, random.uniform(0.05, 0.1, (n, 20)) if fixed else np.full((n, 20), np.nan))


def test_figures_are_what_they_are_called():
    random = np.random.default_rng(5)
    runs = [run_of(random, 200), run_of(random, 200)]
    assert sorted(angle for own in KINDS.values() for angle in own) == list(range(20))
    for name, row in (by_kind(runs) | by_joint(runs)).items():
        own = KINDS.get(name) or ([DIGIT_DOF_NAMES.index(name)] if name != "all" else list(range(20)))
        errors = np.array([[run.tracked[:, a] - run.true[:, a] for a in own] for run in runs])
        assert row["bias"] == pytest.approx(np.degrees(errors.mean()))
        assert row["rmse"] == pytest.approx(np.degrees(np.sqrt(np.mean(errors**2))))
        centred = errors - errors.mean(axis=2, keepdims=True)
        assert row["rmse_centred"] == pytest.approx(np.degrees(np.sqrt(np.mean(centred**2))))
        assert abs(row["most_bias"]) == pytest.approx(np.degrees(np.abs(errors.mean(axis=2)).max()))
        std = np.array([[run.std[:, a] for a in own] for run in runs])
        both = np.sqrt(std**2 + np.array([[run.std_fixed[:, a] for a in own] for run in runs]) ** 2)
        assert row["within_2"] == pytest.approx(np.mean(np.abs(errors) < 2 * std))
        assert row["within_2_fixed"] == pytest.approx(np.mean(np.abs(errors) < 2 * both))
        assert row["within_2"] < row["within_2_fixed"]
        fits = [np.polyfit(run.true[:, a], run.tracked[:, a], 1)[0] for run in runs for a in own]
        assert row["slope"] == pytest.approx(np.mean(fits))
        assert row["r"] == pytest.approx(
            np.mean([np.corrcoef(run.true[:, a], run.tracked[:, a])[0, 1] for run in runs for a in own])
        )
    unsaid = figures([run_of(random, 50, fixed=False)], [3])
    assert np.isnan(unsaid.within_2_fixed)
    assert np.isfinite(unsaid.within_2)
    assert np.isnan(figures([], [3]).rmse)
    assert np.isnan(correlated(np.ones(5), np.arange(5.0))).all()


def test_gaps_hide_one_digit_after_another():
    layout = load_layout("han19")
    hidden = gaps.gaps(900, 0.6, 60.0, 2)
    assert [gap.digit for gap in hidden] == [(2 + i) % 5 for i in range(len(hidden))]
    assert {gap.last - gap.first + 1 for gap in hidden} == {36}
    assert hidden[0].first > moving_rows(60.0).start
    person = Person(905, 1.0, replace(CLEAN, seconds=15.0), waves=True)
    frames = seen(person.wear(layout, 0.0, np.random.default_rng(0)).moved(person.calibration.motion), layout, CLEAN, 1)
    left = gaps.with_gaps(frames, layout, hidden)
    for i, (before, after) in enumerate(zip(frames, left, strict=True)):
        now = [gap.digit for gap in hidden if gap.first <= i <= gap.last]
        gone = {k for k, joint in enumerate(layout.joints) if joint and (joint - 1) // 3 in now}
        assert set(after.ids.tolist()) == set(before.ids.tolist()) - gone
        np.testing.assert_array_equal(after.points_m, before.points_m[~np.isin(before.ids, list(gone))])


def test_figures_of_gaps_are_of_the_hidden_digits():
    run = run_of(np.random.default_rng(6), 100)
    run.tracked[12] = np.nan
    part = gaps.within(run, [gaps.Hidden(1, 10, 14), gaps.Hidden(4, 40, 44)])
    rows = [10, 11, 13, 14]
    error = np.concatenate(
        [(run.tracked - run.true)[rows, 4:8].ravel(), (run.tracked - run.true)[40:45, 16:20].ravel()]
    )
    np.testing.assert_array_equal(part.error, error)
    row = gaps.figures([part, part])
    assert row["values"] == 2 * 36
    assert row["true"] == pytest.approx(np.degrees(np.sqrt(np.mean(error**2))))
    assert row["within_2"] == pytest.approx(np.mean(np.abs(error) < 2 * part.std))
    assert row["within_2_fixed"] > row["within_2"]


@pytest.mark.parametrize("scale", [None, 1.0])
def test_the_fixed_deviation_is_that_of_angles_csv(scale):
    layout = load_layout("qualisys13")
    person, profile = Person(906, 1.0, CLEAN, waves=True), replace(generic(layout), scale=scale)
    worn = person.wear(layout, 0.003, np.random.default_rng(0))
    frames = seen(worn.moved(person.calibration.motion), layout, CLEAN, 1)[:90]
    solved = solve(frames, profile, labels=names(layout))
    hands = [frame.hands[0] for frame in solved]
    assert all(hand.state is HandState.TRACKED for hand in hands)
    key = hands[0].key
    content = SimpleNamespace(cast=(profile,), hands=(key,), solved=solved, shown={key: range(len(hands))},
                              options=ExportOptions())  # fmt: skip
    stds = stated_fixed(profile, hands)
    np.testing.assert_allclose(stds, np.array(FixedErrors(content).of(hands))[:, 6:], rtol=1e-9)
    assert stds.min() > 0.0
    trial = NeutralHand(hands[40].theta_rad[6:], np.full(20, 0.1), np.zeros(20), (), "made", 0.0, 1.0, "")
    zeroed = replace(profile, neutral=Neutral({"right": trial}))
    content.cast, content.options = (zeroed,), ExportOptions()
    counted = collected(solved, profile, person.calibration.angles_rad[:90], trial)
    np.testing.assert_allclose(counted.std_fixed, np.array(FixedErrors(content).of(hands))[:, 6:], rtol=1e-9)
    both = [zeroed.neutral.reported("right", hand.theta_rad, hand.theta_std) for hand in hands]
    np.testing.assert_array_equal(counted.tracked, [theta[6:] for theta, _ in both])
    np.testing.assert_array_equal(counted.std, [std[6:] for _, std in both])
    assert counted.std_fixed[40].max() < 0.02 * stds[40].max()
    run = collected(solved, profile, person.calibration.angles_rad[:90])
    np.testing.assert_array_equal(run.std_fixed, stds)
    assert figures([run], range(20)).within_2_fixed > figures([run], range(20)).within_2


def test_a_marker_that_few_frames_show_counts_as_in_angles_csv():
    """In the frames that show it, unless it is among those that are looked at first."""
    layout = load_layout("qualisys13")
    person, profile = Person(907, 1.0, CLEAN, waves=True), replace(generic(layout), scale=1.0)
    frames = seen(person.wear(layout, 0.0, np.random.default_rng(0)).moved(person.calibration.motion), layout, CLEAN, 1)
    solved = solve(frames[:300], profile, labels=names(layout))
    looked_at = np.unique(np.linspace(0, 299, SAMPLE).astype(int))
    alone = int(np.setdiff1d(np.arange(300), looked_at)[0])
    bare = [
        frame if i == alone else
        replace(frame, hands=(replace(frame.hands[0], point=np.r_[frame.hands[0].point[:-1], NO_POINT]),))
        for i, frame in enumerate(solved)
    ]  # fmt: skip
    hands = [frame.hands[0] for frame in bare]
    key = hands[0].key
    content = SimpleNamespace(cast=(profile,), hands=(key,), solved=bare, shown={key: range(300)},
                              options=ExportOptions())  # fmt: skip
    stds = stated_fixed(profile, hands)
    np.testing.assert_allclose(stds, np.array(FixedErrors(content).of(hands))[:, 6:], rtol=1e-9)
    assert np.abs(stds[alone] / stds[alone - 1] - 1.0).max() > 0.1


def options(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    angles.add_options(parser)
    return parser.parse_args(words)


def test_the_tables_are_of_what_was_measured(monkeypatch, capsys):
    kept: list[cases.Outcome] = []

    def measured_once(case: cases.Case, progress) -> cases.Outcome:
        kept.append(cases.outcome(case, progress))
        return kept[-1]

    monkeypatch.setattr(angles, "outcome", measured_once)
    found = angles.run(
        options(
            *("--subjects", "people", "--people", "1", "--layouts", "schroeder8", "--placements", "1.5"),
            *("--seconds", "8", "--jobs", "1", "--motion", "waves"),
        )
    )
    printed = capsys.readouterr().out
    (outcome,) = kept
    assert found["seeds"] == [4001]
    assert "(seed 4001)" in printed
    assert found["mapping"] is None
    ways = found["subjects"]["people"]["schroeder8"]["1.5"]
    assert tuple(ways) == (*WAYS, TRUE_HAND)
    for way, row in ways.items():
        run = outcome.runs[way]
        errors = np.degrees(run.tracked - run.true)
        assert row["kinds"]["all"]["rmse"] == pytest.approx(np.sqrt(np.mean(errors**2)))
        assert row["joints"]["ring_pip_flexion"]["bias"] == pytest.approx(errors[:, 14].mean())
        assert row["kinds"]["PIP flexion"]["within_2"] == pytest.approx(
            np.mean(np.abs(errors) < 2 * np.degrees(run.std), axis=0)[KINDS["PIP flexion"]].mean()
        )
        assert f"{row['kinds']['all']['rmse']:8.1f}" in printed
    truth = cases.subject_of(
        cases.Case("people", 4001, 1.0, "waves", None, "schroeder8", 0.0015, Setting(60.0, 8.0, 1e-4, 6e-4))
    ).measured.angles_rad
    np.testing.assert_array_equal(outcome.runs[WAYS[0]].true, truth[moving_rows(60.0)])
    flat = [outcome.runs[way].tracked for way in WAYS]
    for before, after in ((0, 1), (2, 3)):
        taken_off = flat[before] - flat[after]
        np.testing.assert_allclose(taken_off, np.tile(taken_off[0], (len(taken_off), 1)), atol=1e-12)
    assert ways[TRUE_HAND]["kinds"]["all"]["rmse"] < ways["layout alone"]["kinds"]["all"]["rmse"]
    assert np.isnan(ways[TRUE_HAND]["kinds"]["all"]["within_2_fixed"])
    assert set(found["gaps"]["people"]) == {"0.15", "0.3", "0.6", "1", "2"}
    for duration, shown in found["gaps"]["people"].items():
        assert shown["filled"] == pytest.approx(gaps.figures([outcome.gaps[float(duration)]["filled"]]), nan_ok=True), (
            duration
        )


def test_the_webxr_hand_is_left_out_with_a_reason(tmp_path):
    ran = phalanx("bench", "angles", "--subjects", "webxr", "--data", tmp_path)
    assert ran.code == 1
    assert f"{tmp_path} holds no right.glb of it" in ran.err
    assert angles._left_out(options("--data", str(rig_folder()))) == {}
    assert "--data names no folder" in angles._left_out(options())["webxr"]
    assert angles._left_out(options("--subjects", "people")) == {}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--seconds", "4"), "--seconds 4"),
        (("--rate", "0"), "--rate 0"),
        (("--placements", "0", "-2"), "--placements 0 -2"),
        (("--subjects", "people", "--people", "0"), "nobody to measure"),
    ],
)
def test_what_cannot_be_measured_is_refused(words, told):
    with pytest.raises(PhalanxError, match=told):
        angles.run(options(*words))
