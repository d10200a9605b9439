"""Networks that are none, ask for what none does, or answer what cannot be: refused when they are loaded."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from core.errors import FormatError
from core.labelling.network import OUTPUTS, LabelNetwork
from core.untrusted.onnx_graph import MOST_BYTES, MOST_FIELDS, check_graph
from tests.core.untrusted.onnx_bytes import axis, labeller, node, part, varint, whole
from tests.data import ROOT

SHIPPED = (ROOT / "resources" / "networks" / "labeller.onnx").read_bytes()


def refused(tmp_path: Path, content: bytes, told: str) -> FormatError:
    path = tmp_path / "own.onnx"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=told) as raised:
        LabelNetwork(path)
    assert "own.onnx" in raised.value.what and raised.value.action
    return raised.value


def answers(name: str) -> bytes:
    return b"".join(node("Identity", [name], output) for output in OUTPUTS)


def tensor(number: int) -> bytes:
    """A tensor that says where else its numbers lie."""
    return part(number, part(8, "w") + part(13, part(1, "location") + part(2, "../../etc/passwd")))


NUMBER = whole(1, 1) + whole(2, 1) + part(8, "v") + part(9, bytes(4))
PLACE = whole(1, 1) + whole(2, 7) + part(8, "i") + part(9, bytes(8))
SPARSE = part(1, NUMBER) + part(2, PLACE) + part(3, varint(1 << 28))
"""One number among 2 to the 28: a gigabyte once it is unpacked."""


@pytest.mark.parametrize(
    ("nodes", "told"),
    [
        (node("RunShell", ["points_m"], "x", domain="evil"), "asks for the operation 'evil.RunShell'"),
        (node("ConstantOfShape", ["points_m"], "x"), "'ConstantOfShape'"),
        (node("Loop", ["points_m"], "x"), "'Loop'"),
        (node("Add", ["points_m"], "x", part(5, part(6, b""))), "networks within a network"),
        (node("Constant", [], "x", part(5, tensor(5))), "keeps its numbers in another file"),
        (tensor(5), "keeps its numbers in another file"),
        (part(5, whole(14, 1)), "keeps its numbers in another file"),
        (part(15, b""), "in a way that is not read"),
        (node("Constant", [], "x", part(5, part(1, "sparse_value") + part(22, SPARSE))), "in a way that is not read"),
        (node("Constant", [], "x", part(5, part(23, SPARSE))), "in a way that is not read"),
    ],
)
def test_what_no_network_of_ours_asks_for(tmp_path: Path, nodes: bytes, told: str) -> None:
    refused(tmp_path, labeller(nodes + answers("points_m")), told)


def test_what_an_encoder_asks_for_is_looked_at_too(tmp_path: Path) -> None:
    within = node("RunShell", ["markers"], "x", domain="evil")
    refused(tmp_path, labeller(answers("points_m"), within), "asks for the operation 'evil.RunShell'")
    refused(tmp_path, labeller(answers("points_m")).replace(b"encoder", b"another"), "is no network that can be run")


@pytest.mark.parametrize("content", [b"", b"\xff" * 50, b"\x3a\xff\xff\xff\xff\x7f", SHIPPED[:5000], b"\x08" * 7])
def test_what_is_no_network(tmp_path: Path, content: bytes) -> None:
    refused(tmp_path, content, "own.onnx")


def test_a_file_larger_than_any_network(tmp_path: Path) -> None:
    path = tmp_path / "own.onnx"
    with path.open("wb") as sparse:
        sparse.truncate(1 << 40)
    with pytest.raises(FormatError, match="more than the"):
        LabelNetwork(path)
    with pytest.raises(FormatError, match="at most are read"):
        check_graph(bytes(MOST_BYTES + 1), "It", "")


@pytest.mark.parametrize(
    "content",
    [whole(2, 0) * MOST_FIELDS, part(7, node("Add", ["x"], "x") * (MOST_FIELDS // 4))],
    ids=["fields", "nodes"],
)
def test_a_file_of_more_parts_than_any_network(content: bytes) -> None:
    """To go through 64 MB of them, or to load them, would take half a minute."""
    with pytest.raises(FormatError, match="has more than 262,144 parts"):
        check_graph(content + whole(2, 0), "It", "")


def test_a_network_that_answers_what_is_no_number_is_refused(tmp_path: Path) -> None:
    minus = node("Neg", ["points_m"], "minus") + node("Exp", ["minus"], "e") + node("Log", ["minus"], "n")
    refused(tmp_path, labeller(minus + answers("n")), "answers with numbers that are none")


def test_a_network_whose_weights_are_spoilt_is_refused(tmp_path: Path) -> None:
    """As a disk spoils one: all it needs is there, and some of its numbers are none."""
    spoilt = bytearray(SHIPPED)
    middle = len(SHIPPED) // 2
    spoilt[middle : middle + 2000] = b"\x00\x7e" * 1000  # NaN in half precision
    refused(tmp_path, bytes(spoilt), "own.onnx")


def test_a_network_of_other_answers_is_refused(tmp_path: Path) -> None:
    error = refused(tmp_path, labeller(answers("points_m")), "answers with shapes")
    assert "(96, 20)" in error.what


def test_a_network_that_doubles_without_end_is_stopped(tmp_path: Path) -> None:
    """2 to the 40 times its points: stopped within the memory that a trial has, and the process goes on."""
    nodes = node("Concat", ["points_m"] * 2, "x0", axis(2))
    for k in range(40):
        nodes += node("Concat", [f"x{k}"] * 2, f"x{k + 1}", axis(2))
    path = tmp_path / "own.onnx"
    path.write_bytes(labeller(nodes + answers("x40")))
    code = (
        "import resource, sys\n"
        "from pathlib import Path\n"
        "from core.errors import FormatError\n"
        "from core.labelling.network import LabelNetwork\n"
        "for _ in range(3):\n"
        "    try:\n"
        "        LabelNetwork(Path(sys.argv[1]))\n"
        "    except FormatError as error:\n"
        "        print(error)\n"
        "LabelNetwork(Path('resources/networks/labeller.onnx'))\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, path], cwd=ROOT, capture_output=True, text=True, timeout=240, check=False
    )
    assert done.returncode == 0, done.stderr
    *said, most_mb = done.stdout.splitlines()
    assert len(said) == 3 and all("cannot be run on the points of a hand" in line for line in said)
    assert float(most_mb) < 700.0


def test_the_network_of_phalanx_passes_its_trial(tmp_path: Path) -> None:
    path = tmp_path / "own.onnx"
    path.write_bytes(SHIPPED)
    assert LabelNetwork(path).about == LabelNetwork().about
