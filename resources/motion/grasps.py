"""Sketches of grasps, each with what is held.

Names, order and classes (what opposes what, thumb abducted or adducted) follow Feix et al. 2016; sizes of what is held
are of the kind in their figure.
"""

from __future__ import annotations

from resources.motion.goal import Goal, Held, Row, digits

PALM = ("middle palm", "prop")


def _pads(*names: str) -> tuple[tuple[str, str], ...]:
    return tuple((f"{digit} pad", "prop") for digit in names)


FIVE_PADS = _pads("thumb", "index", "middle", "ring", "pinky")


def _feix(
    number: int,
    title: str,
    sketch: tuple[Row, Row, Row, Row, Row],
    held: Held,
    *contacts: tuple[str, str],
    also: str = "",
) -> Goal:
    name = title.lower().replace(" ", "_").replace("-", "_")
    return Goal(name, "grasp", f"Feix 2016, {number}: {title}{also}", sketch, contacts, held)


def _fingers(mcp: float, pip: float, dip: float, spread: float = 0.0) -> list[str | Row]:
    return [
        (spread, mcp - 2, pip, dip),
        (0, mcp, pip, dip),
        (spread, mcp + 2, pip, dip),
        (1.6 * spread, mcp + 3, pip, dip),
    ]


def grasp_goals() -> list[Goal]:
    """All of them."""
    return [*_power(), *_intermediate(), *_precision(), *_others()]


def _power() -> list[Goal]:
    finger_pads = FIVE_PADS[1:]
    return [
        _feix(1, "Large Diameter", digits((6, 50, 6, 18), _fingers(34, 38, 24, 3)),
              Held("cylinder", (90, 160), (-2, -64, -92), (1, 0, 0.1)), PALM, *FIVE_PADS,
              also="; Cutkosky 1989, 1"),
        _feix(2, "Small Diameter", digits((34, 36, 30, 34), _fingers(62, 78, 44)),
              Held("cylinder", (25, 140), (2, -30, -82), (1, 0, 0.3)), PALM, *finger_pads,
              ("thumb pad", "index middle dorsal"), also="; Cutkosky 1989, 2"),
        _feix(3, "Medium Wrap", digits((26, 44, 16, 24), _fingers(52, 58, 36)),
              Held("cylinder", (45, 150), (0, -40, -88), (1, 0, 0.2)), PALM, *finger_pads, ("thumb pad", "prop"),
              also="; Cutkosky 1989, 3"),
        _feix(4, "Adducted Thumb", digits((16, 6, 8, 8), _fingers(64, 74, 42)),
              Held("cylinder", (28, 200), (-4, -32, -84), (1, -0.05, 0.55)), PALM, *finger_pads[:3],
              ("thumb pad", "prop"), also="; Cutkosky 1989, 4"),
        _feix(5, "Light Tool", digits((16, 6, 10, 12), _fingers(74, 86, 48)),
              Held("cylinder", (14, 180), (-6, -26, -86), (1, -0.05, 0.5)), PALM, *finger_pads[:3],
              ("thumb pad", "prop"), also="; Cutkosky 1989, 5"),
        _feix(10, "Power Disk", digits((0, 30, 4, 18), _fingers(8, 46, 30, 9)),
              Held("disk", (92, 22), (0, -28, -92), (0, 1, 0)), PALM, *FIVE_PADS, also="; Cutkosky 1989, 10"),
        _feix(11, "Power Sphere", digits((4, 48, 4, 14), _fingers(24, 36, 24, 9)),
              Held("sphere", (85,), (-2, -58, -94)), PALM, *FIVE_PADS, also="; Cutkosky 1989, 11"),
        _feix(15, "Fixed Hook", digits((-4, 4, 6, 14), _fingers(16, 92, 46)),
              Held("cylinder", (20, 120), (4, -24, -104), (1, 0, 0.34)),
              *((f"{digit} middle palmar", "prop") for digit in ("index", "middle", "ring", "pinky")),
              also="; Cutkosky 1989, hook"),
        _feix(17, "Index Finger Extension", digits((26, 26, 14, 14),
              [(0, 30, 16, 8), (0, 62, 72, 42), (-2, 70, 78, 44), (-4, 74, 78, 42)]),
              Held("cylinder", (18, 170), (-12, -34, -96), (-0.55, -0.22, -0.8)), *_pads("index", "middle", "ring"),
              ("thumb pad", "prop")),
        _feix(18, "Extension Type", digits((30, 46, 4, 2), _fingers(52, 14, 8)),
              Held("box", (140, 12, 110), (-20, -66, -129), (0, -0.8, -0.6)), *finger_pads[:3], ("thumb pad", "prop")),
        _feix(19, "Distal Type", digits((26, 38, 14, 18), _fingers(46, 34, 22)),
              Held("cylinder", (18, 100), (-6, -62, -112), (0.95, 0, 0.2)), *FIVE_PADS),
        _feix(26, "Sphere 4-Finger", digits((24, 46, 6, 14), [(3, 40, 40, 24), (0, 42, 40, 24), (3, 44, 40, 24),
              (-2, 62, 66, 38)]), Held("sphere", (55,), (-14, -58, -106)), *_pads("thumb", "index", "middle", "ring")),
        _feix(28, "Sphere 3-Finger", digits((24, 42, 6, 16), [(3, 44, 42, 26), (-2, 46, 44, 26), (-2, 70, 76, 42),
              (-4, 74, 74, 40)]), Held("sphere", (50,), (-24, -54, -104)), *_pads("thumb", "index", "middle")),
        _feix(30, "Palmar", digits((16, -12, 8, 6), _fingers(74, 22, 12)),
              Held("box", (100, 30, 70), (8, -36, -62), (0, 0.1, 1)), PALM, *finger_pads[:3]),
        _feix(31, "Ring", digits((18, 46, 6, 22), [(2, 42, 46, 28), (0, 58, 62, 36), (-2, 66, 68, 38),
              (-4, 70, 66, 36)]),
              Held("cylinder", (50, 130), (-36, -44, -96), (0.5, -0.45, 0.75)), *_pads("thumb", "index"),
              ("index proximal palmar", "prop")),
    ] + [
        Goal("clenched_rope", "grasp", "a thin rope held in the fist", digits((38, 32, 40, 44), "closed"),
             (PALM, ("thumb pad", "middle middle dorsal")), Held("cylinder", (10, 160), (4, -26, -80), (1, 0, 0.25))),
    ]  # fmt: skip


