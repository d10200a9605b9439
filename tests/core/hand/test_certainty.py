import numpy as np
import pytest

from core.hand.certainty import GUESS_RAD, SURE_RAD, guessed, guesses, joint_std_rad
from core.hand.skeleton import DOF_JOINTS, DOF_NAMES, JOINT_NAMES, JOINT_PARENTS


def stds(**degrees: float) -> np.ndarray:
    """Sure of everything but what is named."""
    std = np.full(26, 1e-3)
    for name, value in degrees.items():
        std[DOF_NAMES.index(name)] = np.radians(value)
    return std


@pytest.mark.parametrize("dof", range(20))
def test_an_angle_makes_its_own_joint_and_all_beyond_it_a_guess_and_no_other(dof: int) -> None:
    std = np.full(26, 1e-3)
    std[6 + dof] = GUESS_RAD
    joint = DOF_JOINTS[dof]
    beyond = {joint}
    for j, parent in enumerate(JOINT_PARENTS):
        if parent in beyond:
            beyond.add(j)
    expected = [float(j in beyond) for j in range(16)]
    assert guessed(std) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("root", [0, 1, 2, 3, 4, 5])
def test_with_the_wrist_everything_is_a_guess(root: int) -> None:
    std = np.full(26, 1e-3)
    std[root] = 0.3
    assert (guessed(std) == 1.0).all()


def test_two_angles_of_a_joint_add_as_variances() -> None:
    std = stds(ring_mcp_flexion=6.0, ring_mcp_abduction=8.0)
    assert np.degrees(joint_std_rad(std)[JOINT_NAMES.index("ring_mcp")]) == pytest.approx(10.0)


def test_the_nearer_joint_counts_where_it_is_less_sure() -> None:
    std = stds(index_mcp_flexion=5.0, index_pip_flexion=4.0, index_dip_flexion=6.0)
    mcp, pip, dip = (guessed(std)[JOINT_NAMES.index(f"index_{name}")] for name in ("mcp", "pip", "dip"))
    assert 0.0 < mcp == pip < dip < 1.0
    alone = guessed(stds(index_dip_flexion=6.0))
    assert alone[JOINT_NAMES.index("index_dip")] == pytest.approx(dip)


def test_it_rises_from_measured_to_guess_without_a_step() -> None:
    levels = np.linspace(0.0, 2 * GUESS_RAD, 400)
    many = np.zeros((400, 26))
    many[:, -1] = levels
    share = guessed(many)[:, 15]
    assert (share[levels <= SURE_RAD] == 0.0).all() and (share[levels >= GUESS_RAD] == 1.0).all()
    assert (np.diff(share) >= 0.0).all() and np.diff(share).max() < 0.02
    assert (guessed(many)[:, :15] == 0.0).all()


def test_unknown_counts_as_sure_and_boundless_as_a_guess() -> None:
    assert (guessed(np.full((3, 26), np.nan)) == 0.0).all()
    std = np.full(26, np.nan)
    std[25] = np.inf
    assert guessed(std).tolist() == [0.0] * 15 + [1.0]


def test_what_it_was_given_stays_as_it_was() -> None:
    std = stds(thumb_ip_flexion=9.0)
    before = std.copy()
    guessed(std)
    assert (std == before).all()


def test_a_guess_is_what_is_more_guessed_than_measured() -> None:
    called = guesses(stds(ring_dip_flexion=5.1, index_dip_flexion=4.9))
    assert [JOINT_NAMES[j] for j in np.flatnonzero(called)] == ["ring_dip"]
