"""TRC by pandas, as scripts of laboratories read it: a table separated by tabs under the line of the axes."""

from pathlib import Path

import pandas
from read_files import tell


def read(path):
    with Path(path).open(encoding="utf-8") as stream:
        head = [next(stream).rstrip("\n").split("\t") for _ in range(4)]
    facts = dict(zip(head[1], head[2], strict=False))
    labels = [cell for cell in head[3][2:] if cell]
    table = pandas.read_csv(path, sep="\t", skiprows=5, header=None, skip_blank_lines=True)
    cells = table.iloc[:, 2 : 2 + 3 * len(labels)].astype(float).to_numpy()
    return {
        "labels": labels,
        "points": cells.reshape(len(table), len(labels), 3).tolist(),
        "times_s": table[1].tolist(),
        "unit": facts["Units"],
        "rate_hz": float(facts["DataRate"]),
        "frames": len(table),
    }


tell("pandas", pandas.__version__, read)
