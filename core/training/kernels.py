# mypy: allow-untyped-defs
"""Compiled kernels of training data: what a ring of cameras sees of markers among capsules."""

from __future__ import annotations

from math import sqrt

import numpy as np

from core.compiled import compiler

jit = compiler(nogil=True)


@jit
def blocked(origin, direction, reach, starts, ends, radii):
    """Whether a ray from origin (3,) along direction (3,), unit, meets a capsule within reach [m].

    starts, ends (k, 3), radii (k,) [m]. A capsule that the origin is inside of blocks only what looks deeper into it:
    a marker sits on skin that gives, not under it.
    """
    ox, oy, oz = origin[0], origin[1], origin[2]
    dx, dy, dz = direction[0], direction[1], direction[2]
    for k in range(starts.shape[0]):
        r = radii[k]
        if r <= 0.0:
            continue
        ax, ay, az = starts[k, 0], starts[k, 1], starts[k, 2]
        ux, uy, uz = ends[k, 0] - ax, ends[k, 1] - ay, ends[k, 2] - az
        wx, wy, wz = ox - ax, oy - ay, oz - az
        uu = ux * ux + uy * uy + uz * uz
        ud = ux * dx + uy * dy + uz * dz
        uw = ux * wx + uy * wy + uz * wz
        dw = dx * wx + dy * wy + dz * wz
        # Nearest point of the axis to the origin itself.
        s0 = 0.0 if uu < 1e-12 else min(max(uw / uu, 0.0), 1.0)
        px, py, pz = wx - s0 * ux, wy - s0 * uy, wz - s0 * uz
        if px * dx + py * dy + pz * dz >= 0.0:
            continue  # the way leads out of the capsule, or past it
        if px * px + py * py + pz * pz <= r * r:
            return True
        # Nearest approach of the ray to the axis (0 <= s <= 1).
        denominator = uu - ud * ud
        s = s0 if denominator < 1e-12 else min(max((uw - ud * dw) / denominator, 0.0), 1.0)
        t = s * ud - dw
        if t > reach:
            continue
        gx, gy, gz = wx + t * dx - s * ux, wy + t * dy - s * uy, wz + t * dz - s * uz
        if gx * gx + gy * gy + gz * gz < r * r:
            return True
    return False


@jit
def seen(points, cameras, counts, starts, ends, radii, least, out):
    """Which points at least `least` cameras see.

    points (b, n, 3), cameras (b, c, 3) of which counts (b,) exist, starts, ends (b, k, 3), radii (b, k) [m], 0 for
    none. Writes out (b, n).
    """
    direction = np.empty(3)
    for b in range(points.shape[0]):
        for i in range(points.shape[1]):
            sees = 0
            for c in range(counts[b]):
                length = 0.0
                for a in range(3):
                    direction[a] = cameras[b, c, a] - points[b, i, a]
                    length += direction[a] * direction[a]
                length = sqrt(length)
                for a in range(3):
                    direction[a] /= length
                if not blocked(points[b, i], direction, length, starts[b], ends[b], radii[b]):
                    sees += 1
                    if sees >= least[b]:
                        break
            out[b, i] = sees >= least[b]
