"""Who is who in one cloud of points, by a network that knows hands and is told the layout (resources/networks).

It sees one frame, nothing of what came before: a proposal for a hand that is not tracked, or to be checked. Its
answer does not depend on the order of points or markers, nor on where the hand is or how it is turned.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
import onnxruntime
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from core.errors import FormatError, PhalanxError
from core.frames import NO_POINT, FloatArray, IntArray, Side
from core.labelling.marker_features import marker_features
from core.labelling.network_trial import bounded, try_out
from core.markers.layout import MarkerLayout
from core.untrusted.files import read_bytes
from core.untrusted.onnx_graph import MOST_BYTES, check_graph

FORMAT = "phalanx-labeller"
VERSION = "1"
SHIPPED, SHIPPED_NAME = "labeller.onnx", "shipped"
MOST_POINTS = 96
INPUTS = ("points_m", "asked", "memory", "kept")
OUTPUTS = ("log_label", "log_point", "side")
ENCODER_INPUTS, ENCODED = ("markers",), ("memory", "kept")
"""Of the encoder of layouts, which rides in the file's metadata: it is run once per layout."""

_LAYOUTS_KEPT, _NETWORKS_KEPT = 8, 8

_MEND = "Give a file made by phalanx train labeller."

_LITTLE = 1e-6  # so that points which are no markers speak for neither side

_ASKED: dict[Side | None, float] = {"right": 1.0, "left": -1.0, None: 0.0}


@dataclass(frozen=True)
class Labels:
    """What the network makes of n points and m markers.

    label: (n, m + 1) float64, probability of each name per point, the last column for none of these.
    point: (m, n + 1) float64, probability per marker that each point is it, the last column that it is hidden.
    right: (n,) float64, probability that a point, if it is a marker, is of a right hand; only where no side was asked.
    """

    label: FloatArray
    point: FloatArray
    right: FloatArray

    @property
    def hidden(self) -> FloatArray:
        """(m,) float64, probability that a marker is not among the points."""
        hidden: FloatArray = self.point[:, -1]
        return hidden

    @property
    def side(self) -> tuple[Side, float]:
        """The side that the markers speak for, all together, and how sure that is, 0.5 to 1."""
        weight = 1.0 - self.label[:, -1]
        right = float((weight @ self.right + 0.5 * _LITTLE) / (weight.sum() + _LITTLE))
        return ("right", right) if right >= 0.5 else ("left", 1.0 - right)


@dataclass(frozen=True)
class NamedHand:
    """One hand among the points.

    point: (m,) int64, index of each marker's point, NO_POINT for a hidden one. confidence: (m,) float64, probability
    that this is so. hidden: (m,) float64, probability that the marker is hidden.
    """

    side: Side
    point: IntArray
    confidence: FloatArray
    hidden: FloatArray

    @property
    def certainty(self) -> float:
        """Of the hand as a whole: the geometric mean over its markers."""
        return float(np.exp(np.log(np.maximum(self.confidence, 1e-9)).mean()))


