"""Motion files of other programs, one file per format.

`read_recording(path)` reads any of them. Whatever is wrong with a file raises one FormatError that names the
file, the place in it and the value found there.
"""

from core.takes.formats.detect import read_recording

__all__ = ["read_recording"]