def _intermediate() -> list[Goal]:
    curl: list[str | Row] = [(0, 46, 58, 34), (0, 54, 62, 36), (-1, 60, 64, 38), (-2, 62, 62, 36)]
    return [
        _feix(16, "Lateral", digits((20, -4, 16, 16), curl),
              Held("box", (54, 1.5, 86), (-52, -34, -124), (-0.5, -0.3, -1), (0.3, -0.9, 0.2)),
              ("thumb pad", "prop"), ("index middle radial", "prop"), also="; Cutkosky 1989, 16"),
        _feix(20, "Writing Tripod", digits((28, 32, 14, 24), [(0, 46, 46, 14), (0, 52, 54, 30), (-2, 58, 58, 32),
              (-4, 60, 56, 30)]), Held("cylinder", (9, 140), (-34, -38, -112), (-0.15, 0.75, 0.45)),
              *_pads("thumb", "index"), ("middle distal radial", "prop")),
        _feix(21, "Tripod Variation", digits((26, 30, 12, 22), [(2, 42, 40, 14), (0, 48, 44, 24), (-2, 60, 58, 32),
              (-4, 62, 56, 30)]), Held("cylinder", (7, 160), (-26, -42, -122), (-0.2, 0.75, 0.4)),
              ("thumb pad", "prop"), ("index distal ulnar", "prop"), ("middle distal radial", "prop")),
        _feix(23, "Adduction Grip", digits((2, 12, 8, 12), [(-2, 8, 14, 8), (-2, 10, 14, 8), (2, 22, 26, 14),
              (4, 26, 28, 16)]), Held("cylinder", (8, 85), (-16, -4, -150), (0.0, 1, 0.2)),
              ("index middle ulnar", "prop"), ("middle middle radial", "prop")),
        _feix(25, "Lateral Tripod", digits((24, 8, 14, 18), [(0, 44, 48, 26), (0, 50, 50, 28), (-2, 58, 56, 32),
              (-4, 60, 54, 30)]), Held("cylinder", (20, 30), (-42, -34, -118), (0.7, -0.2, 0.6)),
              ("thumb pad", "prop"), ("index distal radial", "prop"), ("middle distal radial", "prop")),
        _feix(29, "Stick", digits((22, 2, 16, 16), [(0, 48, 58, 34), (0, 56, 64, 38), (-1, 62, 68, 40),
              (-2, 64, 66, 38)]),
              Held("cylinder", (8, 200), (-36, -34, -104), (0.55, -0.05, -0.8)),
              ("thumb pad", "prop"), ("index middle radial", "prop")),
        _feix(32, "Ventral", digits((20, 8, 10, 14), [(0, 36, 46, 28), (0, 56, 70, 40), (-1, 66, 74, 42),
              (-2, 70, 72, 40)]),
              Held("cylinder", (20, 130), (-42, -36, -104), (0.45, -0.5, -0.7)),
              ("thumb pad", "prop"), ("index middle radial", "prop")),
    ]  # fmt: skip


