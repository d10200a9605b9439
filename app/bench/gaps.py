"""Gaps made in true motion: how far hidden markers and their digits are from the truth, carried, filled and held."""

from __future__ import annotations

import argparse
import itertools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from app import gap_angles
from app.labels import label_map
from app.people import add_sizes, said, size_of, sized
from core.engine import warm_up
from core.errors import FormatError
from core.frames import BoolArray, FloatArray, HandFrame, MarkerFrame, TrackedFrame
from core.gap_filling import GapFiller, filled
from core.markers.layout import MarkerLayout
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile, load_profile
from core.takes.formats import read_recording
from core.takes.reprocess import solve

DURATIONS_S = (0.1, 0.2, 0.5, 1.0, 2.0)
LOOK_AHEAD_S = 0.2
FIRST_S, BETWEEN_S = 4.0, 0.8
"""Before the first gap, and between two: all markers are seen."""

LAMBDA = 1e-8
FIT_FRAMES = 240
"""Frames before a gap that the affine predictor is fitted to."""

METHODS = ("live", "look-ahead", "filled", "held", "affine")


@dataclass(frozen=True)
class Gap:
    """Markers (k,) are hidden in frames first..last."""

    first: int
    last: int
    markers: tuple[int, ...]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument(
        "--angles",
        action="store_true",
        help="joint angles instead of markers, true and stated, on postures that the posture prior has seen and others",
    )
    parser.add_argument(
        "file",
        metavar="FILE",
        nargs="?",
        type=Path,
        help="angles over gaps made in a labelled recording, against those of all of its markers",
    )
    parser.add_argument("--from", metavar="S", dest="begin", type=float, default=0.0, help="of FILE; default its start")
    parser.add_argument(
        "--half",
        choices=("stated", "chosen"),
        default="stated",
        help="of people and activities: those that figures are stated of, or those that constants were chosen on; "
        "default %(default)s",
    )
    parser.add_argument("--profile", metavar="P", default="han19", help="default %(default)s")
    parser.add_argument("--seconds", metavar="S", type=float, default=55.0, help="per seed; default %(default)s")
    parser.add_argument("--rate", metavar="HZ", type=float, default=120.0, help="default %(default)s")
    parser.add_argument("--most", metavar="N", type=int, default=4, help="markers hidden at once; default %(default)s")
    parser.add_argument("--skin", metavar="MM", type=float, default=0.6, help="sliding of skin; default %(default)s")
    parser.add_argument("--seeds", metavar="N", type=int, nargs="+", default=[21, 22], help="default %(default)s")
    add_sizes(parser)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """The right hand of the built-in performer; one to `--most` neighbouring markers hidden at once.

    Markers that are neighbours are hidden together, as another hand or a thing would. Peers: the hand held as it was
    when it was last seen whole, moved with its back (held); each marker as an affine combination of those that are
    seen, fitted to the two seconds before the gap (Pavllo 2019, eq. 5-8; affine). With --angles, or of a recording:
    app.gap_angles.
    """
    warm_up()
    if arguments.angles or arguments.file is not None:
        return _angles(load_profile(arguments.profile), arguments)
    profile = load_profile(arguments.profile).with_sides(("right",))
    rows: dict[float, list[dict[str, float]]] = {duration: [] for duration in DURATIONS_S}
    ratios: dict[str, list[FloatArray]] = {name: [] for name in ("live", "look-ahead", "filled")}
    for duration, seed in itertools.product(DURATIONS_S, arguments.seeds):
        for row, found in _trial(sized(profile, size_of(arguments, seed)), duration, seed, arguments):
            rows[duration].append(row)
            for name, values in found.items():
                ratios[name].append(values)
    figures: dict[str, Any] = {"seeds": arguments.seeds, "durations": {}, "std": {}}
    print(f"{arguments.profile}, {said(arguments, arguments.seeds)}, known")
    print("hidden markers: mean distance from the truth over the gap | at its last frame [mm]")
    print("  gap [s]   n  " + "".join(f"{name:>17}" for name in METHODS) + "   angles, live  filled [degrees]")
    for duration, found in rows.items():
        mean = {key: float(np.mean([row[key] for row in found])) for key in found[0]}
        figures["durations"][str(duration)] = {"gaps": len(found), **mean}
        cells = "".join(f"{mean[name]:9.1f} |{mean[name + ' last']:5.1f} " for name in METHODS)
        print(f"  {duration:7.1f} {len(found):3d}  {cells}   {mean['live angles']:12.1f}  {mean['filled angles']:6.1f}")
    print("standard deviation of hidden markers against their true error")
    for name, parts in ratios.items():
        ratio = np.concatenate(parts)
        one, two = (float((ratio < k).mean()) for k in (1.0, 2.0))
        figures["std"][name] = {"within_1": one, "within_2": two}
        print(f"  {name:10} {100 * one:.0f} % within one, {100 * two:.0f} % within two")
    return figures


