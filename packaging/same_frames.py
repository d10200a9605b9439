"""Do two checkouts solve recordings to the same frames, bit for bit? `same_frames.py OTHER RECORDING...`

For a change that must change no pose: run it from the checkout with the change, OTHER is one without it.

    .venv/bin/python packaging/same_frames.py ../before glove.tsv points.csv take.mcap --profile han19

Each checkout solves in a process of its own, with its own interpreter (`.venv`; that of this script where it has none),
both at once and frame by frame. A recording is solved as live, by the names that it has where it is labelled and a
profile says so, else by what the engine makes of its points; then its gaps are filled, and both are compared. --profile
is for recordings that do not say what the hands wore; --unlabelled withholds names, --whole names points from the whole
recording.

What is compared is every field of every frame but how long it took (stage_s), arrays by type, shape and bytes. A field
that only one checkout has is named and is no difference. Of the first difference of a recording all is said: frame,
field, both values. Exit status: 0 all the same, 1 a difference, 2 a checkout that cannot solve a recording.
"""

from __future__ import annotations

import argparse
import base64
import dataclasses
import itertools
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
SAME, DIFFERENT, FAILED = 0, 1, 2
TIMINGS, FLOAT = "stage_s", "float"

_EACH = re.compile(r"\[\d+\]")