class LabelNetwork:
    """One network file, ready to run. Raises FormatError where the file is no such network."""

    def __init__(self, path: Path | None = None, content: bytes | None = None, on_trial: bool = False) -> None:
        """path: default is the network shipped with Phalanx; any other is tried first. content: of the file, where it
        has been read already. on_trial: within bounds of memory, slower."""
        self._source = source = _source(path)
        if content is None:
            content = network_bytes(path)
        if path is not None and not on_trial:
            check_graph(content, source, _MEND)
            try_out(LabelNetwork(path, content, on_trial=True), MOST_POINTS, source)
        self._session = _session(content, source, on_trial)
        self.about: dict[str, str] = _metadata(self._session, source)
        if self.about.get("format") != FORMAT or self.about.get("version") != VERSION:
            found = f"{self.about.get('format', 'no format')!r} version {self.about.get('version', 'none')!r}"
            raise FormatError(
                f"{source} says {found}; this Phalanx runs {FORMAT!r} version {VERSION!r}.",
                "Make it again with phalanx train labeller.",
            )
        encoder = _encoder(self.about.pop("encoder", ""), source)
        self._encoder = _session(encoder, source, on_trial)
        for session, takes, gives in ((self._session, INPUTS, OUTPUTS), (self._encoder, ENCODER_INPUTS, ENCODED)):
            names = [[value.name for value in values] for values in (session.get_inputs(), session.get_outputs())]
            if names != [list(takes), list(gives)]:
                raise FormatError(f"{source} takes and gives {names}, not what naming markers takes.", _MEND)
        self._batches = self._session.get_inputs()[0].shape[:1] != [1]  # earlier versions exported them for one cloud
        self._encoded: dict[bytes, dict[str, NDArray[np.float32]]] = {}

    def labels(self, points_m: FloatArray, layout: MarkerLayout, side: Side | None = None) -> Labels:
        """points_m: (n, 3) float64 [m], in the world, of any hands. side: of the hand that is looked for; None: any.

        Raises PhalanxError for points that are not finite, or too many of them.
        """
        return self.labels_at((1.0,), points_m, layout, side)[0]

    def labels_at(
        self, sizes: Sequence[float], points_m: FloatArray, layout: MarkerLayout, side: Side | None = None
    ) -> list[Labels]:
        """`labels`, once for each of `sizes`: the hand is taken to be so many times as large as the layout has it, and
        its points are shown to the network as those of a hand of the layout's size. All are asked at once where the
        network's file allows it."""
        points = np.asarray(points_m)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) > MOST_POINTS or not np.isfinite(points).all():
            raise PhalanxError(
                f"Points of shape {points.shape} cannot be labelled.",
                f"Give (n, 3) finite positions in metres of at most {MOST_POINTS} points: one cluster.",
            )
        m = len(layout.joints)
        if len(points) == 0:
            nowhere = np.zeros((m, 1))
            nowhere[:] = 1.0
            return [Labels(np.empty((0, m + 1)), nowhere, np.empty(0)) for _ in sizes]
        centred = points - points.mean(axis=0)  # in float64: far from the origin digits are lost
        clouds = np.stack([(centred / size).astype(np.float32) for size in sizes])
        asked = np.full(len(clouds), _ASKED[side], dtype=np.float32)
        known, step = self._known(layout), len(clouds) if self._batches else 1
        answers = [
            self._session.run(OUTPUTS, {"points_m": clouds[k : k + step], "asked": asked[k : k + step], **known})
            for k in range(0, len(clouds), step)
        ]
        if any(np.isnan(values).any() for some in answers for values in some):
            raise PhalanxError(f"{self._source} answers with numbers that are none.", "Choose another network.")
        return [
            Labels(_exp(label), _exp(point), _right(logit))
            for some in answers
            for label, point, logit in zip(*some, strict=True)
        ]

    def name(self, points_m: FloatArray, layout: MarkerLayout, side: Side | None = None) -> NamedHand:
        """The hand that is looked for; where the side is left open, the one that the network believes in."""
        if side is None:
            side = self.labels(points_m, layout).side[0] if len(layout.sides) > 1 else layout.sides[0]
        return named(self.labels(points_m, layout, side), side)

    def _known(self, layout: MarkerLayout) -> dict[str, NDArray[np.float32]]:
        """The encoded layout; the last few are kept."""
        features = marker_features(layout)
        key = features.tobytes()
        known = self._encoded.get(key)
        if known is None:
            known = dict(zip(ENCODED, self._encoder.run(ENCODED, {"markers": features[None]}), strict=True))
            self._encoded = {**dict(list(self._encoded.items())[1 - _LAYOUTS_KEPT :]), key: known}
        return known


