"""The scene: every visual, in drawing order, and how a frame changes them. Knows vispy, knows no widget."""

from __future__ import annotations

import numpy as np
from vispy import gloo

from app.viewport import colours
from app.viewport.background_visual import BackgroundVisual
from app.viewport.camera import OrbitCamera
from app.viewport.hand_visual import HandVisual
from app.viewport.lines_visual import LinesVisual, grid_lines, triad_lines
from app.viewport.marker_states import MarkerState, MarkerView
from app.viewport.points_visual import MARKER_RADIUS_M, PointsVisual, Shape
from app.viewport.prop_visual import PropVisual
from app.viewport.scene_visual import SceneVisual
from core.frames import SIDES, FloatArray, HandFrame, HandKey, HandState, MarkerFrame, RigidBody, TrackedFrame
from core.hand.certainty import guessed
from core.hand.model import HandModel
from core.hand.skeleton import JOINT_PARENTS, N_JOINTS
from core.props.prop import Prop

GRID_HALF_EXTENT_M = 6.0
PROP_AXIS_M = 0.06
WORLD_AXIS_M = 0.25
_LAST_JOINTS = (3, 6, 9, 12, 15)
_SHAPES = np.array([Shape.BALL, Shape.BALL, Shape.DIAMOND, Shape.CROSS])
"""By MarkerState."""


class Scene:
    """Hands, markers, props and floor. Make and draw it with a GL context current."""

    def __init__(self, model: HandModel) -> None:
        self.background = BackgroundVisual(colours.BACKGROUND_TOP, colours.BACKGROUND_BOTTOM)
        self.fine_grid, self.coarse_grid = LinesVisual(), LinesVisual()
        self.fine_grid.set_lines(grid_lines(3.0, 0.1, 1.0), (*colours.GRID, 0.20))
        self.coarse_grid.set_lines(grid_lines(GRID_HALF_EXTENT_M, 1.0, 0.0), (*colours.GRID, 0.42))
        self.world_axes = LinesVisual(width=2.0)
        lifted = np.eye(4)
        lifted[1, 3] = 0.001  # above the floor's lines
        self.world_axes.set_lines(triad_lines(lifted, WORLD_AXIS_M), np.repeat(colours.AXIS_COLORS, 2, axis=0))
        self.hands: dict[HandKey, HandVisual] = {}
        self._models: tuple[HandModel, ...] = ()
        self.set_models((model,))
        self.skeleton = LinesVisual(width=2.0, on_top=True)
        self.props = LinesVisual(width=2.0)
        self.prop_models: dict[str, PropVisual] = {}
        self.points = PointsVisual()
        self.surface_shown = True
        self.skeleton_shown = False
        self.colour_by_digit = False

    @property
    def visuals(self) -> tuple[SceneVisual, ...]:
        """All, in drawing order: what hides others first, what shines through last."""
        return (
            self.background, self.coarse_grid, self.fine_grid, self.world_axes,
            *self.hands.values(), *self.prop_models.values(), self.props, self.points, self.skeleton,
        )  # fmt: skip

    def set_models(self, models: tuple[HandModel, ...]) -> None:
        """Whose hands are drawn: of each performer the right hand at scale 1, in the performer's shape."""
        for performer, model in enumerate(models):
            known = performer < len(self._models)
            if known and self._models[performer] is model:
                continue
            for side in SIDES:
                if known:
                    self.hands[HandKey(performer, side)].set_model(model)
                else:
                    self.hands[HandKey(performer, side)] = HandVisual(model)
        for key in [key for key in self.hands if key.performer >= len(models)]:
            del self.hands[key]
        self._models = models

    def set_props(self, props: tuple[Prop, ...]) -> None:
        """The props of the profile."""
        if props != tuple(visual.prop for visual in self.prop_models.values()):
            self.prop_models = {prop.name: PropVisual(prop) for prop in props}

    def set_frame(self, frame: MarkerFrame | None, tracked: TrackedFrame | None, view: MarkerView) -> None:
        """Show one sample; `view` is its markers' classification."""
        shown = {hand.key: hand for hand in tracked.hands if hand.key in self.hands} if tracked is not None else {}
        for key, visual in self.hands.items():
            self._set_hand(visual, shown.get(key))
        self._set_skeleton([hand for hand in shown.values() if hand.state is HandState.TRACKED])
        self._set_props(frame, tracked)
        rings_m = np.where(view.states == MarkerState.PREDICTED, np.fmax(view.std_m, MARKER_RADIUS_M), 0.0)
        shapes = np.where(view.props >= 0, Shape.SQUARE, _SHAPES[view.states])
        self.points.set_points(view.positions_m, colours.marker_colors(view, self.colour_by_digit), rings_m, shapes)

    def _set_hand(self, visual: HandVisual, hand: HandFrame | None) -> None:
        known = (
            hand is not None and hand.state is not HandState.SEARCHING and bool(np.isfinite(hand.joints_world).all())
        )
        visual.visible = known and self.surface_shown
        if hand is None or not visual.visible:
            return
        tracked = hand.state is HandState.TRACKED
        guess = guessed(hand.theta_std) if tracked else np.zeros(N_JOINTS)  # a lost hand is a guess in its own way
        visual.set_pose(hand.side, hand.joints_world, hand.scale, guess)
        if tracked:
            visual.set_look(colours.hand_color(hand.key), 0.45 if self.skeleton_shown else 1.0)
        else:
            visual.set_look(colours.LOST_COLOR, colours.LOST_OPACITY)

    def _set_skeleton(self, hands: list[HandFrame]) -> None:
        if not self.skeleton_shown or not hands:
            self.skeleton.visible = False
            return
        self.skeleton.set_lines(np.concatenate([self._bones(hand) for hand in hands]), np.asarray(colours.SKELETON))

    def _bones(self, hand: HandFrame) -> FloatArray:
        """(40, 3) float64 [m]: joint to joint, then the last joint of each digit to its tip."""
        joints_m = hand.joints_world[:, :3, 3]
        last = hand.joints_world[list(_LAST_JOINTS)]
        skeleton = self._models[hand.performer].skeleton.scaled(hand.scale)
        reach_m = skeleton.tip_positions_m - skeleton.joint_positions_m[list(_LAST_JOINTS)]
        reach_m = reach_m * ((-1.0, 1.0, 1.0) if hand.side == "left" else 1.0)
        tips_m = joints_m[list(_LAST_JOINTS)] + np.einsum("dij,dj->di", last[:, :3, :3], reach_m)
        starts, ends = joints_m[[*JOINT_PARENTS[1:], *_LAST_JOINTS]], np.concatenate([joints_m[1:], tips_m])
        return np.stack([starts, ends], axis=1).reshape(-1, 3)

    def _set_props(self, frame: MarkerFrame | None, tracked: TrackedFrame | None) -> None:
        for visual in self.prop_models.values():
            visual.visible = False
        poses, links = [], []
        for name, transform, seen in prop_poses(frame, tracked):
            if name in self.prop_models:
                self.prop_models[name].set_pose(transform, seen)
                self.prop_models[name].visible = True
                if seen:
                    links.append(_links(self.prop_models[name].prop, transform))
            else:
                poses.append((name, transform, seen))
        colors = np.repeat(colours.AXIS_COLORS, 2, axis=0)
        lines = [*links, *(triad_lines(transform, PROP_AXIS_M) for _, transform, _ in poses)]
        shades = [np.tile((*colours.PROP_COLOR, 0.8), (len(link), 1)) for link in links]
        shades += [colors * (1.0, 1.0, 1.0, 1.0 if seen else 0.35) for _, _, seen in poses]
        self.props.set_lines(
            np.concatenate(lines) if lines else np.empty((0, 3)), np.concatenate(shades) if shades else np.empty((0, 4))
        )

    def draw(self, camera: OrbitCamera, size_px: tuple[int, int], pixel_ratio: float) -> None:
        """size_px: (width, height) of the drawing surface in device pixels."""
        width, height = max(size_px[0], 1), max(size_px[1], 1)
        gloo.set_viewport(0, 0, width, height)
        gloo.set_state(depth_mask=True)
        gloo.clear(color=colours.BACKGROUND_BOTTOM, depth=True)
        view, projection = camera.view(), camera.projection(width / height)
        self._fade_floor(camera)
        self.points.set_screen(height, pixel_ratio)
        for visual in self.visuals:
            visual.set_camera(view, projection)
            visual.draw()

    def _fade_floor(self, camera: OrbitCamera) -> None:
        """The floor goes with the camera's target and vanishes around it."""
        below = camera.target_m * (1.0, 0.0, 1.0)
        reach_m = 1.2 * camera.distance_m + 1.2 * abs(float(camera.eye_m()[1])) + 0.4
        for grid, reach in ((self.fine_grid, min(reach_m, 3.0)), (self.coarse_grid, min(2.0 * reach_m, 6.0))):
            grid.set_origin(np.round(below))
            grid.set_fade(below, 0.2 * reach, reach)
        self.fine_grid.visible = camera.distance_m < 6.0


