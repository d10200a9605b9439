"""After warm_up no frame meets a kernel that has yet to be compiled: that would stop a live hand for seconds."""

from __future__ import annotations

import subprocess
import sys

from tests.data import ROOT

RUN = """
from itertools import islice
from core.engine import Engine, warm_up
from core.gap_filling import GapFiller
from core.kinematics import kernels as a
from core.labelling import kernels as b
from core.motion.performer import Performer
from core.motion.stream import MarkerStream
from core.profile import load_profile
from core.props import kernels as c
from core.props.marked import marked
from core.takes.reprocess import given_engine

def compiled():
    return {
        (module.__name__, name): len(kernel.signatures)
        for module in (a, b, c) for name, kernel in vars(module).items() if hasattr(kernel, "signatures")
    }

warm_up()
before = compiled()
for layout, sides in (("han19", ("left", "right")), ("qualisys13", ("right",)), ("schroeder6", ("left",))):
    profile = load_profile(layout).with_sides(sides)
    engine = Engine(profile)
    filler = GapFiller(profile, 0.1)
    for seed, hidden in ((1, 0.0), (2, 0.4)):
        stream = MarkerStream(Performer(profile, seed=seed), 120.0, seed, hidden=hidden, ghosts=3.0, bodies=2)
        for frame in islice(stream.frames(), 150):
            filler.push(engine.step(frame))
from dataclasses import replace
profile = load_profile("han19")
performer = Performer(profile, 1, "grasping")
props = tuple(marked(name, thing) for name, thing in performer.props.items())
engine = Engine(replace(profile, props=props))
for frame in islice(MarkerStream(performer, 120.0, 1, props=props, hidden=0.2).frames(), 60):
    engine.step(frame)
labels = {column: (side, k) for column, (side, k) in enumerate((s, k) for s in ("left",) for k in range(6))}
engine = given_engine(load_profile("schroeder6").with_sides(("left",)), labels)
for sent in islice(stream.labelled(), 5):
    engine.step(replace(sent.frame, ids=sent.truth))
after = compiled()
assert before == after, {name: (before[name], n) for name, n in after.items() if before[name] != n}
"""


def test_warm_up_compiles_every_kernel_that_frames_use() -> None:
    run = subprocess.run([sys.executable, "-c", RUN], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr[-2000:]
