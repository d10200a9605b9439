"""The network of Han 2018, trained by `phalanx train labeller --architecture han2018`, naming one cloud."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnxruntime

from core.errors import FormatError
from core.frames import NO_POINT, FloatArray, Side
from core.labelling.network import NamedHand, network_bytes
from core.markers.layout import MarkerLayout
from core.training.depth_image import SIZE, best_turn, images, matched, places_m, viewed
from core.untrusted.onnx_graph import check_graph


class HanNamer:
    """Names the markers of a right hand, or of a left one in the mirror. Raises FormatError for another network."""

    def __init__(self, path: Path) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        content = network_bytes(path)
        check_graph(content, f"Network {path}", "Give a file made with han2018.")
        try:
            self._session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
        except Exception as error:  # the runtime has no common base for what it raises
            raise FormatError(f"Network {path} cannot be run.", "Give a file made with han2018.") from error
        if [tuple(value.shape[1:]) for value in self._session.get_inputs()] != [(1, SIZE, SIZE)]:
            raise FormatError(f"Network {path} does not look at depth images.", "Give a file made with han2018.")

    def name(self, points_m: FloatArray, layout: MarkerLayout, side: Side | None) -> NamedHand:
        """points_m: (n, 3) [m]. The network cannot tell sides: one left open is taken for the right.

        A marker is hidden where there are fewer points than markers (eq. 1). No confidence is told: NaN.
        """
        own = points_m * ((-1.0, 1.0, 1.0) if side == "left" else (1.0, 1.0, 1.0))
        valid = np.ones((1, len(own)), dtype=np.bool_)
        seen, zoom, reach = viewed(own[None], valid, best_turn(np.random.default_rng(0), own)[None])
        places = self._session.run(None, {"image": images(seen, valid)})[0].astype(np.float64)
        if places.shape[1] != len(layout.joints):
            raise FormatError(
                f"The network names {places.shape[1]} markers, {layout.name} has {len(layout.joints)}.",
                "Give one that was trained for this layout.",
            )
        point = matched(places_m(places, zoom, reach)[0], places_m(seen, zoom, reach)[0])
        unknown = np.full(len(point), np.nan)
        return NamedHand(side or "right", point, unknown, (point == NO_POINT).astype(np.float64))
