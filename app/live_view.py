"""What the 3D view of the live room says where there are no hands to show."""

from __future__ import annotations

from app.live_streams import incoming, solved_one
from app.props.picking import LivePicking
from app.session import Session
from app.viewport.viewport import Viewport
from core.frames import TrackedFrame
from devices.device import Level


class LiveView:
    """A pose that is held must not look like one that is live: without frames the view says so."""

    def __init__(self, session: Session, viewport: Viewport, picking: LivePicking) -> None:
        self._session, self._viewport, self._picking = session, viewport, picking

    def watch(self) -> None:
        """Look whether frames of the stream that is solved come."""
        streams = incoming(self._session)
        shown = solved_one(streams) or next((one for one in streams if not one.key and one.receiver.active), None)
        if shown is None or shown.ended:
            self._say_nothing_comes(bool(self._session.streams))
        elif not shown.flows or shown.health.level is Level.PROBLEM:
            self._say("No frames", shown.health.reason)

    def devices_changed(self) -> None:
        """One came or went."""
        if not any(device.active for device in self._session.receivers):
            self._say_nothing_comes(others=False)

    def solving_changed(self, solving: str) -> None:
        """Frames of another stream, or of another connection, are to come. solving: its key, "" for none."""
        if solving:
            self._viewport.show_empty("Waiting for frames", "The device is connected; nothing has come yet.")

    def show_points_alone(self) -> None:
        """Hands as they were for other performers are shown no more; those of the present ones follow in a moment."""
        frame = self._viewport.shown[0]
        if frame is not None and not self._picking.held:
            nothing = TrackedFrame(frame.sequence, frame.times, ())
            self._viewport.show_frame(frame, nothing, self._session.profiles)

    def _say_nothing_comes(self, others: bool) -> None:
        """others: streams come that are not solved."""
        devices = self._session.receivers
        played = next((device for device in devices if device.finished), None)
        if played is not None:
            how = "Stop ends the take (Ctrl+R)." if self._session.recording else "Connect plays it again (Ctrl+K)."
            self._say(f"{played.title} has been played to its end", how)
        elif others:
            self._say("No hands to show", "What comes in is recorded; hands are solved from points alone.")
        elif devices:
            self._say("No device connected", "Connect one in the Devices panel (Ctrl+K).")
        else:
            self._show_nothing()

    def _say(self, title: str, detail: str) -> None:
        self._show_nothing()
        self._viewport.show_empty(title, detail)

    def _show_nothing(self) -> None:
        self._session.latest.clear()
        self._picking.forget()
        self._viewport.show_frame(None, None, None)
