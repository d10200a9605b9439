"""Make poses.json from the sketches: python -m resources.motion.build_poses [NAME...]

Each sketch is changed as little as its contacts need: Gauss-Newton on the digit angles (and the place of what is
held), where places that must touch are pulled together, parts that lie in one another pushed apart, and every angle
held to its sketch, to its limits, and a finger's last joint to the one before it.
"""

from __future__ import annotations

import argparse
import json
import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from core.frames import FloatArray
from core.hand.model import template
from core.motion.pose_file import LibraryPose, Prop, poses_from_dict, poses_to_dict
from resources.motion import surface
from resources.motion.free_hand import free_hand_goals
from resources.motion.goal import Goal, Held
from resources.motion.grasps import grasp_goals

POSES = Path(__file__).parent / "poses.json"

ITERATIONS = 80
EVERY = 2
"""Only every so many vertices are checked while solving."""

SKETCH_DEG = 9.0
"""An angle this far from its sketch weighs as much as a contact 1 mm apart."""

PLACE_MM, TURN_DEG = 12.0, 12.0
"""The same for what is held."""

SKIN_GIVES_M = 0.0005
"""Skin is soft: parts may lie in one another by this much."""

_STEP_RAD = 1e-4
_STILL = 2e-4
_THIN_M = 0.020
_FIRM = (1.5, 4.0)
_LONGEST_STEP = 0.08
"""[rad] and, for what is held, [dm]."""


