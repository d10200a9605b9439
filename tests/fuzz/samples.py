"""Sound files and packets of every kind, small, made by the project's own writers or kept in tests/golden."""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path

import numpy as np

from app import settings as setting_names
from core.hand.model import template
from core.hand.skeleton import DIGIT_DOF_NAMES
from core.markers.layout import load_layout
from core.motion.subspace import shipped_subspace, subspace_names
from core.profile import load_profile
from core.props.prop import props_from
from core.takes.export import export
from core.takes.take import Mark, TakeCounts, TakeInfo
from core.takes.writer import TakeWriter
from devices.natnet import protocol
from devices.natnet.frames import encode_frame
from devices.natnet.models import encode_models
from devices.natnet.protocol import Message, Sender, ServerInfo
from tests.core.export.recordings import solution
from tests.core.formats import test_motive_csv, test_points_csv, test_qualisys_tsv, test_trc, test_wide_csv
from tests.core.formats.c3d_bytes import build, trial
from tests.core.hand.imports.files import dense, mano_arrays, posed_points, write_webxr
from tests.core.takes import several
from tests.core.takes.frames import plain_frame, tracked_frame
from tests.data import CASES, DATA, ROOT
from tests.devices.natnet.test_versions import VERSIONS, random_frame, random_models
from tests.fuzz.containers import conversation_of

GOLDEN = ROOT / "tests" / "golden"
_LARGEST_BYTES = 300_000
"""Of files that are taken along from the recordings that are not part of the project."""


def _along(folder: Path, pattern: str) -> list[bytes]:
    """What lies in a folder, if it is there and small."""
    return [path.read_bytes() for path in sorted(folder.glob(pattern)) if path.stat().st_size <= _LARGEST_BYTES]


def _made(write: Callable[[Path], object], name: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / name)
        return (Path(folder) / name).read_bytes()


def _exported(name: str) -> list[bytes]:
    """Our own export, as an operator would open it again."""
    with tempfile.TemporaryDirectory() as folder:
        made = export(solution(n_frames=12, lost=(5, 6), untracked=(8, 9)), [name], Path(folder))
        return [path.read_bytes() for path in made if path.suffix == f".{name}"]


def trc() -> list[bytes]:
    plain = (test_trc.HEADER.format(unit="mm", a="Tip", b="Back") + test_trc.ROWS).encode()
    return [plain, *_exported("trc"), *_along(DATA / "public" / "opensim", "*.trc")]


def c3d() -> list[bytes]:
    points = np.random.default_rng(2).uniform(-900, 900, (6, 3, 3))
    made = [build(processor, scale, points, analog=2) for processor in (84, 85, 86) for scale in (-0.1, 0.1)]
    made.append(build(84, -0.1, points, {"TRIAL": trial(84, 3, 8)}))
    return [*made, *_exported("c3d"), *_along(DATA / "public" / "ezc3d", "*.c3d")]


def qualisys_tsv() -> list[bytes]:
    rows = "".join(f"{i}\t{i / 100}\t1\t2\t3\t4\t5\t{i}\n" for i in range(1, 9))
    return [(test_qualisys_tsv.HEADER + test_qualisys_tsv.TITLES + rows).encode()]


def motive_csv() -> list[bytes]:
    rows = [[i, i / 120, 1, 2, 3, 4, 5, 6] for i in range(8)]
    return [test_motive_csv.table(test_motive_csv.MARKERS, rows, parent).encode() for parent in (False, True)]


def wide_csv() -> list[bytes]:
    titles = ",".join(["Frame", "Time", *test_wide_csv.AXES])
    return [f"{titles}\n{test_wide_csv.rows(test_wide_csv.COUNTED)}".encode(), test_wide_csv.VICON.encode()]


def points_csv() -> list[bytes]:
    rows = "".join(f"{i},{i / 100},{k},1,2,{k}\n" for i in range(6) for k in range(4))
    return [(test_points_csv.HEADER + rows).encode()]


def bvh() -> list[bytes]:
    return [*_exported("bvh"), *_along(DATA / "neuron", "*.bvh")]


def recordings() -> list[bytes]:
    """One of each text format, to be told apart by what they hold."""
    return [made()[0] for made in (trc, qualisys_tsv, motive_csv, wide_csv, points_csv)]


def _take(sealed: bool) -> Callable[[Path], object]:
    def write(path: Path) -> None:
        created = datetime(2025, 3, 14, 15, 9, 26, tzinfo=UTC)
        writer = TakeWriter(path, TakeInfo("t", "Åsa", created, 120.0, {"kind": "natnet"}), load_profile("schroeder6"))
        random = np.random.default_rng(3)
        for i in range(12):
            writer.raw("", plain_frame(i))
            writer.solved(tracked_frame(random, 1))
        writer.mark(Mark(0.05, "here"))
        writer.seal(TakeCounts(12, 12, solved=12, length_s=0.1, first_s=0.0)) if sealed else writer.close()

    return write


def _take_of_several(sealed: bool) -> Callable[[Path], object]:
    return lambda path: several.record(path, 12, sealed)


def takes() -> list[bytes]:
    made = [_made(take(sealed), "take.mcap") for sealed in (True, False) for take in (_take, _take_of_several)]
    return [*made, *_along(GOLDEN / "takes", "*.mcap"), *_along(CASES / "faults", "*.mcap")]


def layouts() -> list[bytes]:
    return [json.dumps(load_layout(name).to_dict()).encode() for name in ("schroeder6", "han19")]


