"""Writes the subspaces of this folder and prints the figures of CARD.md.

    python -m resources.subspaces.build_subspaces [--check]

They are made of the synthetic performer's motion alone: one period of each activity by each of a dozen persons. Persons
who were not among them measure how well hands are represented. --check compares with the files instead of writing.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from core.frames import FloatArray
from core.hand.skeleton import N_ROOT_DOFS
from core.motion.activities import ACTIVITIES
from core.motion.performer import KNOTS_HZ, Performer
from core.motion.subspace import Subspace, subspace_of, thinned
from core.profile import load_profile

HERE = Path(__file__).parent
VARIANCE = 0.95
RATE_HZ = 20.0
SEEDS, GRASPING_SEEDS = range(1000, 1012), range(1000, 1036)
"""Persons learnt from; in a minute of grasping a person takes up three things only, so there are more of them."""

HELD_OUT = range(2000, 2004)
EVERYTHING = ("free", "everyday", "grasping", "gestures", "counting", "piano", "signs", "hands", "range")
MADE = {
    "generic": (EVERYTHING, "hands in general: grasps, gestures, signs, counting, piano and what lies between"),
    "grasping": (("grasping",), "things taken up, carried, passed on and set down"),
    "gestures": (("gestures", "counting"), "gestures and counting in the air"),
}
"""Activities each subspace is made of, and what it is for."""


def postures(activity: str, seeds: range) -> FloatArray:
    """(n, 20) [rad], of both hands of every person, thinned."""
    profile = load_profile("han19")
    step = round(KNOTS_HZ / RATE_HZ)
    parts = []
    for seed in seeds:
        for hand in Performer(profile, seed, activity).performance.knots[:, ::step, N_ROOT_DOFS:]:
            parts.append(hand[thinned(hand)])
    return np.concatenate(parts)


def main() -> int:
    """Makes all of MADE; 1 where --check finds a difference."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare with the files, write nothing")
    check = parser.parse_args().check
    used = {activity for activities, _ in MADE.values() for activity in activities}
    learnt = {
        activity: postures(activity, GRASPING_SEEDS if activity == "grasping" else SEEDS)
        for activity in ACTIVITIES
        if activity in used
    }
    unseen = {activity: postures(activity, HELD_OUT) for activity in ACTIVITIES if activity in used}
    differing = []
    for name, (activities, use) in MADE.items():
        motion = np.concatenate([learnt[activity] for activity in activities])
        subspace = subspace_of(motion, name, f"The synthetic performer: {use}.", variance=VARIANCE)
        text = json.dumps(subspace.to_dict(), indent=1) + "\n"
        path = HERE / f"{name}.json"
        if check and path.read_text(encoding="utf-8") != text:
            differing.append(name)
        if not check:
            path.write_text(text, encoding="utf-8")
        whole = subspace_of(motion, name, dimensions=motion.shape[1])
        shares = ", ".join(f"{activity} {len(learnt[activity]):,}" for activity in activities)
        print(f"\n{name}: {shares}")
        tell(subspace, whole, len(motion), np.concatenate([unseen[activity] for activity in activities]))
    if differing:
        print("Not as in the files: " + ", ".join(differing))
    return 1 if differing else 0


def tell(subspace: Subspace, whole: Subspace, n: int, unseen: FloatArray) -> None:
    """Prints what the card says of one subspace."""
    needed = {share: int(np.searchsorted(whole.explained, share) + 1) for share in (0.8, 0.9, 0.95)}
    print(f"{subspace.name}: {n:,} postures, {subspace.dimensions} dimensions; ", end="")
    print(", ".join(f"{100 * share:.0f} % of the variance in {count}" for share, count in needed.items()))
    print(f"| dimensions | explained | unseen persons ({len(unseen):,} postures), RMS error [degrees] |")
    print("| --- | --- | --- |")
    for dimensions in (0, 1, 2, 3, 4, 5, 6, 8, 10, 12):
        error = np.degrees(np.sqrt(np.mean((whole.truncated(dimensions).nearest(unseen) - unseen) ** 2)))
        share = 100.0 * whole.explained[dimensions - 1] if dimensions else 0.0
        print(f"| {dimensions} | {share:.1f} % | {error:.2f} |")


if __name__ == "__main__":
    sys.exit(main())
