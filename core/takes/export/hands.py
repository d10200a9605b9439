"""The motion of one hand as animation formats hold it: a wrist that moves, and joints that turn."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import BoolArray, FloatArray, HandKey, IntArray
from core.hand.mirror import mirror_points
from core.hand.skeleton import DIGITS, JOINT_PARENTS, N_JOINTS, TIP_JOINTS
from core.hand.tips import tips_world
from core.takes.export.bone_names import BoneNames, bone_names
from core.takes.export.content import Content, hand_of, last_tracked
from core.takes.export.progress import Progress


@dataclass(frozen=True)
class HandMotion:
    """One hand over all solved frames; where it is not tracked, the last pose is held (before the first: the first).

    words: "left", with several performers "Anna left". names: of its joints and tips, as the options ask.
    rest_m: (16, 3) float64 [m], joints of this side's hand at rest, at `scale`, in the hand frame.
    tips_m: (5, 3) float64 [m], ends of the digits, alike.
    tracked: (t,) bool. wrist_m: (t, 3) float64 [m], world.
    rotations_xyzw: (t, 16, 4) float64, unit, each joint in its parent's frame (wrist: in the world), without jumps
        of sign. At rest all are the identity.
    sizes: (t,) float64, the engine's hand scale in each frame in parts of `scale`.
    joints_m: (t, 16, 3) float64 [m], the joints as they were solved, world.
    ends_m: (t, 5, 3) float64 [m], the ends of the digits alike: they tell how the last joints are turned.
    """

    hand: HandKey
    words: str
    names: BoneNames
    scale: float
    rest_m: FloatArray
    tips_m: FloatArray
    tracked: BoolArray
    wrist_m: FloatArray
    rotations_xyzw: FloatArray
    sizes: FloatArray
    joints_m: FloatArray
    ends_m: FloatArray

    @property
    def n_frames(self) -> int:
        """Solved frames."""
        return len(self.tracked)

    def at(self, frames: IntArray) -> HandMotion:
        """The motion at these frames, (k,) int64."""
        return replace(
            self, tracked=self.tracked[frames], wrist_m=self.wrist_m[frames], sizes=self.sizes[frames],
            rotations_xyzw=self.rotations_xyzw[frames], joints_m=self.joints_m[frames], ends_m=self.ends_m[frames],
        )  # fmt: skip

    def between(self, before: IntArray, after: IntArray, share: FloatArray) -> HandMotion:
        """The motion at places from one frame to another.

        before, after: (k,) int64, frames. share: (k,) float64, 0 to 1, of the way. Where the hand is not tracked in
        both it is as before. Rotations are blended along the shortest way, so that bones keep their length.
        """
        start, end = self.at(before), self.at(after)
        share = np.where(start.tracked & end.tracked, share, 0.0)
        moved = share > 0.0
        if not moved.any():
            return start
        sizes = start.sizes + share * (end.sizes - start.sizes)
        wrist_m = start.wrist_m + share[:, None] * (end.wrist_m - start.wrist_m)
        turns = blended_rotations(start.rotations_xyzw, end.rotations_xyzw, share[:, None])
        joints_m, ends_m = self._placed(wrist_m[moved], turns[moved], sizes[moved])
        start.joints_m[moved], start.ends_m[moved] = joints_m, ends_m
        return replace(start, wrist_m=wrist_m, sizes=sizes, rotations_xyzw=_without_sign_jumps(turns))

    def _placed(
        self, wrist_m: FloatArray, rotations_xyzw: FloatArray, sizes: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(t, 16, 3) and (t, 5, 3) float64 [m], joints and tips where these rotations put them."""
        world = Rotation.from_quat(rotations_xyzw.reshape(-1, 4)).as_matrix().reshape(-1, N_JOINTS, 3, 3)
        joints_m = np.repeat(wrist_m[:, None], N_JOINTS, axis=1)
        bones_m = sizes[:, None, None] * self.offsets_m
        for joint, parent in enumerate(JOINT_PARENTS[1:], start=1):
            joints_m[:, joint] = joints_m[:, parent] + np.einsum("tab,tb->ta", world[:, parent], bones_m[:, joint])
            world[:, joint] = world[:, parent] @ world[:, joint]
        last = list(TIP_JOINTS)
        beyond = sizes[:, None, None] * (self.tips_m - self.rest_m[last])
        return joints_m, joints_m[:, last] + np.einsum("tdab,tdb->tda", world[:, last], beyond)

    @property
    def offsets_m(self) -> FloatArray:
        """(16, 3) float64 [m], each joint at rest from its parent; the wrist is the origin."""
        parents = np.maximum(np.asarray(JOINT_PARENTS), 0)
        offsets: FloatArray = self.rest_m - self.rest_m[parents]
        return offsets