Fields = dict[str, Any]
"""What a frame holds, each value by its way there: 'hands[0].theta_rad'."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Compares; gives the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("other", metavar="OTHER", type=Path, help="another checkout")
    parser.add_argument("recordings", metavar="RECORDING", type=Path, nargs="+", help="a recording or a take")
    parser.add_argument("--profile", metavar="P", help="where the recording does not say what the hands wore")
    parser.add_argument("--frames", metavar="N", type=int, help="the first N of each; default all")
    parser.add_argument("--unlabelled", action="store_true", help="withhold names that recordings have")
    parser.add_argument("--whole", action="store_true", help="name points from the whole recording")
    parser.add_argument("--this", metavar="DIR", type=Path, default=ROOT, help="default: where this script is")
    asked = parser.parse_args(arguments)
    statuses = []
    for path in asked.recordings:
        how = {
            "path": str(path.resolve()), "profile": asked.profile, "frames": asked.frames,
            "unlabelled": asked.unlabelled, "whole": asked.whole,
        }  # fmt: skip
        status, said = compare(asked.this.resolve(), asked.other.resolve(), how)
        print(f"{path.name}: {said}", flush=True)
        statuses.append(status)
    return max(statuses)


def compare(this: Path, other: Path, how: dict[str, Any]) -> tuple[int, str]:
    """What became of one recording, as an exit status and in words. how: the arguments of `solved`."""
    ours, theirs = _begin(this, how), _begin(other, how)
    count, only = 0, {this: set[str](), other: set[str]()}
    one = two = None
    try:
        assert ours.stdout is not None and theirs.stdout is not None
        for one, two in itertools.zip_longest(ours.stdout, theirs.stdout):
            if one is None or two is None:
                break
            if one != two:
                a, b = json.loads(one), json.loads(two)
                only[this] |= {_EACH.sub("[]", name) for name in a.keys() - b.keys()}
                only[other] |= {_EACH.sub("[]", name) for name in b.keys() - a.keys()}
                wrong = next((name for name in a if name in b and a[name] != b[name]), None)
                if wrong is not None:
                    return DIFFERENT, _said(a, wrong, a[wrong], b[wrong])
            count += 1
        ended = [(ours, this)] * (two is not None or one is None) + [(theirs, other)] * (one is not None or two is None)
        for process, folder in ended:
            if process.wait():
                return FAILED, f"{folder} could not solve it, see above."
        if len(ended) == 1:
            return DIFFERENT, f"{ended[0][1]} has {count // 2:,} frames, the other more."
    finally:
        for process in (ours, theirs):
            process.kill()
            process.communicate()
    news = [f"; only in {folder}: {', '.join(sorted(names))}" for folder, names in only.items() if names]
    return SAME, f"{count // 2:,} frames, solved and filled, are the same{''.join(news)}."


def _said(frame: Fields, name: str, ours: Any, theirs: Any) -> str:
    ours, theirs = _shown(ours), _shown(theirs)
    return f"DIFFERENT in frame {frame['number']} as {frame['stage']}, {name}:\n  {ours}\n  {theirs}"


def _begin(checkout: Path, how: dict[str, Any]) -> subprocess.Popen[str]:
    """A process of that checkout that writes a line for every frame."""
    own = checkout / ".venv" / "bin" / "python"
    python = str(own) if own.exists() else sys.executable
    environment = os.environ | {"PYTHONPATH": str(checkout), "PYTHONWARNINGS": "ignore"}
    command = [python, str(Path(__file__).resolve()), "--solve", json.dumps(how | {"checkout": str(checkout)})]
    return subprocess.Popen(command, cwd=checkout, env=environment, stdout=subprocess.PIPE, text=True)


# In the process of a checkout. What is imported is that checkout's own.


def write_frames(checkout: str, **how: Any) -> None:
    """A line for every frame on standard output."""
    import core

    own = Path(str(core.__path__[0])).resolve().parent
    if own != Path(checkout):
        raise SystemExit(f"{checkout} is to be compared, but {own} would be.")
    for stage, number, frame in _frames(**how):
        fields: Fields = {"stage": stage, "number": number}
        flatten(frame, "", fields)
        print(json.dumps(fields))


def _frames(
    path: str, profile: str | None, frames: int | None, unlabelled: bool, whole: bool
) -> Iterator[tuple[str, int, Any]]:
    """Every frame as it was solved, and again with its gaps filled."""
    from app.labels import cast_labels
    from app.tracking_figures import frames_and_columns
    from core.gap_filling import filled
    from core.profile import load_profile
    from core.takes.formats import read_recording
    from core.takes.formats.take import is_take
    from core.takes.reader import open_take
    from core.takes.reprocess import relabelled, solve_each

    recording = read_recording(Path(path))
    cast: tuple[Any, ...] = (load_profile(profile),) if profile else ()
    if is_take(Path(path)):
        with open_take(Path(path)) as take:
            raw = list(take.raw)
            own = take.profiles
            cast = cast or (own if isinstance(own, tuple) else (own,))
    else:
        raw = frames_and_columns(recording, unlabelled)[0]
    if not cast:
        raise SystemExit(f"{path} does not say what the hands wore: give --profile.")
    raw = raw[:frames]
    labels = None if unlabelled or whole else cast_labels(recording, cast)
    solved = relabelled(raw, cast) if whole else [one for _, one in solve_each(raw, cast, labels)]
    yield from (("solved", i, one) for i, one in enumerate(solved))
    yield from (("filled", i, one) for i, one in enumerate(filled(iter(solved), cast)))


def flatten(value: Any, name: str, into: Fields) -> None:
    """Adds all that a value holds, by the way there."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        for field in dataclasses.fields(value):
            if field.name != TIMINGS:
                flatten(getattr(value, field.name), f"{name}.{field.name}" if name else field.name, into)
    elif isinstance(value, dict):
        for key in sorted(value, key=str):
            flatten(value[key], f"{name}[{key}]", into)
    elif isinstance(value, tuple | list):
        into[f"len({name})"] = len(value)
        for i, one in enumerate(value):
            flatten(one, f"{name}[{i}]", into)
    elif isinstance(value, Enum):
        into[name] = value.name
    elif hasattr(value, "tobytes"):
        into[name] = [str(value.dtype), list(value.shape), base64.b64encode(value.tobytes()).decode()]
    elif isinstance(value, float):
        into[name] = [FLOAT, [], value.hex()]
    else:
        into[name] = value


def _shown(value: Any) -> str:
    """A value as people read it."""
    import numpy as np

    if not isinstance(value, list):
        return repr(value)
    kind, shape, data = value
    if kind == FLOAT:
        return repr(float.fromhex(data))
    array = np.frombuffer(base64.b64decode(data), dtype=kind).reshape(shape)
    return np.array2string(array, precision=17, threshold=40, max_line_width=110).replace("\n", "\n  ")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--solve"]:
        write_frames(**json.loads(sys.argv[2]))
    else:
        raise SystemExit(main())
