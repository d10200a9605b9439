"""Which files a command means: paths, patterns that the shell left as they are, and lists of paths."""

from __future__ import annotations

import glob
from collections.abc import Iterator, Sequence
from pathlib import Path

from core.errors import FormatError
from core.untrusted.files import read_text

FILES_HELP = (
    "a recording; a pattern such as '*.c3d' (** for folders within folders); or @LIST, a text file with one path or "
    "pattern a line (lines that begin with # are comments)"
)

_LIST = "@"
_MOST_BYTES = 1 << 24  # of a list
_MOST_FILES = 100_000


def files_of(words: Sequence[str]) -> list[Path]:
    """The files that are meant, each once, in the order of the words; those of a pattern by name.

    A word that is the path of a file is that file, whatever is in it. Paths in a list are as if they were typed: from
    the folder that the command runs in. Raises FormatError for a pattern that nothing matches, a list that cannot be
    read or names nothing, and too many files.
    """
    found = dict.fromkeys(path for word in words for path in _meant(word))
    if len(found) > _MOST_FILES:
        raise FormatError(f"{len(found):,} files are too many at once.", f"Give at most {_MOST_FILES:,}.")
    return list(found)


def _meant(word: str) -> Iterator[Path]:
    if word.startswith(_LIST) and not _exists(word):
        for line in _lines(Path(word[len(_LIST) :])):
            yield from _matching(line)
    else:
        yield from _matching(word)


def _matching(word: str) -> list[Path]:
    if not glob.has_magic(word) or _exists(word):
        return [Path(word)]
    try:
        named = glob.glob(word, recursive=True)  # noqa: PTH207 - absolute, too
    except (ValueError, RecursionError):  # it begins with the name of a folder that none can have, or hundreds of them
        named = []
    found = sorted(one for one in map(Path, named) if one.is_file())
    if not found:
        raise FormatError(f"No file matches {word!r}.", "Look at its folder and ending, upper and lower case too.")
    return found


def _exists(word: str) -> bool:
    """Whether it is the path of something; False, too, for what no file can be called."""
    try:
        return Path(word).exists()
    except OSError:  # too long a name
        return False


def _lines(path: Path) -> list[str]:
    """What a list names: its lines without comments and blank ones."""
    try:
        text = read_text(path, _MOST_BYTES)
    except OSError as error:
        raise FormatError(
            f"List {path} cannot be read ({error.strerror or error}).",
            "Give @ and the path of a text file with one path a line.",
        ) from error
    lines = [line.strip() for line in text.splitlines()]
    named = [line for line in lines if line and not line.startswith("#")]
    if not named:
        raise FormatError(f"List {path} names no file.", "Write one path a line into it.")
    return named
