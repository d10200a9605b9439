"""Exchange formats out of a solved recording, each written file read back and compared before it is done.

`export(solution, ["c3d", "csv"], folder)` writes any of FORMATS; docs/exports.md says what each holds.
"""

from core.takes.export.formats import FORMATS
from core.takes.export.job import Exported, clear_drafts, export, export_each
from core.takes.export.options import ExportOptions

__all__ = ["FORMATS", "ExportOptions", "Exported", "clear_drafts", "export", "export_each"]
