"""The zeros of a performer's joint angles, measured over a stretch in which the hand was held still."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.calibration.neutral import LARGEST_RAD, Neutral, NeutralHand
from core.errors import PhalanxError
from core.frames import BoolArray, FloatArray, HandFrame, HandKey, HandState, Side, TrackedFrame
from core.gap_filling import right_pose
from core.guesses import Guesses
from core.hand.skeleton import DIGIT_DOF_NAMES, N_ROOT_DOFS
from core.kinematics.prior import N_ANGLES
from core.profile import Profile
from core.sources import Information
from core.track import tracking_solver

LEAST_S, LEAST_FRAMES = 0.5, 10
"""A shorter stretch is a moment and not a hand that is held."""

LEAST_TRACKED = 0.9
"""Share of the stretch's frames in which a hand must be tracked."""

LEAST_SEEN = 0.5
"""Share of its tracked frames in which the markers of an angle must be seen, else the trial tells nothing of it."""

MOST_MOVED_RAD = float(np.radians(5.0))
"""A hand that moves more was not held. In a held second of a real recording (Qualisys, 13 markers) no angle moves by
more than 0.6 degrees."""

BLOCK_S = 0.2
"""Motion is what is left between the medians of such blocks: the noise of single frames is none."""

FAR_RAD = float(np.radians(30.0))
"""Where markers and bones are off, zeros are smaller: a larger one rather is another stance than the one given. Not of
the thumb's CMC joint: where it lies in a flat hand, everybody has it elsewhere."""


@dataclass(frozen=True)
class HeldHand:
    """What a stretch tells of one hand.

    frames: in which it was tracked. angle_rad: (20,) float64 [rad], median of each digit angle over the frames that
    show it. std_rad: (20,) float64 [rad], how well it was held: deviation of the medians of BLOCK_S, by drift,
    tremor and what noise they leave. The solver's own deviation is not in it: most of that is wrong alike in every
    frame, which is what a zero takes off, and every frame states it already. known_rad: (20,) float64 [rad], median
    of the solver's. moved_rad: (20,) float64 [rad], range of the medians. wrist_moved_m: the same of the wrist,
    along the axis where it is largest [m]. hidden: (20,) bool, of which angles the stretch tells nothing; they are
    NaN in the others. prior: (20,) bool, which of the others posture statistics tell, and not the markers
    (core.sources): such an angle is where usual hands have it, whatever this one does. rms_m: median fit [m].
    """

    frames: int
    angle_rad: FloatArray
    std_rad: FloatArray
    known_rad: FloatArray
    moved_rad: FloatArray
    wrist_moved_m: float
    hidden: BoolArray
    prior: BoolArray
    rms_m: float

    @property
    def most_moved(self) -> int:
        """Which of the 20 angles moved most."""
        return int(np.argmax(np.nan_to_num(self.moved_rad)))


def held_hands(
    solved: Sequence[TrackedFrame], times_s: FloatArray, profile: Profile, sides: Sequence[Side], performer: int = 0
) -> dict[Side, HeldHand]:
    """Those of `sides` that are seen in a stretch.

    solved: its frames, as they were tracked with `profile`, gaps not filled. times_s: (n,) [s] of each, growing.
    performer: the index of the hands. Raises PhalanxError where the stretch is too short, no hand is tracked in it, one
    is tracked in a part of it only, or one moves.
    """
    length_s = float(times_s[-1] - times_s[0]) if len(solved) else 0.0
    if len(solved) < LEAST_FRAMES or length_s < LEAST_S:
        raise PhalanxError(
            f"The stretch has {len(solved):,} frames over {length_s:.2f} s; at least {LEAST_FRAMES} frames over "
            f"{LEAST_S:g} s are needed.",
            "Choose another --from and --to.",
        )
    held: dict[Side, HeldHand] = {}
    for side in sides:
        key = HandKey(performer, side)
        hands = [next((hand for hand in frame.hands if hand.key == key), None) for frame in solved]
        rows = [i for i, hand in enumerate(hands) if hand is not None and hand.state is HandState.TRACKED]
        if not rows:
            continue
        if len(rows) < LEAST_TRACKED * len(solved):
            raise PhalanxError(
                f"The {side} hand was tracked in {len(rows):,} of {len(solved):,} frames of the stretch.",
                "Choose a stretch in which it is tracked throughout, or the other hand alone with --side.",
            )
        shown = [hand for hand in hands if hand is not None and hand.state is HandState.TRACKED]
        held[side] = held_hand(shown, times_s[rows], profile)
        _check_still(side, held[side])
    if not held:
        raise PhalanxError(
            f"The {' or '.join(sides)} hand was not tracked in the stretch.",
            "Check --from and --to, and that --profile names what was worn.",
        )
    return held


