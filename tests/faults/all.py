"""Every fault, in the order of the table."""

from __future__ import annotations

from tests.faults import disk, ended, files, killed, many, neighbours, network
from tests.faults.fault import Fault

FAULTS: tuple[Fault, ...] = (
    *killed.FAULTS,
    *ended.FAULTS,
    *disk.FAULTS,
    *network.FAULTS,
    *many.FAULTS,
    *files.FAULTS,
    *neighbours.FAULTS,
)
