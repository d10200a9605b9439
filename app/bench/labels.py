"""Names from one frame alone: the labelling network on real poses with markers hidden and reflections added."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from app.commands.terminal import Progress
from app.peers.han2018 import HanNamer
from app.reconstruction.han_shapes import sequences
from core.calibration.hand import calibrate_hand
from core.errors import FormatError
from core.frames import NO_POINT, FloatArray, IntArray, Side
from core.labelling.clusters import clusters
from core.labelling.network import LabelNetwork, NamedHand
from core.markers.layout import MarkerLayout, load_layout
from core.profile import Profile
from core.takes.formats import read_recording

MOST_HIDDEN, MOST_GHOSTS = 5, 2
MARGIN = 0.1
"""Ghosts lie anywhere in the box of the hand's markers, which is larger than they are by this share on every side."""

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
Users = Sequence[tuple[FloatArray, IntArray]]
CALIBRATION_FRAMES = 1500
"""Of a user's right hand, from every second sequence."""


@dataclass(frozen=True)
class Cloud:
    """points_m: (n, 3) [m] in random order. point: (m,), the true index of each marker, NO_POINT if it is hidden."""

    points_m: FloatArray
    point: IntArray
    side: Side


@dataclass
class Score:
    """Sums over clouds, of all markers of the layout and all points."""

    labels: int = 0
    right: int = 0
    frames: int = 0
    frames_right: int = 0
    hidden: int = 0
    hidden_said: int = 0
    hidden_right: int = 0
    ghosts: int = 0
    ghosts_said: int = 0
    ghosts_right: int = 0
    sides_right: int = 0
    confidence: float = 0.0

    def add(self, cloud: Cloud, hand: NamedHand) -> None:
        """One cloud, and what was made of it."""
        good = hand.point == cloud.point
        self.labels += len(good)
        self.right += int(good.sum())
        self.frames += 1
        self.frames_right += bool(good.all())
        lost, said = cloud.point == NO_POINT, hand.point == NO_POINT
        self.hidden += int(lost.sum())
        self.hidden_said += int(said.sum())
        self.hidden_right += int((lost & said).sum())
        rows = np.arange(len(cloud.points_m))
        ghosts, left = ~np.isin(rows, cloud.point), ~np.isin(rows, hand.point)
        self.ghosts += int(ghosts.sum())
        self.ghosts_said += int(left.sum())
        self.ghosts_right += int((ghosts & left).sum())
        self.sides_right += hand.side == cloud.side
        self.confidence += float(hand.confidence.sum())

    def figures(self) -> dict[str, float]:
        """Shares, 0..1, NaN where there is nothing to share."""
        return {
            "labels": _share(self.right, self.labels),
            "frames": _share(self.frames_right, self.frames),
            "hidden_precision": _share(self.hidden_right, self.hidden_said),
            "hidden_recall": _share(self.hidden_right, self.hidden),
            "ghost_precision": _share(self.ghosts_right, self.ghosts_said),
            "ghost_recall": _share(self.ghosts_right, self.ghosts),
            "sides": _share(self.sides_right, self.frames),
            "confidence": _share(self.confidence, self.labels),
        }


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


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Table 2, and the rows on hidden markers and ghosts of Tables 4 and 6, of Han 2018, side known and side open."""
    network = _network(arguments.network)
    dense = load_layout(_DENSE)
    kept = [dense.marker_names.index(name) for name in load_layout(_SPARSE).marker_names]
    users = [_frames(arguments.data, user, dense) for user in arguments.users]
    figures: dict[str, Any] = {"frames": arguments.frames, "seeds": arguments.seeds, "users": arguments.users}
    print("Share of a hand's markers that are named right, hidden ones counted as such; frames drawn at random from")
    print(
        f"{len(users)} users, {arguments.frames} each; up to {MOST_HIDDEN} markers hidden, up to {MOST_GHOSTS} ghosts "
        "added. [%]\n"
    )
    for markers in (dense, _thinned(dense, kept)):
        m = len(markers.joints)
        columns = kept if m < len(dense.joints) else list(range(m))
        rows: dict[str, dict[str, float]] = {}
        for test in TESTS if m == len(dense.joints) else ("nothing hidden", "hidden and ghosts"):
            rows[test] = _measured([network] * len(users), [markers] * len(users), columns, users, test, arguments)
        figures[f"{m} markers"] = rows
        _print(m, rows)
    figures["calibrated"] = _with_calibration(network, dense, arguments)
    for name, namers in _others(arguments).items():
        every = list(range(len(dense.joints)))
        layouts = [dense] * len(users)
        figures[name] = {test: _measured(namers, layouts, every, users, test, arguments) for test in TESTS}
        _print_other(name, figures[name])
    if arguments.glove is not None:
        figures["glove"] = _glove(network, arguments.glove)
    figures["ms_per_cloud"] = _time(network, dense, users[0][0])
    print(f"\n{figures['ms_per_cloud']:.2f} ms for a cloud of 19 points on one thread, median")
    return figures


def perturbed(
    random: np.random.Generator, points_m: FloatArray, sides: IntArray, count: int, most_hidden: int, most_ghosts: int
) -> Iterator[Cloud]:
    """`count` frames of (f, m, 3) [m], each with 0 to most_hidden markers gone and 0 to most_ghosts points added."""
    m = points_m.shape[1]
    for row in random.integers(len(points_m), size=count):
        markers = points_m[row]
        hidden = random.permutation(m)[: int(random.integers(most_hidden + 1))]
        shown = np.setdiff1d(np.arange(m), hidden)
        low, high = markers.min(axis=0), markers.max(axis=0)
        margin = MARGIN * (high - low)
        n_ghosts = int(random.integers(most_ghosts + 1))
        ghosts = random.uniform(low - margin, high + margin, (n_ghosts, 3))
        points = np.concatenate([markers[shown], ghosts])
        order = random.permutation(len(points))
        point = np.full(m, NO_POINT, dtype=np.int64)
        point[shown] = np.argsort(order)[: len(shown)]
        yield Cloud(points[order], point, "right" if sides[row] else "left")


def _with_calibration(network: Namer, layout: MarkerLayout, arguments: argparse.Namespace) -> dict[str, Any]:
    """Table 2 on every second sequence of each user, by the layout alone, and by where the wizard's calibration finds
    markers on that user's hand in the other sequences."""
    labels: dict[int, tuple[Side, int]] = {k: ("right", k) for k in range(len(layout.joints))}
    every, worn, users = list(range(len(layout.joints))), [], []
    for user in arguments.users:
        used, _ = sequences(_path(arguments.data, user), CALIBRATION_FRAMES)
        worn.append(calibrate_hand(used, Profile("", layout, ("right",)), labels=labels).profile.worn)
        users.append(_frames(arguments.data, user, layout, second=True))
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


