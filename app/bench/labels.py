"""Names from one frame alone: the labelling network on real poses with markers hidden and reflections added."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from app.commands.terminal import Progress
from app.label_bench import scales, together
from app.label_bench.clouds import (
    MOST_GHOSTS,
    MOST_HIDDEN,
    Cloud,
    Score,
    Users,
    frames_of,
    path_of,
    perturbed,
    thinned,
)
from app.peers.han2018 import HanNamer
from app.reconstruction.han_shapes import sequences
from core.calibration.hand import calibrate_hand
from core.errors import FormatError
from core.frames import NO_POINT, FloatArray, Side
from core.labelling.clusters import clusters
from core.labelling.network import LabelNetwork, NamedHand
from core.markers.layout import MarkerLayout, load_layout
from core.profile import Profile
from core.takes.formats import read_recording

TESTS = {
    "nothing hidden": (0, 0),
    "hidden": (MOST_HIDDEN, 0),
    "ghosts": (0, MOST_GHOSTS),
    "hidden and ghosts": (MOST_HIDDEN, MOST_GHOSTS),
}
PUBLISHED = {
    19: {"nothing hidden": 97.76, "hidden": 93.51, "ghosts": 95.30, "hidden and ghosts": 85.81},
    13: {"hidden and ghosts": 84.89},
}
"""[%] Han 2018, Table 2, its last network, and Table 6; trained on poses of these same users."""
PUBLISHED_FOUND = {19: (73.95, 64.64, 56.21, 39.77), 13: (60.75, 66.85, 47.29, 54.10)}
"""[%] precision and recall of hidden markers, then of ghosts: Tables 4 and 6, synthetic."""

_SPARSE = "alexanderson13"
_DENSE = "han19"
_GLOVE = "qualisys13"

Namer = Callable[[FloatArray, MarkerLayout, Side | None], NamedHand]
CALIBRATION_FRAMES = 1500
"""Of a user's right hand, from every second sequence."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of this benchmark."""
    parser.add_argument(
        "--data", metavar="DIR", type=Path, required=True, help="folder with han_user1.npz and so on (Han et al. 2018)"
    )
    parser.add_argument("--network", metavar="FILE", type=Path, help="default: the network of Phalanx")
    parser.add_argument("--frames", metavar="N", type=int, default=500, help="per user and test; default %(default)s")
    parser.add_argument("--seeds", metavar="N", type=int, nargs="+", default=[0], help="default %(default)s")
    parser.add_argument(
        "--users", metavar="N", type=int, nargs="+", default=[1, 2, 3, 4], help="whose hands; default all"
    )
    parser.add_argument(
        "--left-out", metavar="DIR", type=Path,
        help="also networks user1.onnx and so on, each trained on the hands of all users but that one",
    )  # fmt: skip
    parser.add_argument(
        "--reference", metavar="FILE", type=Path,
        help="also a network of the architecture of Han 2018 (train labeller --architecture han2018)",
    )  # fmt: skip
    parser.add_argument("--glove", metavar="FILE", type=Path, help="also a labelled recording of the glove qualisys13")
    parser.add_argument(
        "--scales", metavar="S", type=float, nargs="*",
        help="only the table of the same people scaled, by default by " + " ".join(f"{s:g}" for s in scales.SCALES),
    )  # fmt: skip
    parser.add_argument("--together", action="store_true", help="only the table of two hands in one cloud")
    parser.add_argument(
        "--pairs", metavar="N", type=int, default=40, help="clouds of two hands in a row; default %(default)s"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Table 2, and the rows on hidden markers and ghosts of Tables 4 and 6, of Han 2018, side known and side open."""
    dense = load_layout(_DENSE)
    kept = [dense.marker_names.index(name) for name in load_layout(_SPARSE).marker_names]
    users = [frames_of(arguments.data, user, dense) for user in arguments.users]
    figures: dict[str, Any] = {"frames": arguments.frames, "seeds": arguments.seeds, "users": arguments.users}
    layouts, every = (dense, thinned(dense, kept)), (list(range(len(dense.joints))), kept)
    if arguments.scales is not None:
        wanted = arguments.scales or scales.SCALES
        return figures | {"scales": scales.measured(users, layouts, every, wanted, arguments)}
    if arguments.together:
        return figures | {"together": together.measured(users, dense, arguments)}
    network = _network(arguments.network)
    print("Share of a hand's markers that are named right, hidden ones counted as such; frames drawn at random from")
    print(
        f"{len(users)} users, {arguments.frames} each; up to {MOST_HIDDEN} markers hidden, up to {MOST_GHOSTS} ghosts "
        "added. [%]\n"
    )
    for markers, columns in zip(layouts, every, strict=True):
        m = len(markers.joints)
        rows: dict[str, dict[str, float]] = {}
        for test in TESTS if m == len(dense.joints) else ("nothing hidden", "hidden and ghosts"):
            rows[test] = _measured([network] * len(users), [markers] * len(users), columns, users, test, arguments)
        figures[f"{m} markers"] = rows
        _print(m, rows)
    figures["calibrated"] = _with_calibration(network, dense, arguments)
    for name, namers in _others(arguments).items():
        dense_each = [dense] * len(users)
        figures[name] = {test: _measured(namers, dense_each, every[0], users, test, arguments) for test in TESTS}
        _print_other(name, figures[name])
    if arguments.glove is not None:
        figures["glove"] = _glove(network, arguments.glove)
    figures["together"] = together.measured(users, dense, arguments)
    figures["ms_per_cloud"] = _time(network, dense, users[0][0])
    print(f"\n{figures['ms_per_cloud']:.2f} ms for a cloud of 19 points on one thread, median")
    return figures


def _with_calibration(network: Namer, layout: MarkerLayout, arguments: argparse.Namespace) -> dict[str, Any]:
    """Table 2 on every second sequence of each user, by the layout alone, and by where the wizard's calibration finds
    markers on that user's hand in the other sequences."""
    labels: dict[int, tuple[Side, int]] = {k: ("right", k) for k in range(len(layout.joints))}
    every, worn, users = list(range(len(layout.joints))), [], []
    for user in arguments.users:
        used, _ = sequences(path_of(arguments.data, user), CALIBRATION_FRAMES)
        worn.append(calibrate_hand(used, Profile("", layout, ("right",)), labels=labels).profile.worn)
        users.append(frames_of(arguments.data, user, layout, second=True))
    rows: dict[str, Any] = {}
    for name, layouts in (("by the layout alone", [layout] * len(users)), ("markers calibrated", worn)):
        rows[name] = {test: _measured([network] * len(users), layouts, every, users, test, arguments) for test in TESTS}
        _print_other(f"every second sequence, {name}", rows[name])
    return rows


def _measured(
    namers: Sequence[Namer], layouts: Sequence[MarkerLayout], columns: list[int], users: Users, test: str,
    arguments: argparse.Namespace,
) -> dict[str, float]:  # fmt: skip
    """Figures with the side known; "labels_open" and "sides" with the side left open. namers, layouts: one per user."""
    known, left_open, by_user = Score(), Score(), [Score() for _ in users]
    progress = Progress(f"{len(columns)} markers, {test}")
    for u, ((points, sides), network, layout) in enumerate(zip(users, namers, layouts, strict=True)):
        for seed in arguments.seeds:
            random = np.random.default_rng([seed, arguments.users[u], list(TESTS).index(test), len(columns)])
            for cloud in perturbed(random, points[:, columns], sides, arguments.frames, *TESTS[test]):
                hand = network(cloud.points_m, layout, cloud.side)
                known.add(cloud, hand)
                by_user[u].add(cloud, hand)
                left_open.add(cloud, network(cloud.points_m, layout, None))
        progress((u + 1) / len(users))
    progress.done()
    figures = known.figures()
    return {
        **figures,
        "labels_open": left_open.figures()["labels"],
        "sides": left_open.figures()["sides"],
        "worst_user": min(score.figures()["labels"] for score in by_user),
    }


def _print(m: int, rows: dict[str, dict[str, float]]) -> None:
    print(
        f"{m} markers".ljust(20)
        + "labels   Han 2018   worst user   side open   left or right   frames whole   confidence said"
    )
    for test, row in rows.items():
        published = PUBLISHED[m].get(test)
        shown = "     -  " if published is None else f"{published:8.2f}"
        worst, left_open, sides, frames, said = (
            100.0 * row[name] for name in ("worst_user", "labels_open", "sides", "frames", "confidence")
        )
        print(
            f"  {test:18}{100 * row['labels']:6.2f}   {shown}   {worst:10.2f}   {left_open:9.2f}   {sides:13.2f}   "
            f"{frames:12.2f}   {said:15.2f}"
        )
    _print_found(m, rows["hidden and ghosts"])


def _print_found(m: int, row: dict[str, float]) -> None:
    """What of hidden markers and of ghosts is found."""
    names = ("hidden_precision", "hidden_recall", "ghost_precision", "ghost_recall")
    print("  with hidden and ghosts: " + "; ".join(
        f"{name.replace('_', ' ')} {100 * row[name]:.2f} (Han 2018: {published:.2f})"
        for name, published in zip(names, PUBLISHED_FOUND[m], strict=True)
    ))  # fmt: skip


def _others(arguments: argparse.Namespace) -> dict[str, list[Namer]]:
    """What else is to be measured: one namer per user."""
    others: dict[str, list[Namer]] = {}
    if arguments.left_out is not None:
        paths = [arguments.left_out / f"user{user}.onnx" for user in arguments.users]
        others["trained on the other users"] = [LabelNetwork(path).name for path in paths]
    if arguments.reference is not None:
        others["architecture of Han 2018"] = [HanNamer(arguments.reference).name] * len(arguments.users)
    return others


def _print_other(name: str, rows: dict[str, dict[str, float]]) -> None:
    print(f"\n{name}, 19 markers".ljust(51) + "labels   Han 2018   worst user   frames whole")
    for test, row in rows.items():
        labels, worst, frames = (100.0 * row[key] for key in ("labels", "worst_user", "frames"))
        print(f"  {test:47}{labels:6.2f}   {PUBLISHED[19][test]:8.2f}   {worst:10.2f}   {frames:12.2f}")
    _print_found(19, rows["hidden and ghosts"])


def _glove(network: Namer, path: Path) -> dict[str, float]:
    """Every tenth frame of a real recording, its own gaps, each frame alone: with its hand's markers, and with
    all that are in the room."""
    recording, layout = read_recording(path), load_layout(_GLOVE)
    missing = [name for name in layout.marker_names if name not in recording.labels]
    if missing:
        raise FormatError(f"{path.name} has no marker {missing[0]!r}.", f"Give a recording of the glove {_GLOVE}.")
    own = [recording.labels.index(name) for name in layout.marker_names]
    room = [column for column in range(len(recording.labels)) if column not in own]
    figures = {}
    for name, columns in (("hand", own), ("room", own + room)):
        score = Score()
        for frame in recording.points_m[::10, columns]:
            seen = np.isfinite(frame[:, 0])
            point = np.where(seen, np.cumsum(seen) - 1, NO_POINT)[: len(own)]
            cloud = Cloud(frame[seen], point, "right")
            score.add(cloud, _found(network, cloud.points_m, layout))
        figures[name] = score.figures()["labels"]
    print(
        f"\n{path.name}: {100 * figures['hand']:.2f} with the hand's markers alone, {100 * figures['room']:.2f} "
        f"with the {len(room)} others of the room"
    )
    return figures


def _found(network: Namer, points_m: FloatArray, layout: MarkerLayout) -> NamedHand:
    """The right hand of the cluster that the network names most surely, in terms of all points."""
    best = NamedHand("right", *(np.full(len(layout.joints), value) for value in (NO_POINT, 0.0, 1.0)))
    for group in clusters(points_m, len(layout.joints)):
        hand = network(points_m[group], layout, "right")
        if hand.certainty > best.certainty:
            best = replace(hand, point=np.where(hand.point == NO_POINT, NO_POINT, group[hand.point]))
    return best


def _network(path: Path | None) -> Namer:
    """The network of a file as a function of points, layout and side."""
    return LabelNetwork(path).name


def _time(network: Namer, layout: MarkerLayout, points_m: FloatArray, count: int = 300) -> float:
    """[ms] median of naming one cloud, everything counted."""
    spent = []
    for frame in points_m[:count]:
        began = time.perf_counter()
        network(frame, layout, "right")
        spent.append(time.perf_counter() - began)
    return 1e3 * float(np.median(spent))
