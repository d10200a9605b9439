"""C3D by Kinetics Toolkit."""

from importlib.metadata import version

import kineticstoolkit as ktk
import numpy as np
from read_files import tell


def read(path):
    points = ktk.read_c3d(path)["Points"]
    labels = list(points.data)
    times = points.time
    return {
        "labels": labels,
        "points": np.stack([points.data[label][:, :3] for label in labels], axis=1).tolist(),
        "unit": "m",
        "rate_hz": float((len(times) - 1) / (times[-1] - times[0])),
        "frames": len(times),
        "events": [[float(event.time), event.name] for event in points.events],
    }


tell("Kinetics Toolkit", version("kineticstoolkit"), read)
