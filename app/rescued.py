"""Where takes are put in safety whose own folder has gone."""

from __future__ import annotations

from pathlib import Path

import platformdirs


def rescued_folder() -> Path:
    """In the application's data folder; it may not exist yet."""
    return Path(platformdirs.user_data_path("phalanx", appauthor=False)) / "rescued takes"
