"""The tracking engine: one frame of points in, the poses of the hands out.

`Engine.step` is the whole pipeline. It knows no thread, no device and no window, keeps no clock of its own but to
measure itself, and on the same frames gives the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from time import perf_counter

import numpy as np

from core.cast import hands_of, props_of
from core.confidence import confidence
from core.doubt import placement_m
from core.errors import PhalanxError
from core.frames import (
    NO_ID,
    NO_POINT,
    BoolArray,
    FloatArray,
    HandFrame,
    HandKey,
    IntArray,
    MarkerFrame,
    PropFrame,
    TrackedFrame,
)
from core.gaps import present
from core.hand.mirror import mirror_points, mirror_theta, mirror_transforms
from core.hand.skeleton import N_DOFS
from core.labelling.asking import Asker
from core.labelling.continuity import Continuity
from core.labelling.finder import HandFinder
from core.labelling.mending import Mender
from core.labelling.network import LabelNetwork
from core.labelling.search import TemplateSearch
from core.labelling.validation import Validation
from core.markers.layout import load_layout
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import Profile
from core.props import tracker
from core.props.tracker import Props
from core.stages import Finder, Labeller, Validator
from core.track import HandTrack, tracking_solver

WARM_UP_FRAMES = 60


class Engine:
    """Tracks the hands and props of one performer or several.

    profiles: one per performer; hands are told apart by performer and side, in that order. Of props of one name the
    first is tracked. Parts may be replaced: `labeller` names the points of hands that are tracked, `validator` judges
    the poses and mends what it can, `finder` looks for the hands that are not. Raises PhalanxError for no profile.
    """

    def __init__(
        self,
        profiles: Profile | Sequence[Profile],
        *,
        labeller: Labeller | None = None,
        validator: Validator | None = None,
        finder: Finder | None = None,
    ) -> None:
        self.profiles: tuple[Profile, ...] = (profiles,) if isinstance(profiles, Profile) else tuple(profiles)
        if not self.profiles:
            raise PhalanxError("An engine without a performer.", "Give at least one profile.")
        self._solvers = [tracking_solver(profile) for profile in self.profiles]
        self._props = Props(props_of(self.profiles))
        self.labeller: Labeller = labeller or Continuity()
        self._asker = Asker(self.profiles)
        self._searches = [TemplateSearch.of(profile) for profile in self.profiles]
        self.finder: Finder = finder or HandFinder(self._searches, self._asker)
        self.validator: Validator = validator or Validation(Mender(self._searches, self._asker))
        self._tracks: list[HandTrack] = []
        self.reset()

    def change(self, profiles: Sequence[Profile]) -> None:
        """Track these performers from now on. Hands whose glove and network are as they were are followed on, and so
        are props. Raises FormatError for a network that cannot be run, and then goes on as before."""
        before, asked = self.profiles, self._asker.networks
        self._asker.change(profiles)
        was = _who_they_were(before, asked, profiles, self._asker.networks)
        self.profiles = tuple(profiles)
        pairs = list(zip(was, profiles, strict=True))
        self._solvers = [tracking_solver(new) if old is None else self._solvers[old] for old, new in pairs]
        # In place: finder and mender have the same list.
        self._searches[:] = [TemplateSearch.of(new) if old is None else self._searches[old] for old, new in pairs]
        known, kept = {track.key: track for track in self._tracks}, {}
        self._tracks = []
        for hand in hands_of(self.profiles):
            old = was[hand.performer]
            track = None if old is None else known.get(HandKey(old, hand.side))
            if track is None:
                track = self._new_track(hand)
            else:
                kept[track.key] = hand
                track.performer = hand.performer
            self._tracks.append(track)
        for stage in (self.labeller, self.finder, self.validator):
            stage.keep(kept)
        self._props.change(props_of(self.profiles))

    def reset(self) -> None:
        """Forget every hand and prop and search anew."""
        self._tracks = [self._new_track(hand) for hand in hands_of(self.profiles)]
        self._last_s = float("nan")
        self._props.reset()
        self.labeller.reset()
        self.finder.reset()
        self.validator.reset()

    def skip(self, frames: int = 1) -> None:
        """So many frames went by that are not to be solved: whatever counts frames counts them as well."""
        for track in self._tracks:
            track.skip(frames)
        for stage in (self.labeller, self.finder, self.validator):
            stage.skip(frames)
        self._props.skip(frames)

    def pass_over(self, frame: MarkerFrame) -> None:
        """One frame that is not to be solved, though it is there: microseconds. What keeps its device's id through such
        frames keeps its name; what vanishes in them and comes back is another's until it is named anew; and whatever
        counts frames counts them as if they had been solved."""
        ids = frozenset(frame.ids[present(frame.points_m)].tolist()) - {NO_ID}
        tracked = [track for track in self._tracks if track.tracked]
        for track in tracked:
            track.pass_over(ids)
        self.labeller.pass_over(ids, tracked)
        self.finder.skip(1)
        self.validator.skip(1)
        self._props.pass_over(ids)

    def search(self, hand: HandKey) -> None:
        """Forget one hand and search it anew; the others are followed on. Nothing happens if there is no such hand."""
        self._tracks = [self._new_track(hand) if track.key == hand else track for track in self._tracks]
        self.finder.reset()

    def _new_track(self, hand: HandKey) -> HandTrack:
        profile = self.profiles[hand.performer]
        solver = self._solvers[hand.performer]
        return HandTrack(hand.performer, hand.side, profile.worn, solver, profile.scale, placement_m(profile))

    def step(self, frame: MarkerFrame) -> TrackedFrame:
        """Solve one frame. Never raises for what a frame holds: points that are not finite count as not there."""
        stage_s: dict[str, float] = {}
        usable = np.flatnonzero(present(frame.points_m))
        points_m, ids = frame.points_m[usable], frame.ids[usable]
        dt_s = self._advance(frame)
        self._asker.next_frame(*self._found_sizes())

        started = perf_counter()
        props: tuple[PropFrame, ...] = ()
        if self._props.trackers:
            left_over = self._props.step(points_m, ids, dt_s)
            props = self._props.frames(points_m, usable)
            # Hands do not see what is a prop's.
            usable, points_m, ids = usable[left_over], points_m[left_over], ids[left_over]
            started = _lap(stage_s, "props", started)
        seen_by = [points_m if track.side == "right" else mirror_points(points_m) for track in self._tracks]
        tracked = [i for i, track in enumerate(self._tracks) if track.tracked]
        for i in tracked:
            self._tracks[i].predict(dt_s)
        self.labeller.label([seen_by[i] for i in tracked], ids, [self._tracks[i] for i in tracked])
        started = _lap(stage_s, "label", started)

        for i in tracked:
            if self._tracks[i].observed.any():
                self._tracks[i].solve(seen_by[i])
        started = _lap(stage_s, "solve", started)

        for i in tracked:
            track, points = self._tracks[i], seen_by[i]
            if self.validator.accept(track, points, self._free(len(points), self._tracks)):
                track.settle(points, ids, dt_s)
            else:
                track.lose()
        started = _lap(stage_s, "validate", started)

        missing = [i for i, track in enumerate(self._tracks) if not track.tracked]
        if missing:
            free = np.flatnonzero(self._free(len(points_m), self._tracks))
            self.finder.find([seen_by[i] for i in missing], ids, free, [self._tracks[i] for i in missing])
            for i in missing:
                if self._tracks[i].tracked:
                    self._tracks[i].solve(seen_by[i])
        _lap(stage_s, "find", started)

        hands = tuple(
            self._hand_frame(track, points, usable) for track, points in zip(self._tracks, seen_by, strict=True)
        )
        return TrackedFrame(frame.sequence, frame.times, hands, props, stage_s)

    def _found_sizes(self) -> tuple[dict[int, float], dict[int, float]]:
        """Scale of the hands of each performer who has one of which it is known, and of each who has one that is
        tracked: both hands are about the same."""
        known = {track.performer: track.known_scale for track in self._tracks if track.known_scale is not None}
        return known, {track.performer: track.pose.scale for track in self._tracks if track.tracked}

    def _advance(self, frame: MarkerFrame) -> float:
        """Seconds since the last frame, by the device's clock if it has one; NaN at the first."""
        now = frame.times.device_s if np.isfinite(frame.times.device_s) else frame.times.host_s
        dt_s, self._last_s = now - self._last_s, now
        return dt_s

    @staticmethod
    def _free(n_points: int, tracks: Sequence[HandTrack]) -> BoolArray:
        """(n,) bool, points that carry no label."""
        free = np.ones(n_points, dtype=np.bool_)
        for track in tracks:
            free[track.point[track.observed]] = False
        return free

    def _hand_frame(self, track: HandTrack, points_m: FloatArray, usable: IntArray) -> HandFrame:
        """The public record of one hand, mirrored back where it is a left one."""
        seen = track.observed
        markers = track.expected_m()
        markers[seen] = points_m[track.point[seen]]
        theta_std, marker_std_m = np.full(N_DOFS, np.nan), np.full(len(seen), np.nan)
        sure = np.zeros(len(seen))
        if track.tracked:
            theta_std, marker_std_m = track.uncertainty()
            sure = confidence(marker_std_m, np.where(seen, track.errors_m(points_m), 0.0))
        point = np.full(len(seen), NO_POINT, dtype=np.int64)
        point[seen] = usable[track.point[seen]]
        theta, joints = track.pose.theta_rad, track.pose.joints_world
        if track.side == "left":
            theta, joints, markers = mirror_theta(theta), mirror_transforms(joints), mirror_points(markers)
        else:
            theta, joints = theta.copy(), joints.copy()
        rms_m = track.pose.rms_m if track.tracked else float("nan")
        return HandFrame(
            track.side,
            track.state,
            theta,
            joints,
            markers,
            point,
            sure,
            theta_std,
            marker_std_m,
            rms_m,
            track.pose.scale,
            track.performer,
            track.label_confidence.copy(),
            track.why,
        )


