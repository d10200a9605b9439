import numpy as np
import pygltflib
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from core.errors import ExportError
from core.hand.mirror import mirror_points, skin_hand
from core.hand.skeleton import JOINT_NAMES, JOINT_PARENTS, TIP_JOINTS, TIP_NAMES
from core.takes.export import export, gltf
from tests.core.export.recordings import START_S, hands_of, scaled_hand, solution

DTYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path, held = export(solution(), ["gltf"], tmp_path_factory.mktemp("gltf"))
    assert held.name == "take 1_held.csv"
    return path


@pytest.fixture(scope="module")
def file(written):
    return pygltflib.GLTF2().load(str(written))


def values(file, accessor):
    a = file.accessors[accessor]
    view = file.bufferViews[a.bufferView]
    width = WIDTHS[a.type]
    data = np.frombuffer(
        file.binary_blob(), DTYPES[a.componentType], a.count * width, view.byteOffset + (a.byteOffset or 0)
    )
    return data.reshape(a.count, width).astype(float)


class Player:
    """The animation evaluated from pygltflib's document at the keys."""

    def __init__(self, file):
        self.file = file
        (animation,) = file.animations
        self.tracks = {
            (c.target.node, c.target.path): values(file, animation.samplers[c.sampler].output)
            for c in animation.channels
        }
        self.times = values(file, animation.samplers[0].input)[:, 0]
        self.parents = {child: i for i, node in enumerate(file.nodes) for child in node.children or []}

    def world(self, node, key):
        n = self.file.nodes[node]

        def value(name, default):
            still = getattr(n, name)
            return self.tracks[node, name][key] if (node, name) in self.tracks else np.array(still or default, float)

        matrix = np.eye(4)
        matrix[:3, :3] = Rotation.from_quat(value("rotation", [0, 0, 0, 1])).as_matrix() @ np.diag(
            value("scale", [1, 1, 1])
        )
        matrix[:3, 3] = value("translation", [0, 0, 0])
        return self.world(self.parents[node], key) @ matrix if node in self.parents else matrix

    def skinned(self, mesh_node, key):
        node = self.file.nodes[mesh_node]
        skin = self.file.skins[node.skin]
        inverse = values(self.file, skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
        matrices = np.array([self.world(joint, key) for joint in skin.joints]) @ inverse
        attributes = self.file.meshes[node.mesh].primitives[0].attributes
        vertices = np.c_[
            values(self.file, attributes.POSITION), np.ones(self.file.accessors[attributes.POSITION].count)
        ]
        joints, weights = values(self.file, attributes.JOINTS_0).astype(int), values(self.file, attributes.WEIGHTS_0)
        return np.einsum("vk,vkij,vj->vi", weights, matrices[joints], vertices)[:, :3]


def mesh_nodes(file):
    return [i for i, node in enumerate(file.nodes) if node.mesh is not None]


def test_document(file):
    assert file.asset.version == "2.0"
    assert [node.name for node in file.nodes if node.mesh is not None] == ["left surface", "right surface"]
    roots = file.scenes[file.scene].nodes
    assert [file.nodes[i].name for i in roots] == ["left hand", "left surface", "right hand", "right surface"]
    for skin, side in zip(file.skins, ("left", "right"), strict=True):
        assert file.nodes[skin.skeleton].name == f"{side} hand"
        assert file.nodes[skin.skeleton].children == [skin.joints[0]]
    for skin, side in zip(file.skins, "LR", strict=True):
        assert [file.nodes[joint].name for joint in skin.joints] == [
            f"{side}_{name}" for name in JOINT_NAMES + TIP_NAMES
        ]
        children = {file.nodes[j].name: [file.nodes[c].name for c in file.nodes[j].children or []] for j in skin.joints}
        for joint, parent in enumerate(JOINT_PARENTS):
            assert joint == 0 or f"{side}_{JOINT_NAMES[joint]}" in children[f"{side}_{JOINT_NAMES[parent]}"]
        for tip, joint in zip(TIP_NAMES, TIP_JOINTS, strict=True):
            assert children[f"{side}_{JOINT_NAMES[joint]}"] == [f"{side}_{tip}"]
            assert children[f"{side}_{tip}"] == []
    assert {sampler.interpolation for sampler in file.animations[0].samplers} == {"LINEAR"}
    for view in file.bufferViews:
        assert view.byteOffset % 4 == 0
        assert view.byteOffset + view.byteLength <= file.buffers[0].byteLength
    for accessor, described in enumerate(file.accessors):
        if described.min:
            assert np.array_equal(values(file, accessor).min(axis=0), described.min)
            assert np.array_equal(values(file, accessor).max(axis=0), described.max)


def test_keys_are_at_the_frames_own_times(file):
    player = Player(file)
    expected = [frame.times.host_s - START_S for frame in solution().solved]
    assert np.allclose(player.times, expected, atol=1e-6)
    assert np.all(np.diff(player.times) > 0)


@pytest.mark.parametrize("side", ["left", "right"])
def test_every_joint_in_every_tracked_frame(file, side):
    player = Player(file)
    skin = file.skins[0 if side == "left" else 1]
    count = 0
    for key, hand in enumerate(hands_of(solution(), side)):
        if hand.state.value != "tracked":
            continue
        count += 1
        world = np.array([player.world(joint, key) for joint in skin.joints])
        model, last = scaled_hand(hand).skeleton, list(TIP_JOINTS)
        beyond = model.tip_positions_m - model.joint_positions_m[last]
        beyond = mirror_points(beyond) if side == "left" else beyond
        tips = hand.joints_world[last, :3, 3] + np.einsum("dab,db->da", hand.joints_world[last, :3, :3], beyond)
        assert np.abs(world[16:, :3, 3] - tips).max() < 1e-6
        world = world[:16]
        assert np.abs(world[:, :3, 3] - hand.joints_world[:, :3, 3]).max() < 1e-6
        size = np.cbrt(np.linalg.det(world[:, :3, :3]))  # positive: no joint is mirrored
        assert np.abs(world[:, :3, :3] / size[:, None, None] - hand.joints_world[:, :3, :3]).max() < 1e-6
    assert count == (198 if side == "left" else 238)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("key", [10, 15, 25, 120, 237])
def test_the_skin_is_the_engines_surface(file, side, key):
    player = Player(file)
    hand = hands_of(solution(), side)[key]
    node = mesh_nodes(file)[0 if side == "left" else 1]
    expected = skin_hand(scaled_hand(hand), side, hand.joints_world)
    assert np.abs(player.skinned(node, key) - expected).max() < 1e-6


def test_a_lost_hand_holds_its_last_pose(file):
    player = Player(file)
    wrist = file.skins[0].joints[0]
    last = hands_of(solution(), "left")[29]
    for key in range(30, 60):
        assert np.abs(player.world(wrist, key)[:3, 3] - last.joints_world[0, :3, 3]).max() < 1e-6


@pytest.mark.parametrize("index", [0, 1])
def test_surfaces_face_outward_posed_and_at_rest(file, index):
    player = Player(file)
    node = mesh_nodes(file)[index]
    primitive = file.meshes[file.nodes[node].mesh].primitives[0]
    faces = values(file, primitive.indices).astype(int).reshape(-1, 3)
    rest = values(file, primitive.attributes.POSITION)
    normals = values(file, primitive.attributes.NORMAL)
    for vertices in (rest, player.skinned(node, 200)):
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        assert mesh.is_watertight and mesh.is_winding_consistent
        assert 1e-4 < mesh.volume < 1e-3  # a hand holds some 0.35 litres
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)
    theirs = trimesh.Trimesh(rest, faces, process=False).vertex_normals
    assert np.einsum("vi,vi->v", normals, theirs).min() > 0.7
    thumb = file.skins[index].joints[3]
    assert np.sign(values(file, file.skins[index].inverseBindMatrices)[3, 12]) == (1 if index else -1)
    assert file.nodes[thumb].name.endswith("thumb_ip")


