"""Joint angles over gaps made in known motion: how far off they are, and how far off they are said to be."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.people import SIZES, sized
from core.frames import BoolArray, FloatArray, HandFrame, HandState, IntArray, MarkerFrame, TrackedFrame
from core.gap_filling import filled, right_pose
from core.guesses import Guesses
from core.hand.skeleton import DOF_NAMES, N_DOFS, N_ROOT_DOFS
from core.kinematics import kernels
from core.markers.layout import MarkerLayout
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.motion.subspace import shipped_subspace
from core.profile import Profile
from core.recording import Recording
from core.takes.reprocess import solve
from core.track import tracking_solver

LENGTHS_S = (0.15, 0.3, 0.6, 1.0, 2.0)
"""Of gaps in which some markers are hidden."""

WHOLE_S = (0.15, 0.3)
"""All markers of the hand are hidden: a hand lost for longer than half a second stays lost."""

FIRST_S, BETWEEN_S = 1.0, 0.6
MOST_MARKERS = 6
"""A gap hides one to so many markers that are neighbours."""

KINDS = ("MCP", "PIP", "DIP", "abduction", "thumb", "wrist")
SHOWN = ("live", "filled")


@dataclass(frozen=True)
class Trial:
    """One person, seed `person`, who does `activity`, solved with the posture prior of `subspace`."""

    subspace: str
    activity: str
    person: int


def _trials(*names: str) -> tuple[Trial, ...]:
    parts = [name.split() for name in names]
    return tuple(Trial(subspace, activity, int(person)) for subspace, activity, person in parts)


OUTSIDE = {
    "chosen": _trials("grasping counting 1", "grasping range 3", "gestures piano 5", "gestures pen 9"),
    "stated": _trials(
        "grasping signs 2",
        "grasping piano 4",
        "gestures signs 6",
        "gestures range 8",
        "gestures grasping 10",
        "grasping counting 12",
        "gestures piano 14",
        "grasping gestures 16",
        "generic range 18",
        "generic pen 20",
    ),
}
"""Activities that the posture prior was not made from: those that constants were chosen on, and others, of others."""

INSIDE = {"chosen": _trials("generic free 7"), "stated": _trials("generic everyday 22", "generic free 24")}
"""Activities that it was made from, of other people."""


@dataclass(frozen=True)
class Errors:
    """Of angles that were guesses, of one trial, one row each: n rows.

    length_s, kind (index into KINDS): (n,). error_rad, std_rad: (2, n), as SHOWN.
    """

    length_s: FloatArray
    kind: FloatArray
    error_rad: FloatArray
    std_rad: FloatArray


def of_performer(trial: Trial, profile: Profile, seconds: float, rate_hz: float, skin_m: float) -> Errors:
    """Of the right hand of the built-in performer, its size and the names of its points known."""
    profile = sized(profile.with_sides(("right",)), SIZES[trial.person % len(SIZES)])
    performer = Performer(profile, seed=trial.person, activity=trial.activity)
    stream = MarkerStream(performer, rate_hz, trial.person, skin_m=skin_m)
    sent = list(itertools.islice(stream.labelled(), round(seconds * rate_hz)))
    truth = np.array([performer.theta("right", one.frame.times.device_s) for one in sent])
    named = [replace(one.frame, ids=one.truth) for one in sent]
    markers = range(len(profile.layout.marker_names))
    profile = replace(profile, subspace=shipped_subspace(trial.subspace))
    return _errors(named, list(markers), truth, profile, rate_hz, trial.person)


def of_recording(
    recording: Recording, ids: Sequence[int], profile: Profile, first_s: float, seconds: float, seed: int
) -> Errors:
    """Of one hand of a recording; what is true is what was solved of all of its points.

    ids: device id of each marker of the layout. profile: of this hand's side only.
    """
    first, last = (round(s * recording.rate_hz) for s in (first_s, first_s + seconds))
    frames = list(itertools.islice(recording.frames(), first, last))
    whole = solve(frames, profile, labels={identity: (profile.sides[0], k) for k, identity in enumerate(ids)})
    hands = [frame.hands[0] for frame in whole]
    tracked = [hand.state is HandState.TRACKED and bool(hand.observed.all()) for hand in hands]
    truth = np.array(
        [h.theta_rad if known else np.full(N_DOFS, np.nan) for h, known in zip(hands, tracked, strict=True)]
    )
    return _errors(frames, ids, truth, profile, recording.rate_hz, seed)


def _errors(
    frames: list[MarkerFrame], ids: Sequence[int], truth: FloatArray, profile: Profile, rate_hz: float, seed: int
) -> Errors:
    gaps = _gaps(profile.layout, len(frames), rate_hz, seed)
    gone = np.zeros((len(frames), len(ids)), dtype=np.bool_)
    for first, end, markers in gaps:
        gone[first:end, markers] = True
    names = {identity: (profile.sides[0], k) for k, identity in enumerate(ids)}
    seen = [without(frame, np.asarray(ids)[hidden]) for frame, hidden in zip(frames, gone, strict=True)]
    live = solve(seen, profile, labels=names)
    shown = live, list(filled(live, profile))
    guessed = _guessed(live, profile)
    kinds = np.array([_kind(name) for name in DOF_NAMES])
    rows = []
    for first, end, markers in gaps:
        for i in range(first, end):
            hands = [one[i].hands[0] for one in shown]
            whole = len(markers) == len(ids)
            columns = np.array([3, 4, 5]) if whole else N_ROOT_DOFS + np.flatnonzero(guessed[i])
            off = np.array([_off(hand, truth[i])[columns] for hand in hands])
            std = np.array([hand.theta_std[columns] for hand in hands])
            length = np.full(len(columns), (end - first) / rate_hz)
            rows.append(np.concatenate([[length, kinds[columns]], off, std]))
    table = np.concatenate([np.empty((6, 0)), *rows], axis=1)
    return Errors(table[0], table[1], table[2:4], table[4:6])


def _gaps(layout: MarkerLayout, n: int, rate_hz: float, seed: int) -> list[tuple[int, int, list[int]]]:
    """First frame, the one after the last, and markers of each gap: lengths in turn, places by chance."""
    random = np.random.default_rng([14, seed])
    kinds = [*((length, False) for length in LENGTHS_S), *((length, True) for length in WHOLE_S)]
    gaps, first = [], round(FIRST_S * rate_hz)
    for length_s, whole in itertools.islice(itertools.cycle(kinds), seed % len(kinds), None):
        end = first + round(length_s * rate_hz)
        if end + round(BETWEEN_S * rate_hz) > n:
            return gaps
        count = len(layout.joints) if whole else int(random.integers(1, MOST_MARKERS + 1))
        centre = layout.positions_m[random.integers(len(layout.joints))]
        near = np.argsort(np.linalg.norm(layout.positions_m - centre, axis=1))[:count]
        gaps.append((first, end, near.tolist()))
        first = end + round(BETWEEN_S * rate_hz)
    return gaps


def without(frame: MarkerFrame, gone: IntArray) -> MarkerFrame:
    """The frame less the points of these ids."""
    keep = ~np.isin(frame.ids, gone)
    return replace(frame, points_m=frame.points_m[keep], ids=frame.ids[keep], residuals_m=frame.residuals_m[keep])


def _guessed(frames: list[TrackedFrame], profile: Profile) -> BoolArray:
    """(n, 20) bool, by the rule of the engine."""
    rule, none = Guesses(tracking_solver(profile)), np.zeros(N_DOFS - N_ROOT_DOFS, dtype=np.bool_)
    hands = [frame.hands[0] for frame in frames]
    return np.array(
        [rule.of(right_pose(h), h.observed).copy() if h.state is HandState.TRACKED else none for h in hands]
    )


def _kind(name: str) -> int:
    for part, kind in (("wrist", 5), ("thumb", 4), ("abduction", 3), ("mcp", 0), ("pip", 1), ("dip", 2)):
        if part in name:
            return kind
    raise ValueError(name)


def _off(hand: HandFrame, truth: FloatArray) -> FloatArray:
    """(26,) what leads from the truth to the hand, the rotation about the axes of the world."""
    off = np.empty(N_DOFS)
    kernels.pose_step(truth, hand.theta_rad, off)
    return off


def table(errors: Sequence[Errors]) -> list[dict[str, Any]]:
    """Rows by length and kind of joint, "all" last: RMS error and RMS stated [degrees], shares within one and two."""
    lengths = np.concatenate([one.length_s for one in errors])
    kinds = np.concatenate([one.kind for one in errors])
    off = np.concatenate([one.error_rad for one in errors], axis=1)
    std = np.concatenate([one.std_rad for one in errors], axis=1)
    said = np.isfinite(std).all(axis=0) & np.isfinite(off).all(axis=0)
    rows = []
    for length in LENGTHS_S:
        for kind, name in enumerate((*KINDS, "all")):
            wanted = kinds < KINDS.index("wrist") if name == "all" else kinds == kind
            among = (np.abs(lengths - length) < 0.02) & wanted
            row: dict[str, Any] = {"length_s": length, "kind": name, "n": int(among.sum())}
            for k, shown in enumerate(SHOWN):
                these = among & (said if name != "wrist" else np.isfinite(std[k] + off[k]))
                if not these.any():
                    continue
                a, s = np.abs(off[k, these]), std[k, these]
                row[shown] = {
                    "rms_deg": float(np.degrees(np.sqrt(np.mean(a**2)))),
                    "stated_deg": float(np.degrees(np.sqrt(np.mean(s**2)))),
                    "within_1": float((a < s).mean()),
                    "within_2": float((a < 2.0 * s).mean()),
                }
            rows.append(row)
    return rows


def said_of(rows: Sequence[dict[str, Any]]) -> list[str]:
    """The lines of a table: of each kind of joint RMS error, RMS stated, and the share within two of it."""
    lines = ["  gap     shown  " + "".join(f"{name:>16}" for name in (*KINDS, "all digits"))]
    for length in LENGTHS_S:
        for shown in SHOWN:
            cells = [_cell(row.get(shown)) for row in rows if row["length_s"] == length]
            lines.append(f"  {length:5.2f} s {shown:6}" + "".join(f"{cell:>16}" for cell in cells))
    return lines


def _cell(one: dict[str, float] | None) -> str:
    if one is None:
        return "-"
    return f"{one['rms_deg']:.1f} {one['stated_deg']:4.1f} {100.0 * one['within_2']:3.0f} %"
