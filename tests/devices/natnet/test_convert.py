"""From the wire's frame to the engine's: every point once, metres, Y up."""

from __future__ import annotations

import math

import numpy as np
import pytest

from core.frames import NO_ID, Times
from devices.natnet.convert import Conversion, UpAxis
from devices.natnet.frames import decode_frame
from devices.natnet.protocol import unpack
from devices.natnet.records import LABELLED, RIGID_BODY, Bodies, FrameOfData, MarkerFlag
from tests.devices.natnet.capture import GOLDEN

TIMES = Times(1.0, 2.0, 3.0)
SEEN = int(MarkerFlag.POINT_CLOUD_SOLVED)


def labelled(*markers: tuple[int, tuple[float, float, float], int]) -> np.ndarray:
    records = np.zeros(len(markers), LABELLED)
    for record, (identity, position, params) in zip(records, markers, strict=True):
        record["id"], record["position"], record["params"], record["residual"] = identity, position, params, 0.25
    return records


def modern(**fields: object) -> FrameOfData:
    return FrameOfData(number=5, transmit_ticks=1, **fields)  # type: ignore[arg-type]


def test_hidden_markers_of_a_body_are_no_points() -> None:
    """The server fills them in where the body says they should be; the vendor's capture has one."""
    payload = unpack((GOLDEN / "mocapframe_packet_occluded_v3.bin").read_bytes())[1]
    frame = Conversion().frame(decode_frame(payload, (3, 0)), TIMES, {7: "FakeTree"})
    assert frame.ids.tolist() == [(7 << 16) + i for i in (3, 4, 5)]
    assert [body.name for body in frame.rigid_bodies] == ["FakeTree"]


def test_which_markers_were_seen() -> None:
    markers = labelled(
        (1, (1, 0, 0), SEEN | MarkerFlag.UNLABELLED),
        (2, (2, 0, 0), SEEN | MarkerFlag.OCCLUDED | MarkerFlag.HAS_MODEL),
        (3, (3, 0, 0), MarkerFlag.MODEL_SOLVED | MarkerFlag.HAS_MODEL),
        (4, (4, 0, 0), SEEN | MarkerFlag.MODEL_SOLVED | MarkerFlag.HAS_MODEL),
        (5, (5, 0, 0), 0x24A),  # as a server of 4.2 sends them, an unknown bit included
        (6, (math.nan, 0, 0), SEEN),
    )
    frame = Conversion().frame(modern(labelled=markers), TIMES, {})
    assert frame.ids.tolist() == [1, 4, 5]
    assert frame.points_m[:, 0].tolist() == [1, 4, 5]
    assert frame.residuals_m.tolist() == [0.25] * 3
    loose = Conversion(points="unlabelled").frame(modern(labelled=markers), TIMES, {})
    assert loose.ids.tolist() == [1]


def test_points_listed_twice_count_once() -> None:
    markers = labelled((1, (1, 0, 0), SEEN), (2, (2, 0, 0), SEEN))
    legacy = np.float32([[2, 0, 0], [1, 0, 0]])
    frame = Conversion().frame(modern(labelled=markers, unlabelled=legacy), TIMES, {})
    assert frame.ids.tolist() == [1, 2]


def test_legacy_points_are_used_where_labelled_markers_are_switched_off() -> None:
    frame = Conversion().frame(modern(unlabelled=np.float32([[2, 0, 0], [1, 0, 0]])), TIMES, {})
    assert frame.ids.tolist() == [NO_ID, NO_ID]
    assert np.isnan(frame.residuals_m).all()


def test_before_3_0_the_lists_complete_one_another() -> None:
    markers = labelled((1, (1, 0, 0), SEEN))
    legacy = np.float32([[5, 0, 0], [1, 0, 0.00005]])
    frame = Conversion().frame(FrameOfData(number=1, labelled=markers, unlabelled=legacy), TIMES, {})
    assert frame.ids.tolist() == [1, NO_ID]
    assert frame.points_m[:, 0].tolist() == [1, 5]


def body(position: tuple[float, ...], xyzw: tuple[float, ...], params: int = 1) -> Bodies:
    poses = np.zeros(1, RIGID_BODY)
    poses[0] = (3, position, xyzw, 0.5, params)
    return Bodies(poses)


def rotation(wxyz: np.ndarray) -> np.ndarray:
    w, x, y, z = wxyz
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@pytest.mark.parametrize("axis", UpAxis)
def test_the_world_is_turned_to_y_up(axis: UpAxis) -> None:
    """Up goes to Y, the turn is proper, and bodies turn with the points that belong to them."""
    rng = np.random.default_rng(3)
    basis = np.eye(3, dtype=np.float32)
    markers = labelled(*((i, tuple(row), SEEN) for i, row in enumerate(basis)))
    conversion = Conversion(up_axis=axis)
    turned = conversion.frame(modern(labelled=markers), TIMES, {}).points_m.T
    assert np.array_equal(turned @ basis[axis], [0, 1, 0])
    assert np.linalg.det(turned) == pytest.approx(1.0)

    quaternion = rng.normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    got = conversion.frame(modern(rigid_bodies=body((1, 2, 3), tuple(quaternion))), TIMES, {}).rigid_bodies[0]
    x, y, z, w = quaternion
    before = rotation(np.array([w, x, y, z]))
    assert np.allclose(rotation(got.quaternion_wxyz), turned @ before @ turned.T, atol=1e-6)
    assert np.allclose(got.position_m, turned @ [1, 2, 3])
    still = conversion.frame(modern(rigid_bodies=body((0, 0, 0), (0, 0, 0, 1))), TIMES, {}).rigid_bodies[0]
    assert np.array_equal(still.quaternion_wxyz, [1, 0, 0, 0])


def test_units() -> None:
    markers = labelled((1, (1000, 2000, 0), SEEN))
    frame = Conversion(scale_m=0.001).frame(
        modern(labelled=markers, rigid_bodies=body((500, 0, 0), (0, 0, 0, 1))), TIMES, {}
    )
    assert np.allclose(frame.points_m, [[1, 2, 0]])
    assert frame.residuals_m[0] == pytest.approx(0.00025)
    assert frame.rigid_bodies[0].position_m[0] == pytest.approx(0.5)
    assert frame.rigid_bodies[0].mean_error_m == pytest.approx(0.0005)


@pytest.mark.parametrize("xyzw", [(0, 0, 0, 0), (math.nan, 0, 0, 1), (math.inf, 0, 0, 1)])
def test_a_body_without_a_pose_is_not_tracked(xyzw: tuple[float, ...]) -> None:
    got = Conversion().frame(modern(rigid_bodies=body((1, 2, 3), xyzw)), TIMES, {}).rigid_bodies[0]
    assert not got.tracked
    assert np.array_equal(got.quaternion_wxyz, [1, 0, 0, 0])
    assert np.isfinite(got.position_m).all()


def test_an_untracked_body_says_so() -> None:
    got = Conversion().frame(modern(rigid_bodies=body((1, 2, 3), (0, 0, 0, 1), 0)), TIMES, {}).rigid_bodies[0]
    assert not got.tracked
    assert got.name == "Rigid body 3"


def test_no_points() -> None:
    frame = Conversion().frame(modern(), TIMES, {})
    assert frame.points_m.shape == (0, 3)
    assert frame.ids.shape == frame.residuals_m.shape == (0,)