def test_weights_and_joints_are_sound(file):
    assert len(file.meshes) == 2
    for mesh in file.meshes:
        attributes = mesh.primitives[0].attributes
        weights, joints = values(file, attributes.WEIGHTS_0), values(file, attributes.JOINTS_0)
        assert np.allclose(weights.sum(axis=1), 1.0, atol=1e-6) and weights.min() >= 0.0
        assert joints.max() == 15 and not joints[weights == 0.0].any()


def test_rotations_are_unit_and_never_jump(file):
    rotations = [track for (_, path), track in Player(file).tracks.items() if path == "rotation"]
    assert len(rotations) == 2 * 16
    for track in rotations:
        assert np.allclose(np.linalg.norm(track, axis=1), 1.0, atol=1e-6)
        assert np.einsum("ti,ti->t", track[1:], track[:-1]).min() > 0.9


def test_other_programs_open_it(written):
    scene = trimesh.load(str(written))
    assert len(scene.geometry) == 2


def test_a_file_that_differs_is_named(tmp_path, monkeypatch):
    honest = gltf._tracks

    def wrong(motion):
        tracks = honest(motion)
        joint, path, track = tracks[-1]
        turned = track.copy()
        turned[77] = (1.0, 0.0, 0.0, 0.0)
        return [*tracks[:-1], (joint, path, turned)]

    monkeypatch.setattr(gltf, "_tracks", wrong)
    with pytest.raises(ExportError, match=r"take 1\.glb did not read back equal: frame 78, L_pinky_tip"):
        export(solution(), ["gltf"], tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_file_cut_short_is_named(tmp_path, monkeypatch):
    honest = gltf._check

    def cut(path, *rest):
        path.write_bytes(path.read_bytes()[:-100])
        honest(path, *rest)

    monkeypatch.setattr(gltf, "_check", cut)
    with pytest.raises(ExportError, match="its header is not that of"):
        export(solution(), ["gltf"], tmp_path)
