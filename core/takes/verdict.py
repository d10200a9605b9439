"""One verdict on a take, for the deck, the card, the list, review and the command line alike.

Red is what cannot be made again: frames. Amber is what can (poses), or what is little.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from core.frames import stood_still
from core.level import Level
from core.takes.holes import NO_HOLES, Holes
from core.takes.take import BY_CHOICE, DAMAGED, TakeCounts
from core.words import count

LITTLE, LITTLE_S = 0.01, 0.1
"""What may be missing from a take whose light is amber, as a share of it or in seconds; beyond both it is red."""

LONG_HOLE_S = 0.5
"""A hole as long as a grasp is red, however long the take."""

NOT_SEALED = (
    "It is not sealed: its recording is still running, was cut short, or the file was shortened since. "
    "Recover seals it."
)


@dataclass(frozen=True)
class Account:
    """What is known of a take, by whoever recorded it or reads it.

    frames, solved: raw and solved frames that can be read. counts: None if it was never sealed. holes: where there
    are no frames. length_s: how long it is [s]. damage: what is wrong with the file, in sentences. lost_raw,
    lost_solved: frames that were in the file and cannot be read. problem: why the recording failed, "" if it did not.
    befallen: what its recorder says became of the file besides, such as why it is not sealed. faults: what is not as it
    should be though every record is there, in sentences. untimed: frames of which nothing tells when they were taken.
    solves: whether a stream was to be solved, of which all this is. beside: what is known of the other streams, by
    their keys.
    """

    frames: int
    solved: int
    counts: TakeCounts | None = None
    holes: Holes = NO_HOLES
    length_s: float = 0.0
    sealed: bool = True
    damage: tuple[str, ...] = ()
    lost_raw: int = 0
    lost_solved: int = 0
    problem: str = ""
    faults: tuple[str, ...] = ()
    befallen: tuple[Finding, ...] = ()
    untimed: int = 0
    solves: bool = True
    beside: Mapping[str, Account] = field(default_factory=dict)

    @property
    def unreadable(self) -> str:
        """How many frames were in the file and cannot be read, as a sentence; "" for none."""
        if not (self.lost_raw or self.lost_solved):
            return ""
        return f"{self.lost_raw:,} raw and {self.lost_solved:,} solved frames cannot be read."

    @property
    def left_out(self) -> int:
        """Frames that were not to be solved: no pose of theirs is missing."""
        return min(self.counts.left_out, max(self.frames - self.solved, 0)) if self.counts is not None else 0

    @property
    def missing(self) -> int:
        """About how many frames the take lacks: by the clock or by what was counted, whichever says more."""
        counts = self.counts
        counted = counts.lost + counts.dropped_total if counts is not None else 0
        return max(self.holes.missing, counted, self.lost_raw)


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong. short: in a few words. text: as a sentence, with what to do. again: it is of the poses,
    which can be made again: nothing is lost."""

    level: Level
    short: str
    text: str
    again: bool = False


@dataclass(frozen=True)
class Verdict:
    """findings: the gravest first, () for a good take. good: what to say of a good one. readable: whether a frame of it
    can be read."""

    findings: tuple[Finding, ...]
    good: str
    readable: bool = True

    @property
    def level(self) -> Level:
        """The light."""
        return self.findings[0].level if self.findings else Level.GOOD

    @property
    def whole(self) -> bool:
        """Whether it is sealed, every frame is there, and all of it is as it should be; poses may be missing."""
        return all(finding.again for finding in self.findings)

    @cached_property
    def headline(self) -> str:
        """In one line."""
        return ", ".join(dict.fromkeys(finding.short for finding in self.findings)) or self.good

    @property
    def texts(self) -> tuple[str, ...]:
        """What is wrong, in sentences."""
        return tuple(finding.text for finding in self.findings)


def verdict_of(account: Account) -> Verdict:
    """What is to be thought of a take."""
    findings = _of_file(account)
    if account.solves:
        findings += [*_of_frames(account), *_of_poses(account)]
    for key, other in account.beside.items():
        findings += [
            replace(one, short=f"{key}: {one.short}", text=f"Stream {key}: {one.text}") for one in _of_frames(other)
        ]
    beside = sum(other.frames for other in account.beside.values())
    frames = account.frames if account.solves else beside
    return _verdict(findings, frames, account.frames + beside > 0, account.left_out)


def frames_verdict(account: Account) -> Verdict:
    """What is to be thought of the frames of one stream alone."""
    return _verdict(_of_frames(account), account.frames, account.frames > 0)


def _verdict(findings: list[Finding], frames: int, readable: bool, left_out: int = 0) -> Verdict:
    grave = [finding for finding in findings if finding.level is Level.PROBLEM]
    rest = [finding for finding in findings if finding.level is not Level.PROBLEM]
    good = f"{frames:,} frames, none lost"
    if left_out:
        good += f", {left_out:,} without a pose by choice"
    return Verdict((*grave, *rest), good, readable)


