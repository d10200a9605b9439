"""What a simulator is to send, and the options that choose it: a recording, or the built-in performer."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from app.commands.out import out_file
from app.commands.terminal import warn
from core.errors import PhalanxError
from core.frames import MarkerFrame

if TYPE_CHECKING:
    from core.motion.performer import Performer
    from core.props.prop import Prop

DEMO = "demo"
LAYOUT = "han19"
APART_M = 0.6
DEMO_RATE_HZ = 120.0
DEMO_NOISE_MM = 0.03


@dataclass(frozen=True)
class Motion:
    """What is served. repeat: the frames themselves have an end, and are to be sent again and again. warnings: of the
    reader of the file."""

    title: str
    frames: Iterable[MarkerFrame]
    rate_hz: float
    repeat: bool = False
    warnings: tuple[str, ...] = ()


def add_motion_options(parser: argparse.ArgumentParser) -> None:
    """Declares them."""
    group = parser.add_argument_group("motion")
    group.add_argument(
        "--motion", metavar="FILE", default=DEMO, help=f"a recording, or {DEMO!r}: the built-in performer (default)"
    )
    group.add_argument(
        "--profile",
        metavar="P",
        action="append",
        help=f"what the performer wears, default {LAYOUT}; given again: one more performer, {APART_M:g} m beside",
    )
    group.add_argument(
        "--activity",
        metavar="WHAT",
        help="what the performer does: free (default), everyday, grasping, gestures, counting, piano, signs, hands "
        "(both hands meet), range (of motion), pen (it writes, and points at the other hand) or controller",
    )
    group.add_argument("--rate", metavar="HZ", type=float, help="default: the recording's own; performer 120")
    group.add_argument("--once", action="store_true", help="end with the recording instead of beginning again")
    group.add_argument("--seconds", metavar="S", type=float, help="how long to serve [s]; default: until Ctrl+C")
    group.add_argument(
        "--hide", metavar="SHARE", type=float, default=0.0, help="share of the time a marker is hidden, 0 to 0.9"
    )
    group.add_argument("--ghosts", metavar="N", type=float, default=0.0, help="mean number of ghost points per frame")
    group.add_argument("--bodies", metavar="N", type=int, default=0, help="other rigid bodies in the volume")
    group.add_argument(
        "--props",
        metavar="PROFILE",
        type=out_file,
        help="also send markers on the things that the performer handles (--activity everyday or grasping), and write "
        "this profile, with those props, to track them by",
    )
    group.add_argument("--noise", metavar="MM", type=float, help="noise added per axis [mm]; default 0, performer 0.03")
    group.add_argument(
        "--seed", metavar="N", type=int, default=0, help="the same seed gives the same frames; default 0"
    )


def motion_of(arguments: argparse.Namespace) -> Motion:
    """What was chosen. Raises PhalanxError."""
    from core.motion.company import Company
    from core.motion.performer import DEFAULT_ACTIVITY, Performer
    from core.motion.stream import MarkerStream, RecordingMotion, Trajectories
    from core.profile import load_profile
    from core.takes.formats import read_recording

    source: Trajectories
    props: tuple[Prop, ...] = ()
    warnings: tuple[str, ...] = ()
    if arguments.motion == DEMO:
        profiles = [load_profile(profile) for profile in arguments.profile or [LAYOUT]]
        performers = [
            Performer(profile, arguments.seed + i, arguments.activity or DEFAULT_ACTIVITY)
            for i, profile in enumerate(profiles)
        ]
        source = performers[0] if len(performers) == 1 else Company(performers, APART_M)
        worn, own_hz = " and ".join(profile.layout.name for profile in profiles), DEMO_RATE_HZ
        title = f"the performer with {worn}" if len(performers) == 1 else f"{len(performers)} performers with {worn}"
        if arguments.props is not None:
            if len(performers) > 1:
                raise PhalanxError("--props is for one performer.", "Give one --profile, or leave --props out.")
            props = _props(performers[0], arguments.props)
            title += " and " + ", ".join(prop.name for prop in props)
    elif arguments.props is not None:
        raise PhalanxError(f"--props is for the built-in performer, not for {arguments.motion}.", "Leave it out.")
    elif arguments.activity is not None:
        raise PhalanxError(f"--activity is for the built-in performer, not for {arguments.motion}.", "Leave it out.")
    else:
        recording = read_recording(Path(arguments.motion))
        title, own_hz = Path(arguments.motion).name, recording.rate_hz
        warnings = recording.warnings
        warn(title, warnings)
        if not recording.labels:
            return replace(_as_it_is(arguments, title, list(recording.frames()), own_hz), warnings=warnings)
        source = RecordingMotion(recording, repeat=not arguments.once)
    rate_hz = arguments.rate if arguments.rate is not None else own_hz
    noise_mm = arguments.noise if arguments.noise is not None else (DEMO_NOISE_MM if arguments.motion == DEMO else 0.0)
    stream = MarkerStream(
        source,
        rate_hz,
        arguments.seed,
        hidden=arguments.hide,
        ghosts=arguments.ghosts,
        noise_m=noise_mm / 1000.0,
        bodies=arguments.bodies,
        props=props,
    )
    frames = stream.frames()
    first = next(frames)  # compiles what it needs, before anybody waits for it
    return Motion(title, chain((first,), frames), rate_hz, warnings=warnings)


def _props(performer: Performer, path: Path) -> tuple[Prop, ...]:
    """The performer's things with markers on them; writes the profile that holds them."""
    from core.profile import save_profile
    from core.props.marked import marked

    if not performer.props:
        raise PhalanxError(
            f"The performer handles nothing in the activity {performer.activity!r}.",
            "Choose --activity everyday or grasping, or leave out --props.",
        )
    props = tuple(marked(name, thing, performer.seed) for name, thing in performer.props.items())
    save_profile(replace(performer.profile, props=props), path)
    return props


def _as_it_is(arguments: argparse.Namespace, title: str, frames: list[MarkerFrame], rate_hz: float) -> Motion:
    """Points without labels are sent as they were received: nothing is known that could be hidden or resampled."""
    if arguments.hide or arguments.ghosts or arguments.bodies or arguments.rate not in (None, rate_hz):
        raise PhalanxError(
            f"{title} holds points without labels: it is served as it is, at {rate_hz:g} Hz.",
            "Leave out --rate, --hide, --ghosts and --bodies, or choose a labelled recording.",
        )
    return Motion(title, frames, rate_hz, repeat=not arguments.once)