def hand_motion(content: Content, key: HandKey, progress: Progress) -> HandMotion:
    """The whole recording of a hand that is tracked in at least one frame."""
    n, scale = content.timeline.n_frames, content.scale[key]
    tracked = np.zeros(n, dtype=np.bool_)
    joints_m = np.zeros((n, N_JOINTS, 3))
    turns = np.tile(np.eye(3), (n, N_JOINTS, 1, 1))
    sizes = np.ones(n)
    ends_m = np.zeros((n, len(DIGITS), 3))
    skeleton = content.cast[key.performer].hand.skeleton.scaled(scale)
    rest_m, tips_m = skeleton.joint_positions_m, skeleton.tip_positions_m
    if key.side == "left":
        rest_m, tips_m = mirror_points(rest_m), mirror_points(tips_m)
    parents = np.asarray(JOINT_PARENTS[1:])
    for i, frame in enumerate(progress.over(content.solved, f"Collecting the {content.words(key)} hand", n)):
        hand = hand_of(frame, key)
        if hand is None:
            continue
        world = hand.joints_world[:, :3, :3]
        local = world.copy()
        local[1:] = world[parents].transpose(0, 2, 1) @ world[1:]
        tracked[i] = True
        joints_m[i] = hand.joints_world[:, :3, 3]
        turns[i] = local
        sizes[i] = hand.scale / scale
        ends_m[i] = tips_world(skeleton, key.side, hand.joints_world, hand.scale / scale)
    held = last_tracked(tracked)
    rotations = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat().reshape(n, N_JOINTS, 4)
    return HandMotion(
        key,
        content.words(key),
        bone_names(content.options.bones, key.side, content.subjects[key.performer]),
        scale,
        rest_m,
        tips_m,
        tracked,
        joints_m[held, 0],
        _without_sign_jumps(rotations[held]),
        sizes[held],
        joints_m[held],
        ends_m[held],
    )


def blended_rotations(start_xyzw: FloatArray, end_xyzw: FloatArray, share: FloatArray) -> FloatArray:
    """(..., 4) float64, unit, a share of the way from one to the other (Shoemake 1985). share: broadcast."""
    cosine = np.einsum("...i,...i->...", start_xyzw, end_xyzw)
    end_xyzw = np.where(cosine[..., None] < 0.0, -end_xyzw, end_xyzw)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    near = angle < 1e-6  # there the straight line is the arc
    sine = np.where(near, 1.0, np.sin(angle))
    first = np.where(near, 1.0 - share, np.sin((1.0 - share) * angle) / sine)
    second = np.where(near, share, np.sin(share * angle) / sine)
    blended: FloatArray = first[..., None] * start_xyzw + second[..., None] * end_xyzw
    blended /= np.linalg.norm(blended, axis=-1, keepdims=True)
    return blended


def _without_sign_jumps(rotations: FloatArray) -> FloatArray:
    """q and -q turn alike; players blend between keys as numbers, so neighbours must lie on the same side."""
    same = np.einsum("tji,tji->tj", rotations[1:], rotations[:-1]) >= 0.0
    signs = np.cumprod(np.where(same, 1.0, -1.0), axis=0)
    rotations[1:] *= signs[:, :, None]
    return rotations