def _of_file(account: Account) -> list[Finding]:
    findings = [Finding(Level.PROBLEM, "damaged", text) for text in account.damage]
    if account.problem:
        findings.append(Finding(Level.PROBLEM, "recording failed", account.problem))
    if account.unreadable:
        findings.append(Finding(Level.PROBLEM, "frames cannot be read", account.unreadable))
    findings += [Finding(Level.PROBLEM, "not as it should be", text) for text in account.faults]
    findings += account.befallen
    if not account.sealed and not account.problem and not account.befallen:
        findings.append(Finding(Level.WARNING, "not sealed", NOT_SEALED))
    return findings


def _of_frames(account: Account) -> list[Finding]:
    findings, counts, holes = [], account.counts, account.holes
    if not account.frames:
        findings.append(Finding(Level.PROBLEM, "no frames", _why_none(account)))
    if counts is not None:
        for reason, n in counts.dropped.items():
            if n and reason == DAMAGED:
                text = f"{n:,} frames lost from the file: it was damaged."
                findings.append(Finding(Level.PROBLEM, f"{n:,} lost from the file", text))
            elif n:
                findings.append(Finding(Level.PROBLEM, f"{n:,} dropped", f"{n:,} frames dropped: {reason}."))
        if not counts.balanced:
            findings.append(Finding(Level.PROBLEM, "counts do not balance", counts.imbalance))
    missing = account.missing / max(account.frames + account.missing, 1)
    much = missing > LITTLE and missing * account.length_s > LITTLE_S
    level = Level.PROBLEM if much or holes.longest_s >= LONG_HOLE_S else Level.WARNING
    own, silences = holes.standing, holes.silences
    if counts is not None and (counts.unread or len(own)):
        lost = f"{counts.unread:,}" if counts.unread else f"about {own.missing:,}"
        still = stood_still(counts.standstills)
        text = f"{still}: {lost} frames of that time are lost. Keep the computer awake while it captures."
        short = f"Phalanx stood still for {sum(one.seconds for one in counts.standstills):.1f} s, {lost} frames lost"
        findings.append(Finding(level, short, text))
    if len(silences):
        pieces = "in one piece" if len(silences) == 1 else f"in {len(silences):,} pieces"
        text = f"{silences.words}, {pieces}: nothing came from the device."
        findings.append(Finding(level, silences.words, text))
    if counts is not None and (lost_on_the_way := counts.lost - counts.unread):
        text = f"{lost_on_the_way:,} frames were lost on the network before this machine."
        findings.append(Finding(level, f"{lost_on_the_way:,} never arrived", text))
    if counts is not None and counts.rejected:
        text = f"{counts.rejected:,} packets could not be read."
        findings.append(Finding(Level.WARNING, f"{counts.rejected:,} unreadable", text))
    if account.untimed:
        text = f"{count(account.untimed, 'frame')} of unknown time: the computer slept or its clock was set meanwhile."
        text += " Exports place them by their numbers; speeds there are no measurement."
        findings.append(Finding(Level.WARNING, f"{account.untimed:,} of unknown time", text))
    return findings


def _why_none(account: Account) -> str:
    """A take without frames: did none come, or can none be read?"""
    came = account.counts.received if account.counts is not None else 0
    if came:
        return f"None of the {came:,} frames that came is in it. Record it again."
    if account.damage or account.lost_raw or (not account.sealed and account.solved):
        return "No frame of it can be read. Record it again."
    return "It holds no frames. Check in Devices that they come in, then record it again."


def _of_poses(account: Account) -> list[Finding]:
    counts = account.counts
    unsolved = account.frames - account.solved - account.left_out
    if unsolved and unsolved == account.frames:
        text = f"None of its {account.frames:,} frames is solved. Solve it again in review."
        return [Finding(Level.WARNING, "not solved", text, again=True)]
    if unsolved > 0:
        poseless = counts.poseless if counts else {}
        reasons = "; ".join(f"{reason}: {n:,}" for reason, n in poseless.items() if reason != BY_CHOICE)
        # Counts are of the whole recording, and what is there may be a part of it: its frames are told by nobody.
        whole = sum(poseless.values()) - poseless.get(BY_CHOICE, 0) > unsolved
        why = f" ({'of the whole recording: ' if whole else ''}{reasons})" if reasons else ""
        owed = account.frames - account.left_out
        text = f"{unsolved:,} of {owed:,} frames have no pose{why}. Solve it again in review."
        return [Finding(Level.WARNING, f"{unsolved:,} without a pose", text, again=True)]
    if account.frames and counts is not None and counts.tracked and not any(counts.tracked.values()):
        text = "No hand was tracked in it. Check the profile, and solve it again in review."
        return [Finding(Level.WARNING, "no hand tracked", text, again=True)]
    return []