PROP = {
    "format": "phalanx-prop", "version": 1, "name": "pen", "markers_m": [[0, 0, 0], [0.1, 0, 0], [0, 0.06, 0.02]],
    "model": {"shape": "cylinder", "size_m": [0.01, 0.14]},
}  # fmt: skip


def props() -> list[bytes]:
    made = [json.dumps(prop.to_dict()).encode() for prop in props_from([PROP], "sample")]
    return [*made, *_along(CASES / "faults", "*prop*.json")]


def profiles() -> list[bytes]:
    shipped = [load_profile(name).to_json().encode() for name in ("schroeder6", "han19")]
    return [*shipped, *layouts()[:1], *_along(CASES / "faults", "*profile*.json")]


def subspaces() -> list[bytes]:
    return [json.dumps(shipped_subspace(subspace_names()[0]).to_dict()).encode()]


def settings() -> list[bytes]:
    names = [value for key, value in vars(setting_names).items() if key.isupper() and isinstance(value, str)]
    values = [True, 3, 0.5, "text", ["a", "b"], {"a": 1}, None]
    return [json.dumps({name: values[i % len(values)] for i, name in enumerate(names)}).encode()]


def _npz(arrays: dict[str, np.ndarray]) -> bytes:
    made = io.BytesIO()
    np.savez_compressed(made, **arrays)
    return made.getvalue()


def labelled() -> list[bytes]:
    names = np.array(load_layout("han19").marker_names)
    points = np.random.default_rng(1).normal(size=(4, len(names), 3)).astype(np.float32)
    made = _npz({"points": points, "hand": np.array([0, 1, 1, 0]), "marker_names": names})
    return [made, made, made, *_along(CASES / "faults", "*labelled*.npz")]


def mano() -> list[bytes]:
    hand = template()
    joints, _, vertices = posed_points(hand, np.zeros(26))
    return [_npz(mano_arrays(vertices, hand.faces, dense(hand), joints[:, :3, 3]))]


def gltf_hands() -> list[bytes]:
    return [_made(lambda path: write_webxr(path, template(), np.zeros(26)), "hand.glb")]


def networks() -> list[bytes]:
    shipped = (files("resources") / "networks" / "labeller.onnx").read_bytes()
    return [shipped] * 4 + _along(CASES / "faults", "*.onnx")


def angles() -> list[bytes]:
    rows = "".join(f"{name},{i},{i + 0.5}\n" for i, name in enumerate(DIGIT_DOF_NAMES))
    return [f"angle,left_degrees,right_degrees\n{rows}".encode(), b"angle,degrees\nindex_pip_flexion,12\n"]


def file_lists() -> list[bytes]:
    return [b"# takes of today\n/dev/null\ncase*.txt\nnone of this name.mcap\n"]


def left_runs() -> list[bytes]:
    lines = [
        "Phalanx 0.1.0, the window", "begun: 2025-03-14T15:09:26", "process: 1", "recording: /tmp/none/a.mcap",
        "sealed: /tmp/none/a.mcap", "recording: /tmp/none/Åsa.mcap", "Fatal Python error: Segmentation fault",
    ]  # fmt: skip
    return ["\n".join(lines).encode()]


def run_records() -> list[bytes]:
    record = {"format": "phalanx-run", "version": 1, "files": {"markers.csv": {"bytes": 12, "sha256": "0" * 64}}}
    return [json.dumps(record).encode()]


def export_records() -> list[bytes]:
    return [json.dumps({"program": "Phalanx", "files": [{"file": "a.trc", "sha256": "0" * 64}]}).encode()]


def _packets() -> list[bytes]:
    """Every message of a server: frames of every version and what it answers."""
    made = [protocol.pack(Message.FRAMEOFDATA, encode_frame(random_frame(version), version)) for version in VERSIONS]
    made += [protocol.pack(Message.MODELDEF, encode_models(random_models(version), version)) for version in VERSIONS]
    for version in ((2, 9), (3, 0), (4, 1)):
        sender = Sender("Motive", (3, 1, 0, 0), (*version, 0, 0))
        made.append(
            protocol.pack(Message.SERVERINFO, ServerInfo(sender, 10_000_000, 1511, False, "239.0.0.1").encode())
        )
    made += [
        protocol.pack(Message.RESPONSE, answer)
        for answer in (protocol.encode_float(100.0), protocol.encode_int(1), b"Bitstream,4.1.0.0\0")
    ]
    made.append(protocol.pack(Message.ECHORESPONSE, protocol.encode_echo_response(1, 2)))
    made.append(protocol.pack(Message.ECHOREQUEST, protocol.encode_echo_request(1)))
    made.append(protocol.pack(Message.REQUEST, protocol.encode_request("FrameRate")))
    made.append(protocol.pack(Message.CONNECT, protocol.Connect(Sender("us", (1, 0, 0, 0), (4, 1, 0, 0))).encode()))
    return made


def packets() -> list[bytes]:
    return [*_packets(), *_along(GOLDEN / "natnet", "*.bin")]


def conversations() -> list[bytes]:
    """What a server of 4.1 sends while frames are wanted, among it what changes its mind."""
    frames = [random_frame((4, 1), seed) for seed in range(6)]
    stream = [protocol.pack(Message.FRAMEOFDATA, encode_frame(frame, (4, 1))) for frame in frames]
    others: Sequence[bytes] = _packets()[2 * len(VERSIONS) :]
    return [
        conversation_of([packet for pair in zip(stream, others, strict=False) for packet in pair]),
        conversation_of(stream),
    ]