def _path(folder: Path, user: int) -> Path:
    path = folder / f"han_user{user}.npz"
    return path if path.is_file() else folder / "han2018" / path.name


def _frames(folder: Path, user: int, layout: MarkerLayout, second: bool = False) -> tuple[FloatArray, IntArray]:
    """(f, 19, 3) [m] in the order of the layout, and (f,), 1 for a right hand. second: of every second sequence alone,
    those that `sequences` does not calibrate from. Raises FormatError."""
    path = _path(folder, user)
    try:
        with np.load(path, allow_pickle=False) as data:
            names = [str(name) for name in data["marker_names"]]
            order = [names.index(name) for name in layout.marker_names]
            points, sides = data["points"], data["hand"].astype(np.int64)
            kept = np.ones(len(sides), dtype=np.bool_)
            if second:  # left hands are right ones mirrored, in sequences of their own in the same order
                sequence = data["sequence"]
                kept = np.isin(sequence, np.concatenate([np.unique(sequence[sides == side])[1::2] for side in (0, 1)]))
            return points[kept][:, order].astype(np.float64), sides[kept]
    except (OSError, ValueError, KeyError) as error:
        raise FormatError(
            f"{path} cannot be read ({error}).", "Give --data the folder with the recordings of Han et al. 2018."
        ) from error


def _thinned(layout: MarkerLayout, kept: list[int]) -> MarkerLayout:
    return replace(
        layout,
        name=f"{layout.name} thinned to {len(kept)}",
        marker_names=tuple(layout.marker_names[k] for k in kept),
        joints=layout.joints[kept],
        positions_m=layout.positions_m[kept],
    )


def _time(network: Namer, layout: MarkerLayout, points_m: FloatArray, count: int = 300) -> float:
    """[ms] median of naming one cloud, everything counted."""
    spent = []
    for frame in points_m[:count]:
        began = time.perf_counter()
        network(frame, layout, "right")
        spent.append(time.perf_counter() - began)
    return 1e3 * float(np.median(spent))


def _share(part: float, whole: float) -> float:
    return part / whole if whole else float("nan")
