import numpy as np
import pytest
import trimesh

from core.props.mesh import prop_mesh
from core.props.prop import Prop, PropModel
from tests.core.props.things import PEN

MODELS = {
    "cylinder": (PropModel("cylinder", (0.03, 0.2)), np.pi * 0.015**2 * 0.2, (0.03, 0.03, 0.2)),
    "sphere": (PropModel("sphere", (0.07,)), 4.0 / 3.0 * np.pi * 0.035**3, (0.07, 0.07, 0.07)),
    "box": (PropModel("box", (0.1, 0.04, 0.3)), 0.1 * 0.04 * 0.3, (0.1, 0.04, 0.3)),
    "none": (PropModel(), 5 * 4.0 / 3.0 * np.pi * 0.005**3, tuple(np.ptp(PEN.markers_m, axis=0) + 0.01)),
}


@pytest.mark.parametrize("name", MODELS)
def test_a_surface_is_closed_faces_outward_and_has_its_size(name: str) -> None:
    model, volume_m3, extents_m = MODELS[name]
    vertices, normals, faces = prop_mesh(Prop("thing", PEN.markers_m, model))
    mesh = trimesh.Trimesh(vertices, faces)  # joins what lies in one place
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(volume_m3, rel=0.07)
    assert mesh.extents == pytest.approx(extents_m, abs=2e-4)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)
    flat = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    assert (np.einsum("fi,fki->fk", flat, normals[faces]) > 0.0).all()