def _who_they_were(
    before: Sequence[Profile], asked: Sequence[LabelNetwork], now: Sequence[Profile], ask: Sequence[LabelNetwork]
) -> list[int | None]:
    """Which performer of `before` each of `now` is, None where the hands must be looked for. asked, ask: networks."""
    was: list[int | None] = [None] * len(now)
    pairs = [(old, new) for new in range(len(now)) for old in range(len(before)) if asked[old] is ask[new]]
    # The very same first: who stays may wear what somebody wore who has left.
    the_same = [(old, new) for old, new in pairs if before[old] is now[new]]
    alike = [(old, new) for old, new in pairs if old == new and before[old].same_hands(now[new])]
    for old, new in the_same + alike:
        if was[new] is None and old not in was:
            was[new] = old
    return was


def _lap(stage_s: dict[str, float], name: str, started: float) -> float:
    now = perf_counter()
    stage_s[name] = now - started
    return now


def warm_up() -> None:
    """Compile every kernel that an engine uses, or load it from the cache: seconds to a quarter of a minute.

    To be called before the first frame counts; an engine that meets its kernels uncompiled would stand still. It
    solves the hardest of what may come: hands that lose markers, jump, and are covered in ghosts.
    """
    tracker.warm_up()
    profile = Profile("", load_layout("han19"))
    stream = MarkerStream(Performer(profile), 120.0, hidden=0.3, ghosts=4.0)
    engine = Engine(profile)
    for i, frame in enumerate(islice(stream.frames(), WARM_UP_FRAMES)):
        jump = 0.02 * (i % 20 == 10)
        engine.step(replace(frame, points_m=frame.points_m + jump))
