"""A file as a device: any recording that can be read, or a take, played as if it were captured now."""

from __future__ import annotations

from pathlib import Path

from app.played_file import PlayedFile, open_played
from core.errors import DeviceError, PhalanxError
from core.streams import Sample, StreamInfo
from devices.device import Description, Device, Health, Parameter
from devices.playback.client import PlaybackDevice


class FileDevice(Device):
    """Plays the file that its settings name; the file is read when the device is opened."""

    kind = "playback"
    title = "Recording"
    has_end = True
    parameters = (
        Parameter("file", "File", "", help="TRC, C3D, Qualisys TSV, Motive CSV, points.csv, BVH or a take."),
        *PlaybackDevice.parameters,
    )

    def __init__(self, **settings: object) -> None:
        super().__init__(**settings)
        self._player: PlaybackDevice | None = None
        self._file = PlayedFile(())

    def open(self) -> None:
        """Read the file. Raises DeviceError."""
        self.close()
        if not self.settings["file"]:
            raise DeviceError("No file is chosen to be played.", "Name a recording or a take.")
        path = Path(str(self.settings["file"]))
        own = {parameter.name: self.settings[parameter.name] for parameter in PlaybackDevice.parameters}
        try:
            self._file = open_played(path)
            self._player = PlaybackDevice(self._file.tracks, path.name, **own)
        except PhalanxError as error:
            self.close()
            raise DeviceError(error.what, error.action) from error
        self._player.open()

    def start(self) -> None:  # noqa: D102
        if self._player is None:
            raise DeviceError("The recording is not open.", "Connect it first.")
        self._player.start()

    def streams(self) -> tuple[StreamInfo, ...]:  # noqa: D102
        return self._player.streams() if self._player is not None else ()

    def read(self, timeout_s: float) -> Sample | None:  # noqa: D102
        return self._player.read(timeout_s) if self._player is not None else None

    def stop(self) -> None:  # noqa: D102
        if self._player is not None:
            self._player.stop()

    def close(self) -> None:  # noqa: D102
        if self._player is not None:
            self._player.close()
        self._file.close()

    @property
    def address(self) -> str:
        """The file's name."""
        return Path(str(self.settings["file"])).name

    def describe(self) -> Description:  # noqa: D102
        player = self._player
        return player.describe() if player is not None else Description(self.title)

    def health(self) -> Health:  # noqa: D102
        player = self._player
        return player.health() if player is not None else Health()

    def stream_health(self, key: str) -> Health:
        """The same of one stream."""
        player = self._player
        return player.stream_health(key) if player is not None else Health()

    @property
    def warnings(self) -> tuple[str, ...]:
        """Of the reader of the file."""
        return self._file.warnings

    @property
    def finished(self) -> bool:  # noqa: D102
        return self._player is not None and self._player.finished