def main() -> None:
    """Solve all goals, or the named ones, and write the file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="only these; the others are kept")
    names = parser.parse_args().names
    goals = [*free_hand_goals(), *grasp_goals()]
    kept = poses_from_dict(json.loads(POSES.read_text(encoding="utf-8"))) if names else {}
    poses = {goal.name: solved(goal) if goal.name in names or goal.name not in kept else kept[goal.name]
             for goal in goals}  # fmt: skip
    assert len(poses) == len(goals), "two goals of one name"
    write(poses)


def write(poses: dict[str, LibraryPose]) -> None:
    """One line per digit, so that the file can be read and edited by hand."""
    text = json.dumps(poses_to_dict(poses), indent=1)
    POSES.write_text(_joined_numbers(text) + "\n", encoding="utf-8")


def _joined_numbers(text: str) -> str:
    """Innermost lists on one line."""
    return re.sub(r"\[\s+([^\[\]{}]*?)\s+\]", lambda found: "[" + re.sub(r"\s*\n\s*", " ", found[1]) + "]", text)


def solved(goal: Goal) -> LibraryPose:
    """The pose that a goal means, rounded as it is stored."""
    problem = Problem(goal)
    state = problem.solve()
    pose = LibraryPose(goal.name, goal.activity, goal.source, problem.angles(state), problem.prop(state), goal.contacts)
    pose = poses_from_dict(poses_to_dict({goal.name: pose}))[goal.name]
    report(pose)
    return pose


def report(pose: LibraryPose) -> None:
    """Say what is not as it should be."""
    depth, where = surface.deepest_overlap(pose.angles_rad)
    gaps = {" - ".join(pair): surface.contact_gap(pose.angles_rad, pose.prop, pair) * 1e3 for pair in pose.contacts}
    words = [f"{where} by {depth * 1e3:.1f} mm"] if depth > 2e-3 else []
    words += [f"{name}: {gap:.1f} mm" for name, gap in gaps.items() if abs(gap) > 2.0]
    if pose.prop is not None:
        points, _ = surface.surface(pose.angles_rad)
        distance = surface.prop_distance(pose.prop, points)
        deepest = int(np.argmin(distance))
        place = surface.part_name(surface.bodies()[deepest])
        words += [f"{place} in prop by {-distance[deepest] * 1e3:.1f} mm"] if distance[deepest] < -2e-3 else []
    print(f"{pose.name:28s} {'; '.join(words) or 'ok'}", flush=True)


class Problem:
    """One goal as least squares over a state: 20 angles [rad], then 6 of the prop (shift [dm], turn [rad])."""

    def __init__(self, goal: Goal) -> None:
        self.goal = goal
        self.sketch = np.radians(np.asarray(goal.sketch_deg, dtype=np.float64).reshape(20))
        self.limits = template().skeleton.limits_rad
        self.start = _prop_of(goal.held) if goal.held is not None else None
        self.sample = np.arange(0, len(template().vertices_m), EVERY)
        self.bodies = surface.bodies()[self.sample]
        self.firm = _FIRM[0]

    def angles(self, state: FloatArray) -> FloatArray:
        """(20,) [rad] of a state."""
        return np.asarray(state[:20])

    def prop(self, state: FloatArray) -> Prop | None:
        """What is held, where a state says."""
        if self.start is None:
            return None
        transform = self.start.transform_hand.copy()
        transform[:3, 3] += state[20:23] * 0.1
        transform[:3, :3] = Rotation.from_rotvec(state[23:26]).as_matrix() @ transform[:3, :3]
        return Prop(self.start.shape, self.start.size_m, transform)

    def solve(self) -> FloatArray:
        """Gauss-Newton; which parts touch is looked up anew at every step."""
        low, high = self.limits[:, 0] + np.radians(1.0), self.limits[:, 1] - np.radians(1.0)
        state = np.concatenate([np.clip(self.sketch, low, high), np.zeros(6 if self.start is not None else 0)])
        for iteration in range(ITERATIONS):
            # First the places find one another, then parts that lie in one another leave each other.
            self.firm = _FIRM[0] if iteration < ITERATIONS // 2 else _FIRM[1]
            pairs = self._pairs(state)
            residual = self._residuals(state, pairs)
            jacobian = np.empty((len(residual), len(state)))
            for k in range(len(state)):
                moved = state.copy()
                moved[k] += _STEP_RAD
                jacobian[:, k] = (self._residuals(moved, pairs) - residual) / _STEP_RAD
            normal = jacobian.T @ jacobian + np.diag(np.full(len(state), 20.0))
            step = -np.linalg.solve(normal, jacobian.T @ residual)
            longest = _LONGEST_STEP * (1.0 if iteration < ITERATIONS // 2 else 0.4)
            step *= min(1.0, longest / max(float(np.abs(step).max()), 1e-12))
            before, state = state, state + step
            state[:20] = np.clip(state[:20], low, high)
            if np.abs(state - before).max() < _STILL and (self.firm == _FIRM[1] or not len(pairs[0]) + len(pairs[2])):
                break
        return state

    def _pairs(self, state: FloatArray) -> tuple[np.ndarray, ...]:
        """Vertices close to another part, those they are close to, and vertices close to the prop."""
        points, normals = surface.surface(self.angles(state), self.sample)
        partner, depth = surface.overlaps(points, normals, self.bodies)
        close = np.flatnonzero((partner >= 0) & (depth > -0.003))
        near = np.flatnonzero(surface.prop_distance(prop, points) < 0.004) if (prop := self.prop(state)) else close[:0]
        return self.sample[close], self.sample[partner[close]], self.sample[near]

    def _residuals(self, state: FloatArray, pairs: tuple[np.ndarray, ...]) -> FloatArray:
        """In units of 1 mm at a contact."""
        angles, prop = self.angles(state), self.prop(state)
        inner, outer, near = pairs
        sites = [[surface.site(place) for place in pair if place != "prop"] for pair in self.goal.contacts]
        flat = np.asarray([vertex for pair in sites for vertex in pair], dtype=np.int64)
        points, normals = surface.surface(angles, np.concatenate([inner, outer, near, flat]))
        n = len(inner)
        depth = -np.einsum("na,na->n", points[:n] - points[n : 2 * n], normals[n : 2 * n])
        parts = [np.maximum(depth - SKIN_GIVES_M, 0.0) * 1e3 * self.firm]
        if prop is not None:
            inside = slice(2 * n, 2 * n + len(near))
            parts.append(
                np.maximum(_depths(prop, points[inside], normals[inside]) - SKIN_GIVES_M, 0.0) * 1e3 * self.firm
            )
            parts.append(state[20:23] * 100.0 / PLACE_MM)
            parts.append(np.degrees(state[23:26]) / TURN_DEG)
        i = 2 * n + len(near)
        for places, pair in zip(self.goal.contacts, sites, strict=True):
            if len(pair) == 1 and prop is not None:
                parts.append(2.0 * surface.prop_distance(prop, points[i : i + 1]) * 1e3)
                # Without this a thin thing would as soon lie on the finger's other side.
                parts.append((normals[i] + surface.prop_normals(prop, points[i : i + 1])[0]) * 3.0)
            else:
                parts.append((points[i] - points[i + 1]) * 1e3)
                if not any(place.endswith("tip") for place in places):  # a tip is round
                    parts.append((normals[i] + normals[i + 1]) * 2.0)
            i += len(pair)
        parts.append(np.degrees(angles - self.sketch) / SKETCH_DEG)
        fingers, sketch = angles.reshape(5, 4)[1:], self.sketch.reshape(5, 4)[1:]
        # The last joint follows the one before it as it does in the sketch.
        parts.append(np.degrees((fingers[:, 3] - sketch[:, 3]) - 2.0 / 3.0 * (fingers[:, 2] - sketch[:, 2])) / 9.0)
        return np.concatenate(parts)


def _depths(prop: Prop, points: FloatArray, normals: FloatArray) -> FloatArray:
    """(n,) [m], how far points of the skin must go back to leave a prop; a thin one is left where it was entered."""
    depths = -surface.prop_distance(prop, points)
    through = (np.einsum("na,na->n", normals, surface.prop_normals(prop, points)) > 0.3) & (depths > 0.0)
    return np.where(through & (min(prop.size_m) < _THIN_M), min(prop.size_m) - depths, depths)


def _prop_of(held: Held) -> Prop:
    z = np.asarray(held.z_axis, dtype=np.float64)
    z /= np.linalg.norm(z)
    x = np.asarray(held.x_axis, dtype=np.float64)
    x = x - z * (x @ z)
    if np.linalg.norm(x) < 1e-6:
        x = np.cross((0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    transform = np.eye(4)
    transform[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    transform[:3, 3] = np.asarray(held.position_mm) * 1e-3
    return Prop(held.shape, tuple(length * 1e-3 for length in held.size_mm), transform)


if __name__ == "__main__":
    main()