def _angles(profile: Profile, arguments: argparse.Namespace) -> dict[str, Any]:
    if arguments.file is not None:
        groups = {arguments.file.name: _of_file(profile, arguments)}
    else:
        trials = {"outside": gap_angles.OUTSIDE[arguments.half], "inside": gap_angles.INSIDE[arguments.half]}
        groups = {
            name: [
                gap_angles.of_performer(trial, profile, arguments.seconds, arguments.rate, arguments.skin / 1e3)
                for trial in group
            ]
            for name, group in trials.items()
        }
    figures = {name: gap_angles.table(errors) for name, errors in groups.items()}
    for name, rows in figures.items():
        whose = {"outside": "postures the prior has not seen", "inside": "postures like those of the prior"}
        print(f"{whose.get(name, name)}: RMS error, RMS stated [degrees], share within two standard deviations")
        print("\n".join(gap_angles.said_of(rows)))
    return {"half": None if arguments.file is not None else arguments.half, "angles": figures}


def _of_file(profile: Profile, arguments: argparse.Namespace) -> list[gap_angles.Errors]:
    recording = read_recording(arguments.file)
    if not 0.0 <= arguments.begin < recording.duration_s:
        raise FormatError(
            f"--from {arguments.begin:g}: {arguments.file.name} has {recording.duration_s:.1f} s of frames.",
            f"Give 0 or more and less than {recording.duration_s:.1f}.",
        )
    labels = label_map(recording, profile) or {}
    of_side = {side: {m: i for i, (s, m) in labels.items() if s == side} for side in profile.sides}
    markers = range(len(profile.layout.marker_names))
    for side, ids in of_side.items():
        if all(marker in ids for marker in markers):
            chosen = [ids[marker] for marker in markers]
            seconds = min(arguments.seconds, recording.duration_s - arguments.begin)
            one = profile.with_sides((side,))
            return [
                gap_angles.of_recording(recording, chosen, one, arguments.begin, seconds, seed)
                for seed in arguments.seeds
            ]
    raise FormatError(
        f"{arguments.file} does not name every marker of a hand of {profile.layout.name}.",
        "Choose the --profile that it was made with.",
    )


def _trial(
    profile: Profile, duration_s: float, seed: int, arguments: argparse.Namespace
) -> list[tuple[dict[str, float], dict[str, FloatArray]]]:
    performer = Performer(profile, seed=seed)
    stream = MarkerStream(performer, arguments.rate, seed, skin_m=arguments.skin / 1e3)
    sent = list(itertools.islice(stream.labelled(), round(arguments.seconds * arguments.rate)))
    true_m = np.full((len(sent), len(profile.layout.marker_names), 3), np.nan)
    for i, one in enumerate(sent):
        true_m[i, one.truth[one.truth >= 0]] = one.frame.points_m[one.truth >= 0]
    angles = np.array([performer.theta("right", one.frame.times.device_s)[6:] for one in sent])
    gaps = _gaps(profile.layout, len(sent), duration_s, arguments.rate, arguments.most, seed)
    solved = solve([_without(one.frame, one.truth, i, gaps) for i, one in enumerate(sent)], profile)
    filler = GapFiller(profile, LOOK_AHEAD_S)
    ahead = [one for frame in solved for one in filler.push(frame)] + filler.flush()
    shown = {"live": solved, "look-ahead": ahead, "filled": list(filled(solved, profile))}
    return [_judged(gap, shown, true_m, angles, profile.layout) for gap in gaps]