def prop_poses(frame: MarkerFrame | None, tracked: TrackedFrame | None) -> list[tuple[str, FloatArray, bool]]:
    """Name, (4, 4) pose in the world, and whether it is seen now, of every rigid body and prop.

    The engine's own props go before a device's rigid bodies of the same name.
    """
    poses = {body.name: (_pose(body.position_m, body.quaternion_wxyz), body.tracked) for body in _bodies(frame)}
    for prop in tracked.props if tracked is not None else ():
        poses[prop.name] = (prop.transform_world, prop.tracked)
    return [(name, pose, seen) for name, (pose, seen) in poses.items() if np.isfinite(pose).all()]


def _links(prop: Prop, transform: FloatArray) -> FloatArray:
    """(k, 3) [m]: lines between all markers of a prop that has no model of its own."""
    if prop.model.shape != "none":
        return np.empty((0, 3))
    pairs = np.stack(np.triu_indices(len(prop.markers_m), 1), axis=1)
    return prop.placed_m(transform)[pairs.ravel()]


def _bodies(frame: MarkerFrame | None) -> tuple[RigidBody, ...]:
    return frame.rigid_bodies if frame is not None else ()


def _pose(position_m: FloatArray, quaternion_wxyz: FloatArray) -> FloatArray:
    w, x, y, z = quaternion_wxyz
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = position_m
    return pose
