"""A file that is whole gets its name, and never in the place of another that got it first."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path


def put_new(draft: Path, target: Path) -> None:
    """Gives a file beside `target` that name. Raises FileExistsError where another has it by now, and OSError."""
    try:
        os.link(draft, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without links: the name is taken first, and then what has it is replaced
        os.close(os.open(target, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        try:
            draft.replace(target)
        except OSError:
            with contextlib.suppress(OSError):
                target.unlink()
            raise
    else:
        draft.unlink()