def _gaps(layout: MarkerLayout, n: int, duration_s: float, rate_hz: float, most: int, seed: int) -> list[Gap]:
    random = np.random.default_rng(seed)
    gaps, first = [], round(FIRST_S * rate_hz)
    length = round(duration_s * rate_hz)
    while first + length + round(BETWEEN_S * rate_hz) < n:
        count = int(random.integers(1, most + 1))
        centre = layout.positions_m[random.integers(len(layout.joints))]
        near = np.argsort(np.linalg.norm(layout.positions_m - centre, axis=1))[:count]
        gaps.append(Gap(first, first + length - 1, tuple(int(k) for k in near)))
        first += length + round(BETWEEN_S * rate_hz)
    return gaps


def _without(frame: MarkerFrame, truth: FloatArray, i: int, gaps: list[Gap]) -> MarkerFrame:
    gone = [k for gap in gaps if gap.first <= i <= gap.last for k in gap.markers]
    before = {k: sum(gap.last < i for gap in gaps if k in gap.markers) for k in set(truth.tolist())}
    keep = ~np.isin(truth, gone)
    # A marker that comes back has another id.
    ids = frame.ids + 1000 * np.array([before[k] for k in truth.tolist()])
    return replace(frame, points_m=frame.points_m[keep], ids=ids[keep], residuals_m=frame.residuals_m[keep])


def _judged(
    gap: Gap, shown: dict[str, list[TrackedFrame]], true_m: FloatArray, angles: FloatArray, layout: MarkerLayout
) -> tuple[dict[str, float], dict[str, FloatArray]]:
    rows, markers = np.arange(gap.first, gap.last + 1), list(gap.markers)
    truth = true_m[np.ix_(rows, markers)]
    errors, ratios, row = {}, {}, {}
    digits = {int(joint - 1) // 3 for joint in layout.joints[markers] if joint > 0}
    columns = [4 * digit + k for digit in digits for k in range(4)]
    for name, frames in shown.items():
        hands = [frames[i].hands[0] for i in rows]
        errors[name] = np.linalg.norm(np.array([hand.markers_world_m[markers] for hand in hands]) - truth, axis=2)
        ratios[name] = (errors[name] / np.array([hand.marker_std_m[markers] for hand in hands])).ravel()
        found = np.array([hand.theta_rad[6:] for hand in hands])[:, columns] - angles[np.ix_(rows, columns)]
        row[f"{name} angles"] = float(np.degrees(np.sqrt(np.mean(found**2)))) if columns else 0.0
    last_seen = shown["live"][gap.first - 1].hands[0]
    errors["held"] = np.linalg.norm(_held(last_seen, shown["live"], rows, markers) - truth, axis=2)
    errors["affine"] = np.linalg.norm(_affine(true_m, gap) - truth, axis=2)
    for name, distances in errors.items():
        row[name], row[f"{name} last"] = 1e3 * float(distances.mean()), 1e3 * float(distances[-1].mean())
    return row, ratios


def _held(last_seen: HandFrame, frames: list[TrackedFrame], rows: FloatArray, markers: list[int]) -> FloatArray:
    """(n, k, 3) [m]: fixed to the back of the hand as they were before the gap."""
    on_hand = np.linalg.solve(
        last_seen.joints_world[0], np.column_stack([last_seen.markers_world_m[markers], np.ones(len(markers))]).T
    )
    return np.array([(frames[i].hands[0].joints_world[0] @ on_hand)[:3].T for i in rows])


def _affine(true_m: FloatArray, gap: Gap) -> FloatArray:
    """(n, k, 3) [m]."""
    before = true_m[gap.first - FIT_FRAMES : gap.first]
    others: BoolArray = ~np.isin(np.arange(true_m.shape[1]), gap.markers)
    whole = before[~np.isnan(before).any(axis=(1, 2))].transpose(1, 0, 2)
    rows = np.concatenate([whole.reshape(len(whole), -1), np.ones((len(whole), whole.shape[1]))], axis=1)
    system = rows[others] @ rows[others].T + LAMBDA * np.eye(int(others.sum()))
    weights = np.linalg.solve(system, rows[others] @ rows[list(gap.markers)].T)
    found: FloatArray = np.einsum("ok,fod->fkd", weights, true_m[gap.first : gap.last + 1, others])
    return found