def named(labels: Labels, side: Side) -> NamedHand:
    """Markers and points paired so that the product of all probabilities is greatest: of each point's name or none,
    and of each marker's point or its being hidden."""
    point = matched(labels)
    rows = np.arange(len(point))
    seen = point != NO_POINT
    confidence = labels.hidden.copy()
    if seen.any():
        confidence[seen] = np.sqrt(labels.label[point[seen], rows[seen]] * labels.point[rows[seen], point[seen]])
    return NamedHand(side, point, confidence, labels.hidden)


def matched(labels: Labels) -> IntArray:
    """(m,) int64, index of each marker's point, NO_POINT where its being hidden is likelier; optimal as a whole."""
    m = len(labels.point)
    point = np.full(m, NO_POINT, dtype=np.int64)
    if len(labels.label) == 0:
        return point
    tiny = 1e-12
    row, column = np.log(labels.label + tiny), np.log(labels.point + tiny)
    # What a pair gains against both of them left alone.
    gain = row[:, :m] - row[:, m:] + (column[:, :-1] - column[:, -1:]).T
    points, markers = linear_sum_assignment(-np.maximum(gain, 0.0))
    good = gain[points, markers] > 0.0
    point[markers[good]] = points[good]
    return point


@cache
def shipped_network() -> LabelNetwork:
    """The network shipped with Phalanx, loaded once."""
    return LabelNetwork()


_loaded: dict[bytes, LabelNetwork] = {}  # by what is in their files


def network_at(path: str | None) -> LabelNetwork:
    """The network that a profile names; None: the one shipped with Phalanx. Raises FormatError.

    Files of the same content are one network, loaded once; a file that was replaced is another.
    """
    if path is None:
        return shipped_network()
    try:
        content = network_bytes(Path(path))
        key = hashlib.sha256(content).digest()
        network = _loaded.get(key)
        if network is None:
            network = LabelNetwork(Path(path), content)
            while len(_loaded) >= _NETWORKS_KEPT:
                del _loaded[next(iter(_loaded))]
            _loaded[key] = network
        return network
    except FormatError as error:
        raise FormatError(
            f"{error.what} The profile names it.",
            "Put a network made by phalanx train labeller there, or choose another: --network FILE, or --network "
            f"{SHIPPED_NAME} for the one of Phalanx.",
        ) from error


def network_bytes(path: Path | None) -> bytes:
    """A network's file, None: of the one shipped with Phalanx. Raises FormatError."""
    if path is None:
        return (files("resources") / "networks" / SHIPPED).read_bytes()
    try:
        return read_bytes(path, MOST_BYTES)
    except OSError as error:
        raise FormatError(f"{_source(path)} cannot be read ({error.strerror or error}).", _MEND) from error


def _metadata(session: onnxruntime.InferenceSession, source: str) -> dict[str, str]:
    """Raises FormatError for what is no text: onnxruntime decodes it when it is asked for."""
    try:
        return dict(session.get_modelmeta().custom_metadata_map)
    except UnicodeDecodeError as error:
        raise FormatError(f"What {source[0].lower()}{source[1:]} says of itself is no text.", _MEND) from error


def _source(path: Path | None) -> str:
    return "The labelling network of Phalanx" if path is None else f"Network {path}"


def _encoder(text: str, source: str) -> bytes:
    """The network within a network's file. Raises FormatError."""
    try:
        content = base64.b64decode(text, validate=True)
    except ValueError as error:
        raise FormatError(f"{source} holds no sound encoder of layouts.", _MEND) from error
    check_graph(content, source, _MEND)
    return content


def _session(content: bytes, source: str, on_trial: bool) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = 3
    if on_trial:
        bounded(options)
    try:
        return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # the runtime has no common base for what it raises
        raise FormatError(f"{source} is no network that can be run.", _MEND) from error


def _exp(logarithms: NDArray[np.float32]) -> FloatArray:
    probabilities: FloatArray = np.exp(logarithms.astype(np.float64))
    return probabilities


def _right(logits: NDArray[np.float32]) -> FloatArray:
    probabilities: FloatArray = 1.0 / (1.0 + np.exp(-logits.astype(np.float64)))
    return probabilities
