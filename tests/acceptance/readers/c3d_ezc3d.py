"""C3D by ezc3d: what Mokka's successors, OpenSim and much of Python read it with."""

import ezc3d
from read_files import tell

ABOUT = ("TAKE", "PERFORMER", "RATING", "NOTES")


def read(path):
    file = ezc3d.c3d(path)
    groups = file["parameters"]
    points = file["data"]["points"]
    names = list(groups["POINT"]["LABELS"]["value"])
    number = 2
    while f"LABELS{number}" in groups["POINT"]:
        names += groups["POINT"][f"LABELS{number}"]["value"]
        number += 1
    events = []
    if "EVENT" in groups and "TIMES" in groups["EVENT"]:
        times, labels = groups["EVENT"]["TIMES"]["value"], groups["EVENT"]["LABELS"]["value"]
        events = [[60.0 * float(times[0, i]) + float(times[1, i]), labels[i]] for i in range(times.shape[1])]
    return {
        "labels": names,
        "points": points[:3].transpose(2, 1, 0).tolist(),
        "unit": groups["POINT"]["UNITS"]["value"][0],
        "rate_hz": float(file["header"]["points"]["frame_rate"]),
        "frames": int(points.shape[2]),
        "events": events,
        "about": {name: groups["PHALANX"][name]["value"] for name in ABOUT if name in groups["PHALANX"]},
        "subjects": groups["SUBJECTS"]["NAMES"]["value"] if "SUBJECTS" in groups else [],
    }


tell("ezc3d", ezc3d.__version__, read)
