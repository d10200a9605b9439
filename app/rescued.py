"""Takes that were put in safety because their file or its folder was taken away while they were recorded."""

from __future__ import annotations

from pathlib import Path

import platformdirs

from app.notifications import NotificationCentre
from core.takes.rescue import rescued_in
from core.takes.take import EXTENSION


def rescued_folder() -> Path:
    """Where those go whose own folder has gone: in the application's data folder. It may not exist yet."""
    return Path(platformdirs.user_data_path("phalanx", appauthor=False)) / "rescued takes"


def rescued_from(path: Path) -> list[Path]:
    """Rescued takes that were recorded under this name, those beside it first, of these the latest."""
    return rescued_in(path.parent, path) + rescued_in(rescued_folder(), path)


def tell_of_rescued(notifications: NotificationCentre) -> None:
    """Says that takes wait in the data folder to be put where they belong."""
    folder = rescued_folder()
    try:
        names = sorted(file.name for file in folder.iterdir() if file.suffix == EXTENSION)
    except OSError:
        return
    if names:
        takes = f"Take {names[0]} was" if len(names) == 1 else f"{len(names)} takes were"
        notifications.warning(
            f"{takes} rescued into {folder} when their folder went away.",
            "Review opens them there; move them where they belong.",
            "Recorder",
        )