def neutral_of(
    held: Mapping[Side, HeldHand],
    given_rad: Mapping[Side, FloatArray],
    before: Neutral | None,
    source: str,
    from_s: float,
    to_s: float,
    date: str,
    *,
    every: bool = False,
) -> Neutral:
    """The zeros that held hands tell.

    given_rad: (20,) [rad] of each hand, at what its angles were held. before: the profile's zeros until now: those of
    hands that are not held, and of angles that were hidden, stay. source, from_s, to_s, date: as in a NeutralHand.
    every: angles that posture statistics tell get a zero, too. Else they have none: it would take off what other
    postures do not have.
    """
    hands = {} if before is None else dict(before.hands)
    for side, one in held.items():
        old = hands.get(side)
        nothing = np.zeros(N_ANGLES)
        # As exact as a file holds them: a profile that was saved reports the same angles to the last digit.
        prior = one.prior & (not every)
        zero_rad, std_rad = (
            np.asarray(np.where(one.hidden, kept, np.where(prior, 0.0, new)).round(9), dtype=np.float64)
            for kept, new in (
                (nothing if old is None else old.zero_rad, one.angle_rad - given_rad[side]),
                (nothing if old is None else old.std_rad, one.std_rad),
            )
        )
        hidden, statistics = (
            tuple(name for name, out in zip(DIGIT_DOF_NAMES, outs, strict=True) if out) for outs in (one.hidden, prior)
        )
        far = int(np.argmax(np.abs(zero_rad)))
        if abs(zero_rad[far]) > LARGEST_RAD:
            raise PhalanxError(
                f"The {side} {DIGIT_DOF_NAMES[far]} would have a zero of {np.degrees(zero_rad[far]):.0f} degrees.",
                "Check the angles that were given.",
            )
        hands[side] = NeutralHand(
            zero_rad, std_rad, given_rad[side].round(9), hidden, source, from_s, to_s, date, statistics
        )
    return Neutral(hands)


def far_angles(hand: NeutralHand) -> list[tuple[str, float]]:
    """The angles whose zero is so large that the hand rather was not held as given, and by how much [rad]."""
    return [
        (name, float(zero))
        for name, zero in zip(DIGIT_DOF_NAMES, hand.zero_rad, strict=True)
        if abs(zero) > FAR_RAD and name not in hand.hidden and not name.startswith("thumb_cmc")
    ]


def _check_still(side: Side, held: HeldHand) -> None:
    k = held.most_moved
    moved_rad = float(np.nan_to_num(held.moved_rad[k]))
    if moved_rad > MOST_MOVED_RAD:
        known = f" (known to +-{np.degrees(held.known_rad[k]):.1f})" if np.isfinite(held.known_rad[k]) else ""
        raise PhalanxError(
            f"The {side} hand moved: its {DIGIT_DOF_NAMES[k]} by {np.degrees(moved_rad):.1f} degrees{known}; at most "
            f"{np.degrees(MOST_MOVED_RAD):.0f} are held still.",
            "Choose a stretch in which the hand is held, or the other hand alone with --side.",
        )


def held_hand(hands: Sequence[HandFrame], times_s: FloatArray, profile: Profile) -> HeldHand:
    """What tracked frames of one hand tell, whether it was held still in them or not. times_s: (n,) [s], growing."""
    theta, stds = (
        np.array(values) for values in zip(*((hand.theta_rad, hand.theta_std) for hand in hands), strict=True)
    )
    solver = tracking_solver(profile)
    guesses, information = Guesses(solver), Information(solver)
    seen = ~np.array([guesses.of(right_pose(hand), hand.observed) for hand in hands])
    hidden: BoolArray = seen.mean(axis=0) < LEAST_SEEN
    measured = (
        seen & np.array([information.measured(right_pose(hand), hand.observed) for hand in hands])[:, N_ROOT_DOFS:]
    )
    prior: BoolArray = ~hidden & (measured.sum(axis=0) < LEAST_SEEN * seen.sum(axis=0))
    n_blocks = max(round(float(times_s[-1] - times_s[0]) / BLOCK_S), 1)
    angle_rad, std_rad, known_rad, moved_rad = (np.full(N_ANGLES, np.nan) for _ in range(4))
    for k in np.flatnonzero(~hidden):
        values, doubt = (all_of[seen[:, k], N_ROOT_DOFS + k] for all_of in (theta, stds))
        medians = _block_medians(values, n_blocks)
        angle_rad[k] = np.median(values)
        moved_rad[k] = np.ptp(medians)
        std_rad[k] = medians.std(ddof=1)
        known_rad[k] = np.median(doubt)
    wrist = np.array([_block_medians(theta[:, axis], n_blocks) for axis in range(3)])
    return HeldHand(
        len(hands), angle_rad, std_rad, known_rad, moved_rad, float(np.ptp(wrist, axis=1).max()), hidden,
        prior, float(np.median([hand.rms_m for hand in hands])),
    )  # fmt: skip


def _block_medians(values: FloatArray, n_blocks: int) -> FloatArray:
    """(n_blocks,) or fewer, of values (n,) in the order of time."""
    blocks = np.array_split(values, min(n_blocks, len(values)))
    return np.array([np.median(block) for block in blocks])
