"""The built-in performer: hands that move, served over the loopback wire by a process of its own.

Nothing is short-circuited: the performer's markers leave the simulator of a kind of device and come in through that
device, as those of a capture volume would.
"""

from __future__ import annotations

import contextlib
import json
import multiprocessing
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any

from app.device_kinds import device_class, simulator_class
from app.props.offered import offered
from app.signals import deaf
from core.errors import DeviceError
from core.markers.layout import layout_names
from core.motion.activities import ACTIVITIES
from core.props.prop import Prop
from core.streams import Sample, StreamInfo
from devices.device import Description, Device, Health, Level, Parameter
from devices.offers import Offers

KIND = "natnet"
"""Of the device that it speaks as."""
START_S = 180.0
"""Of a machine that is busy; a process that ends is told at once."""
STOP_S = 5.0
LAYOUT = "han19"
ACTIVITY = "everyday"


class DemoDevice(Device):
    """A device that brings its own server. It offers what the first performer handles, with markers on it."""

    kind = "demo"
    title = "Demo performer"
    parameters = (
        Parameter("layout", "Marker layout", LAYOUT, choices=layout_names(), help="The glove the performer wears."),
        Parameter("performers", "Performers", 1, "", 1, 4, 1, help="People side by side, all with the same glove."),
        Parameter("activity", "Performs", ACTIVITY, choices=tuple(ACTIVITIES), help="What the hands do, and handle."),
        Parameter("rate_hz", "Frame rate", 120.0, "Hz", 30.0, 500.0, 10.0, help="Frames per second sent."),
        Parameter("hidden", "Hidden markers", 4.0, "%", 0.0, 60.0, 1.0, help="Share of the time a marker is hidden."),
        Parameter("ghosts", "Ghost points", 0.5, "per frame", 0.0, 20.0, 0.5, help="Reflections that are no marker."),
        Parameter("bodies", "Other bodies", 1, "", 0, 10, 1, help="Other rigid bodies of four markers in the volume."),
        Parameter("seed", "Seed", 1, "", 0, 1_000_000, 1, help="The same seed gives the same performance."),
    )

    def __init__(self, **settings: object) -> None:
        super().__init__(**settings)
        self._client: Device | None = None
        self._server: multiprocessing.process.BaseProcess | None = None
        self._line: Connection | None = None
        self._offers = Offers()

    @property
    def server_pid(self) -> int | None:
        """The process that serves, while there is one."""
        return self._server.pid if self._server is not None else None

    def open(self) -> None:
        """Start the server and reach it. Raises DeviceError."""
        self.close()
        context = multiprocessing.get_context("spawn")
        self._line, theirs = context.Pipe()
        self._server = context.Process(
            target=_serve, args=(json.dumps(self.settings), theirs), name="phalanx-demo", daemon=True
        )
        self._server.start()
        theirs.close()
        late: dict[str, Any] = {"error": "it did not start in time"}
        try:
            answer = json.loads(self._line.recv_bytes()) if self._line.poll(START_S) else late
        except EOFError:
            answer = {"error": "its process ended"}
        if "error" in answer:
            self.close()
            raise DeviceError(f"The demo performer could not start: {answer['error']}.", "Connect it again.")
        self._offers = Offers(tuple(offered(Prop.from_dict(prop)) for prop in answer["props"]))
        self._client = device_class(KIND)(**answer["settings"])
        self._client.open()

    def start(self) -> None:  # noqa: D102
        self._opened().start()

    def streams(self) -> tuple[StreamInfo, ...]:  # noqa: D102
        streams = self._client.streams() if self._client is not None else ()
        return tuple(replace(stream, kind=self.kind, title=self.title) for stream in streams)

    def read(self, timeout_s: float) -> Sample | None:  # noqa: D102
        return self._opened().read(timeout_s)

    def stop(self) -> None:  # noqa: D102
        if self._client is not None:
            self._client.stop()

    def close(self) -> None:  # noqa: D102
        client, line, server = self._client, self._line, self._server
        if client is not None:
            client.close()
        if line is not None:
            line.close()  # the server ends when its line does
        if server is not None:
            server.join(STOP_S)
            if server.is_alive():
                server.kill()
                server.join(STOP_S)
        self._line = self._server = None

    def describe(self) -> Description:  # noqa: D102
        client = self._client
        inner = client.describe() if client is not None else Description(self.title)
        return Description(self.title, inner.rate_hz or float(self.settings["rate_hz"]), inner.details)

    def health(self) -> Health:  # noqa: D102
        client, server = self._client, self._server
        if client is None:
            return Health()
        health = client.health()
        if server is not None and server.exitcode is not None:
            reason = "The demo performer's process has ended. Disconnect it, then connect it again."
            return replace(health, level=Level.PROBLEM, reason=reason, connected=False)
        if health.level is Level.PROBLEM:
            reason = (
                "The demo performer no longer answers. If it does not come back, disconnect it and connect it again."
            )
        elif health.level is Level.WARNING and health.rate_hz == 0:
            reason = (
                "The demo performer sends no frames yet. Wait until the solver is ready; if none come then, disconnect "
                "it and connect it again."
            )
        elif "frames lost" in health.reason:
            lost = health.lost - health.unread
            reason = f"{lost:,} frames of the demo performer were lost: this machine is busy. Close other programs."
        else:
            return health
        return replace(health, reason=reason)

    def offers(self) -> Offers:  # noqa: D102
        return self._offers

    def _opened(self) -> Device:
        if self._client is None:
            raise DeviceError("The demo performer is not open.", "Connect it.")
        return self._client


def _serve(text: str, line: Connection) -> None:
    """The server's process: tells where it serves, then serves until the line is cut. text: the settings, as JSON."""
    deaf()
    from core.motion.company import Company
    from core.motion.performer import Performer
    from core.motion.stream import MarkerStream
    from core.profile import load_profile
    from core.props.marked import marked

    settings = json.loads(text)
    try:
        seed, rate_hz = int(settings["seed"]), float(settings["rate_hz"])
        profile = load_profile(str(settings["layout"]))
        performers = [
            Performer(profile, seed + i, str(settings["activity"])) for i in range(int(settings["performers"]))
        ]
        props = tuple(marked(name, thing, seed) for name, thing in performers[0].props.items())
        stream = MarkerStream(
            Company(performers),
            rate_hz,
            seed,
            hidden=float(settings["hidden"]) / 100.0,
            ghosts=float(settings["ghosts"]),
            bodies=int(settings["bodies"]),
            props=props,
        )
        simulator = simulator_class(KIND)
        server = simulator.of(stream.frames(), rate_hz, simulator.anywhere, name="Demo performer")
        server.start()
    except Exception as error:
        with contextlib.suppress(OSError):  # whoever asked may have ended meanwhile
            line.send_bytes(json.dumps({"error": str(error) or type(error).__name__}).encode())
        return
    with contextlib.suppress(EOFError, OSError):
        line.send_bytes(json.dumps({"settings": server.settings, "props": [prop.to_dict() for prop in props]}).encode())
        line.recv_bytes()
    server.close()
