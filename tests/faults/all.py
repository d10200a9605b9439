"""Every fault, in the order of the table."""

from __future__ import annotations

from tests.faults import disk, ended, killed, many, network
from tests.faults.fault import Fault

FAULTS: tuple[Fault, ...] = (
    *killed.FAULTS,
    *ended.FAULTS,
    *disk.FAULTS,
    *network.FAULTS,
    *many.FAULTS,
)