def _precision() -> list[Goal]:
    folded: list[str | Row] = [(-2, 62, 66, 38), (-4, 66, 62, 36)]
    bar = (0.95, 0.0, 0.2)
    return [
        _feix(6, "Prismatic 4 Finger", digits((36, 38, 10, 10), [(0, 54, 34, 16), (0, 56, 36, 18), (-2, 60, 34, 16),
              (-4, 66, 28, 12)]), Held("cylinder", (10, 150), (-6, -68, -106), bar),
              *FIVE_PADS, also="; Cutkosky 1989, 6"),
        _feix(7, "Prismatic 3 Finger", digits((36, 38, 10, 10), [(0, 54, 34, 16), (0, 56, 36, 18), (-2, 60, 34, 16),
              (4, 50, 36, 20)]), Held("cylinder", (10, 140), (-10, -68, -106), bar),
              *_pads("thumb", "index", "middle", "ring"), also="; Cutkosky 1989, 7"),
        _feix(8, "Prismatic 2 Finger", digits((34, 34, 12, 10), [(-2, 54, 34, 16), (0, 56, 36, 18), (-1, 54, 50, 28),
              (0, 54, 48, 28)]), Held("cylinder", (10, 120), (-16, -66, -108), bar),
              *_pads("thumb", "index", "middle"), also="; Cutkosky 1989, 8"),
        _feix(9, "Palmar Pinch", digits((30, 26, 12, 8), [(-4, 56, 32, 14), (0, 40, 34, 18), (0, 38, 34, 18),
              (0, 34, 32, 18)]), Held("box", (16, 8, 16), (-28, -60, -108), (0, 0.5, 1)),
              *_pads("thumb", "index"), also="; Cutkosky 1989, 9"),
        _feix(12, "Precision Disk", digits((2, 44, 2, 20), _fingers(22, 46, 30, 12)),
              Held("disk", (84, 12), (-8, -64, -104), (0, 1, 0.15)), *FIVE_PADS,
              also="; Cutkosky 1989, 12"),
        _feix(13, "Precision Sphere", digits((18, 46, 4, 18), _fingers(36, 42, 26, 7)),
              Held("sphere", (62,), (-8, -66, -106)), *FIVE_PADS,
              also="; Cutkosky 1989, 13"),
        _feix(14, "Tripod", digits((30, 36, 8, 16), [(0, 50, 38, 20), (-1, 52, 40, 22), *folded]),
              Held("sphere", (28,), (-24, -62, -106)), *_pads("thumb", "index", "middle"), also="; Cutkosky 1989, 14"),
        _feix(22, "Parallel Extension", digits((34, 46, 4, 2), _fingers(58, 8, 4)),
              Held("box", (130, 22, 60), (-6, -66, -100), (0, -1, -0.6)),
              *FIVE_PADS),
        _feix(24, "Tip Pinch", digits((32, 26, 14, 40), [(-4, 50, 46, 34), (0, 36, 34, 18), (0, 34, 34, 18),
              (0, 30, 32, 18)]), Held("cylinder", (3, 40), (-30, -62, -104), (0.4, 0.5, 0.7)),
              ("thumb tip", "prop"), ("index tip", "prop")),
        _feix(27, "Quadpod", digits((32, 40, 8, 16), [(0, 50, 36, 20), (0, 50, 40, 22), (-1, 56, 36, 20),
              (-2, 62, 56, 32)]), Held("sphere", (34,), (-14, -68, -106)), *_pads("thumb", "index", "middle", "ring")),
        _feix(33, "Inferior Pincer", digits((30, 28, 8, 0), [(-2, 60, 22, 2), (0, 34, 30, 16), (0, 32, 30, 16),
              (0, 28, 28, 16)]), Held("sphere", (18,), (-30, -62, -110)), *_pads("thumb", "index")),
    ]  # fmt: skip


def _others() -> list[Goal]:
    return [
        Goal("platform", "grasp", "Cutkosky 1989, platform push (nothing is grasped)",
             digits((-20, -12, -2, 0), [(3, -2, 6, 3), (0, -2, 6, 3), (3, -2, 6, 3), (6, -2, 6, 3)]),
             (PALM, *FIVE_PADS[1:]), Held("box", (160, 12, 180), (0, -28, -110), (0, 0, 1))),
        Goal("mouse", "grasp", "a computer's mouse", digits((6, 18, 8, 12),
             [(2, 14, 26, 14), (-2, 14, 28, 14), (5, 26, 34, 18), (8, 30, 34, 18)]),
             _pads("index", "middle"), Held("box", (52, 26, 95), (-12, -36, -110), (0, -0.15, -1))),
        Goal("pistol_grip", "grasp", "a controller's handle, index finger on the trigger", digits((24, 30, 16, 20),
             [(0, 30, 46, 22), (0, 58, 66, 38), (-1, 60, 66, 38), (-2, 62, 64, 36)]),
             (PALM, *_pads("middle", "ring", "pinky")), Held("cylinder", (34, 120), (6, -34, -76), (1, 0, 0.35))),
    ]  # fmt: skip
