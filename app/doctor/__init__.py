"""What is missing on this machine, and how to get it. Every check is a function that returns findings."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from app.doctor.finding import Finding, problem
from app.doctor.left_behind import check_left_behind
from app.doctor.network import check_multicast, check_receive_buffer, check_serial_ports
from app.doctor.packages import check_packages, check_python
from app.doctor.screen import check_libraries, check_screen
from app.doctor.storage import check_disk, check_kernel_cache

CHECKS: tuple[Callable[[], Sequence[Finding]], ...] = (
    check_python,
    check_packages,
    check_libraries,
    check_screen,
    check_kernel_cache,
    check_receive_buffer,
    check_multicast,
    check_serial_ports,
    check_disk,
    check_left_behind,
)


def examine() -> list[Finding]:
    """Every check, in order. A check that fails itself is a finding like any other."""
    findings: list[Finding] = []
    for check in CHECKS:
        try:
            findings += check()
        except Exception as error:
            name = check.__name__.removeprefix("check_").replace("_", " ")
            findings.append(problem(name.capitalize(), f"could not be examined: {error!r}", "Please report this."))
    return findings
