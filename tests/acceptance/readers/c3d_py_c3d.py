"""C3D by py-c3d, which tells measured, calculated and missing points apart."""

from importlib.metadata import version
from pathlib import Path

import c3d
import numpy as np
from read_files import tell


def read(path):
    with Path(path).open("rb") as stream:
        reader = c3d.Reader(stream)
        rows = np.array([points for _, points, _ in reader.read_frames(copy=True)])  # x, y, z, residual, cameras
        labels = [label.strip() for label in reader.point_labels]
        header = [[float(time), label.strip()] for time, label in reader.header.events]
        events = []
        group = reader.get("EVENT")
        if group is not None and group.get("TIMES") is not None:
            times = group.get("TIMES").float_array
            names = group.get("LABELS").string_array
            events = [[60.0 * float(a) + float(b), name.strip()] for (a, b), name in zip(times, names, strict=True)]
        return {
            "labels": labels,
            "points": np.where(rows[..., 3:4] < 0, np.nan, rows[..., :3]).tolist(),
            "measured": (rows[..., 3] > 0).tolist(),
            "unit": reader.get("POINT:UNITS").string_array[0].strip(),
            "rate_hz": float(reader.point_rate),
            "frames": len(rows),
            "events": events,
            "header_events": header,
        }


tell("py-c3d", version("c3d"), read)
