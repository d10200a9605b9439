"""The latency that an operator means: from exposure to the pose that is shown, the same wherever it stands."""

from __future__ import annotations

import math

from app.live_numbers import SolverNumbers
from devices.device import Health

NO_LATENCY = "–"


def latency_value(solver: SolverNumbers, health: Health) -> str:
    """'8.4 ms', or a dash while nothing is solved. health: of the device that feeds the solver."""
    known = health.connected and health.rate_hz > 0 and math.isfinite(solver.latency_s)
    return f"{solver.latency_s * 1000:.1f} ms" if known else NO_LATENCY


def latency_parts(solver: SolverNumbers, health: Health) -> str:
    """What it is made of, in words."""
    if latency_value(solver, health) == NO_LATENCY:
        return "From exposure to the solved pose. Shown while frames are solved."
    lines = [
        f"From exposure to the solved pose: median {solver.latency_s * 1000:.1f} ms, "
        f"99 % under {solver.latency_p99_s * 1000:.1f} ms."
    ]
    if math.isfinite(health.latency_s):
        lines.append(f"Of that {health.latency_s * 1000:.1f} ms until the frame arrived on this machine.")
    if solver.look_ahead_s > 0:
        lines.append(f"Of that {solver.look_ahead_s * 1000:.0f} ms is the look-ahead chosen in Tracking.")
    return "\n".join(lines)
