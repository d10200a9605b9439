"""Sketches of poses in which the hand holds nothing."""

from __future__ import annotations

from core.hand.skeleton import DIGITS
from resources.motion.goal import Goal, Row, digits, up

FINGERS = DIGITS[1:]


def free_hand_goals() -> list[Goal]:
    """All of them, activity by activity."""
    return [*_rest(), *_extreme(), *_pinches(), *_counting(), *_letters(), *_numbers(), *_handshapes(), *_gestures(),
            *_piano()]  # fmt: skip


def _rest() -> list[Goal]:
    def rest(name: str, what: str, sketch: tuple[Row, Row, Row, Row, Row]) -> Goal:
        return Goal(name, "rest", what, sketch)

    return [
        rest("rest_flat", "flat on a table, fingers a little apart", digits((-8, -4, 0, -2), "straight", (2, 0, 2, 4))),
        rest("rest_hanging", "arm hanging at the side", digits((12, 16, 14, 20),
             [(0, 24, 30, 16), (0, 30, 34, 18), (-1, 34, 36, 20), (-2, 36, 34, 20)])),
        rest("rest_on_table", "forearm on a table, fingers arched", digits((6, 18, 10, 16),
             [(2, 22, 34, 18), (0, 26, 38, 20), (1, 26, 38, 20), (2, 24, 34, 20)])),
        rest("rest_lap", "palm up in the lap", digits((4, 10, 12, 18),
             [(1, 30, 44, 26), (0, 38, 48, 28), (-1, 44, 50, 30), (-2, 46, 46, 28)])),
        rest("rest_open", "open and soft", digits((-6, 8, 4, 6),
             [(6, 6, 12, 6), (0, 8, 14, 8), (4, 9, 14, 8), (8, 8, 12, 8)])),
        rest("rest_loose_fist", "fingers fallen shut", digits((24, 26, 28, 30), "loosely closed", "closed")),
        rest("rest_function", "position of function in the clinic", digits((14, 34, 16, 18),
             [(2, 38, 34, 16), (0, 42, 36, 18), (-1, 46, 38, 18), (-2, 48, 36, 18)])),
    ]  # fmt: skip


def _extreme() -> list[Goal]:
    loose = [(0, 14, 18, 10), (0, 16, 20, 11), (0, 18, 22, 12), (0, 18, 20, 12)]
    thumb = (4, 14, 8, 12)

    def one(finger: str, row: Row, name: str, what: str) -> Goal:
        rows: list[str | Row] = list(loose)
        rows[FINGERS.index(finger)] = row
        return Goal(f"{finger}_{name}", "extreme", what, digits(thumb, rows))

    def whole(name: str, what: str, sketch: tuple[Row, Row, Row, Row, Row], *contacts: tuple[str, str]) -> Goal:
        return Goal(name, "extreme", what, sketch, contacts)

    goals = [
        whole("spread", "abduction of all digits", digits((-24, 6, -8, -10),
              [(21, -8, 0, 0), (0, -8, 0, 0), (19, -8, 0, 0), (22, -8, 0, 0)])),
        whole("adducted", "digits held together", digits("along", "straight", "together"),
              ("index proximal ulnar", "middle proximal radial")),
        whole("hyperextended", "all fingers bent back", digits((-26, 4, -14, -18),
              [(4, -34, -8, -6), (0, -34, -8, -6), (4, -34, -8, -6), (8, -34, -8, -6)])),
        whole("intrinsic_plus", "MCP flexed, IP straight", digits((22, 30, 6, 2), "bent", (0, 0, 0, -2))),
        whole("intrinsic_minus", "MCP bent back, IP flexed", digits((-14, -4, -8, 34),
              [(2, -28, 88, 52), (0, -28, 90, 54), (2, -28, 88, 52), (4, -28, 84, 50)])),
        whole("hook_fist", "tendon gliding: hook", digits((-10, 2, 2, 6), [(-1, 0, 102, 62), (0, 0, 104, 64),
              (-1, 0, 102, 62), (-3, 0, 98, 60)])),
        whole("straight_fist", "tendon gliding: straight fist", digits((4, 6, 12, 14), "flat fist")),
        whole("full_fist", "tendon gliding: full fist", digits("across", "closed")),
        whole("fist_thumb_inside", "thumb under the fingers", digits((44, 30, 46, 40),
              [(-1, 70, 84, 50), (0, 74, 82, 50), (-1, 78, 86, 50), (-3, 80, 86, 48)])),
        whole("tabletop", "tendon gliding: table top", digits((-14, 2, -4, -6), "bent", (0, 0, 0, -2))),
        whole("fingers_to_ulnar", "fingers swept to the little finger's side", digits((-20, 0, -6, -8),
              [(-14, 6, 8, 4), (-17, 2, 6, 3), (17, -2, 6, 3), (21, -6, 5, 3)])),
        whole("fingers_to_radial", "fingers swept to the thumb's side", digits("along",
              [(20, -4, 6, 3), (18, 2, 6, 3), (-12, 5, 8, 4), (-12, 10, 10, 5)])),
        whole("claw_spread", "spread and clawed", digits((-20, 10, 4, 40),
              [(14, -10, 66, 44), (0, -10, 68, 46), (12, -10, 66, 44), (18, -10, 64, 42)])),
        whole("duck_bill", "fingers half bent, thumb below", digits((26, 42, 12, 2), "half bent", "closed")),
    ]  # fmt: skip
    for finger in FINGERS:
        goals.append(one(finger, (0, -36, -8, -8), "back", "one finger bent back"))
    for finger in FINGERS:
        goals.append(one(finger, (0, 93, 8, 4), "knuckle", "one finger bent at the knuckle"))
    for finger in FINGERS:
        goals.append(one(finger, (0, 4, 110, 76), "hooked", "one finger bent at its last two joints"))
    for finger in FINGERS:
        goals.append(one(finger, (0, 86, 104, 60), "curled_in", "one finger into the palm"))
    for finger, side, abduction in (
        ("index", "out", 23), ("middle", "out", 14), ("ring", "out", 18), ("pinky", "out", 23),
    ):  # fmt: skip
        goals.append(one(finger, (abduction, 2, 4, 2), f"{side}wards", "one finger abducted"))
    thumbs: dict[str, tuple[str, Row]] = {
        "thumb_back": ("thumb bent back, hitch-hiker's", (-28, 0, -18, -22)),
        "thumb_radial": ("thumb stretched in the plane of the palm", (-27, -20, -4, -4)),
        "thumb_palmar": ("thumb stretched away from the palm", (-4, 56, 0, 0)),
        "thumb_flexed": ("thumb bent at its last two joints", (10, 10, 64, 84)),
        "thumb_across_palm": ("thumb swept across the palm", (48, 30, 40, 20)),
        "thumb_along": ("thumb beside the index finger", (16, -16, 4, 2)),
    }
    goals += [Goal(name, "extreme", what, digits(row, loose)) for name, (what, row) in thumbs.items()]
    return goals


def _pinches() -> list[Goal]:
    bent: dict[str, Row] = {
        "index": (-6, 56, 42, 26), "middle": (0, 58, 44, 28), "ring": (-2, 64, 44, 28), "pinky": (-6, 66, 40, 26),
    }  # fmt: skip
    thumb: dict[str, Row] = {
        "index": (32, 24, 14, 20), "middle": (38, 32, 14, 22), "ring": (44, 36, 24, 26), "pinky": (48, 36, 40, 30),
    }  # fmt: skip
    follow = {"index": (0, 30, 24, 12), "middle": (0, 34, 30, 16), "ring": (-1, 36, 32, 18), "pinky": (-2, 34, 30, 18)}

    def pinch(name: str, what: str, finger: str, thumb_row: Row, row: Row, *contacts: tuple[str, str]) -> Goal:
        rows: list[str | Row] = [row if other == finger else follow[other] for other in FINGERS]
        return Goal(name, "pinch", what, digits(thumb_row, rows), contacts)

    goals: list[Goal] = []
    for finger in FINGERS:
        goals.append(pinch(f"tip_pinch_{finger}", "thumb tip to finger tip", finger,
                           (*thumb[finger][:3], 40.0), bent[finger], ("thumb tip", f"{finger} tip")))  # fmt: skip
    for finger in FINGERS:
        a, mcp, pip, dip = bent[finger]
        goals.append(pinch(f"pad_pinch_{finger}", "thumb pad to finger pad", finger,
                           (*thumb[finger][:3], 4.0), (a, mcp + 8, pip - 14, dip - 18),
                           ("thumb pad", f"{finger} pad")))  # fmt: skip
    goals += [
        Goal("key_pinch", "pinch", "thumb pad to the side of the index finger", digits((22, -6, 20, 20),
             [(0, 48, 62, 36), (0, 56, 68, 40), (-1, 62, 70, 42), (-2, 64, 68, 40)]),
             (("thumb pad", "index middle radial"),)),
        Goal("side_pinch_distal", "pinch", "thumb pad to the side of the index finger's end", digits((20, -4, 14, 14),
             [(2, 34, 42, 26), (0, 44, 50, 30), (-1, 50, 54, 32), (-2, 52, 52, 32)]),
             (("thumb pad", "index distal radial"),)),
        Goal("three_jaw_chuck", "pinch", "thumb, index and middle finger", digits((38, 34, 12, 14),
             [(-4, 56, 34, 18), (3, 56, 38, 20), (0, 50, 40, 24), (-2, 52, 40, 24)]),
             (("thumb pad", "index pad"), ("thumb pad", "middle pad"))),
        Goal("all_tips", "pinch", "all five tips together", digits((40, 40, 10, 16),
             [(-6, 58, 34, 20), (0, 58, 36, 22), (-8, 62, 34, 20), (-14, 68, 28, 16)]),
             (("thumb pad", "index tip"), ("thumb pad", "middle tip"), ("thumb tip", "ring tip"))),
    ]  # fmt: skip
    # Kapandji 1986: how far the thumb's tip comes across the hand, 0 to 10; 3 to 6 are tips of the fingers.
    kapandji: tuple[tuple[int, str, Row, Row, str], ...] = (
        (2, "side of the index finger's second phalanx", (22, 0, 22, 22), (-2, 22, 26, 14), "index middle radial"),
        (8, "little finger's second phalanx", (48, 30, 46, 40), (-2, 44, 44, 26), "pinky middle palmar"),
        (9, "little finger's first phalanx", (48, 24, 52, 50), (-2, 66, 50, 30), "pinky proximal palmar"),
    )
    for score, where, row, pinky, place in kapandji:
        sketch = digits(row, [(0, 14, 18, 10), (0, 18, 22, 12), (-1, 0.6 * pinky[1], 0.7 * pinky[2], 16), pinky])
        goals.append(Goal(f"opposition_{score}", "pinch", f"Kapandji 1986, score {score}: {where}", sketch,
                          (("thumb tip", place),)))  # fmt: skip
    return goals


def _counting() -> list[Goal]:
    def count(where: str, n: int, sketch: tuple[Row, Row, Row, Row, Row], *contacts: tuple[str, str]) -> Goal:
        return Goal(f"count_{where}_{n}", "counting", f"{where.capitalize()} finger counting, {n}", sketch, contacts)

    holds_two = (("thumb pad", "ring middle dorsal"),)
    return [
        count("european", 1, digits("up", "closed")),
        count("european", 2, digits("out", up("index"), (8, 0, 0, 0))),
        count("european", 3, digits("out", up("index", "middle"), (9, -4, 0, 0))),
        count("european", 4, digits("out", [(8, 0, 4, 2), (0, 2, 5, 3), (4, 10, 14, 8), (-4, 70, 84, 46)])),
        count("european", 5, digits((-20, 2, -6, -8), "straight", "spread")),
        count("american", 1, digits((42, 30, 36, 40), up("index")), ("thumb pad", "middle middle dorsal")),
        count("american", 2, digits((44, 32, 40, 40), up("index", "middle"), (9, -6, 0, 0)), *holds_two),
        count("american", 3, digits((46, 30, 50, 44), [(9, 0, 4, 2), (0, 0, 4, 2), (8, 2, 6, 4), (-8, 78, 84, 48)]),
              ("thumb pad", "pinky distal dorsal")),
        count("american", 4, digits("palm", "straight", (9, 0, 7, 12))),
        count("chinese", 3, digits((34, 22, 14, 12), [(-9, 60, 36, 20), (2, 4, 8, 4), (6, 2, 6, 4), (12, 0, 6, 4)]),
              ("thumb pad", "index pad")),
        count("chinese", 6, digits("out", up("pinky"), (0, 0, 0, 14))),
        count("chinese", 7, digits((38, 36, 12, 14), [(-4, 60, 32, 16), (3, 60, 34, 18), "closed", "closed"]),
              ("thumb pad", "index pad"), ("thumb pad", "middle pad")),
        count("chinese", 8, digits((-26, 6, -8, -10), up("index"), (10, 0, 0, 0))),
        count("chinese", 9, digits((40, 26, 44, 44), [(0, 4, 92, 50), "closed", "closed", "closed"])),
        count("chinese", 10, digits((36, 22, 36, 40), "closed"), ("thumb pad", "index middle dorsal")),
    ]  # fmt: skip


def _letters() -> list[Goal]:
    """The static letters of American Sign Language; J and Z are the shapes of I and of a pointing finger, moved."""

    def asl(letter: str, sketch: tuple[Row, Row, Row, Row, Row], *contacts: tuple[str, str]) -> Goal:
        return Goal(f"asl_{letter.lower()}", "sign", f"American manual alphabet, {letter}", sketch, contacts)

    holds_two = ("thumb pad", "ring middle dorsal")
    return [
        asl("A", digits((6, -16, 6, 6), "closed"), ("thumb pad", "index middle radial")),
        asl("B", digits((42, 8, 46, 34), "straight", "together"), ("index proximal ulnar", "middle proximal radial")),
        asl("C", digits((14, 48, 8, 18), [(0, 42, 42, 26), (0, 44, 44, 28), (-3, 46, 44, 28), (-6, 48, 42, 26)])),
        asl("D", digits((38, 36, 12, 16), [(0, 0, 4, 2), (0, 62, 50, 28), (-2, 66, 50, 28), (-4, 70, 48, 28)]),
            ("thumb pad", "middle pad")),
        asl("E", digits((44, 30, 44, 34), [(-2, 44, 102, 58), (0, 46, 102, 58), (-2, 50, 102, 58), (-4, 54, 98, 56)])),
        asl("F", digits((34, 22, 14, 14), [(-8, 58, 42, 24), (0, 2, 4, 2), (7, 0, 4, 2), (13, -2, 5, 2)]),
            ("thumb pad", "index pad")),
        asl("G", digits((26, 12, 4, 4), [(0, 40, 8, 4), "closed", "closed", "closed"])),
        asl("H", digits((40, 20, 44, 42), [(-4, 30, 5, 3), (0, 30, 5, 3), "closed", "closed"]), holds_two,
            ("index proximal ulnar", "middle proximal radial")),
        asl("I", digits("across", up("pinky"))),
        asl("K", digits((30, -8, 36, 28), [(8, 2, 4, 2), (-6, 54, 8, 4), "closed", "closed"]),
            ("thumb tip", "middle proximal palmar")),
        asl("L", digits((-22, -16, -4, -6), up("index"), (2, 0, 0, 0))),
        asl("M", digits((46, 26, 44, 26), [(-2, 68, 58, 32), (0, 70, 60, 34), (-2, 74, 62, 34), (-6, 84, 92, 50)])),
        asl("N", digits((44, 26, 40, 26), [(-2, 70, 58, 32), (0, 72, 60, 32), "closed", "closed"])),
        asl("O", digits((34, 40, 10, 22), [(-4, 54, 46, 28), (0, 56, 46, 28), (-6, 58, 46, 28), (-12, 62, 42, 26)]),
            ("thumb tip", "index tip"), ("thumb tip", "middle tip")),
        asl("P", digits((32, -6, 36, 26), [(6, 16, 5, 3), (-6, 70, 8, 4), (-2, 78, 88, 48), (-4, 80, 84, 44)]),
            ("thumb tip", "middle proximal palmar")),
        asl("Q", digits((18, 30, 6, 8), [(0, 52, 10, 6), "closed", "closed", "closed"])),
        asl("R", digits((44, 30, 42, 42), [(-14, 12, 4, 2), (17, -4, 18, 10), "closed", "closed"]), holds_two,
            ("middle pad", "index distal dorsal")),
        asl("S", digits((40, 32, 42, 50), "closed"), ("thumb pad", "middle middle dorsal")),
        asl("T", digits((34, -2, 14, 10), [(6, 58, 78, 46), (-2, 80, 94, 52), "closed", "closed"]),
            ("thumb pad", "middle middle radial"), ("index pad", "thumb distal dorsal")),
        asl("U", digits((44, 30, 42, 42), up("index", "middle"), (-5, 0, 0, 0)), holds_two,
            ("index proximal ulnar", "middle proximal radial")),
        asl("V", digits((44, 30, 42, 42), up("index", "middle"), (12, -10, 0, 0)), holds_two),
        asl("W", digits((46, 30, 50, 44), [(12, 0, 4, 2), (0, 0, 4, 2), (10, 2, 6, 4), (-8, 78, 84, 48)]),
            ("thumb pad", "pinky distal dorsal")),
        asl("X", digits((38, 26, 42, 40), [(0, 22, 84, 46), "closed", "closed", "closed"]),
            ("thumb pad", "middle middle dorsal")),
        asl("Y", digits((-26, 8, -10, -14), up("pinky"), (0, 0, 0, 20))),
    ]  # fmt: skip


def _numbers() -> list[Goal]:
    def asl(n: int, sketch: tuple[Row, Row, Row, Row, Row], *contacts: tuple[str, str]) -> Goal:
        return Goal(f"asl_{n}", "sign", f"American Sign Language, {n}", sketch, contacts)

    return [
        asl(0, digits((36, 34, 14, 34), [(-6, 50, 50, 32), (0, 54, 50, 32), (-5, 58, 50, 32), (-10, 62, 46, 30)]),
            ("thumb tip", "index tip")),
        asl(1, digits((40, 22, 40, 44), [(0, -6, 3, 1), "closed", "closed", "closed"]),
            ("thumb pad", "middle middle dorsal")),
        asl(2, digits((42, 28, 46, 46), [(14, -4, 3, 1), (-12, -4, 3, 1), "closed", "closed"])),
        asl(3, digits((-26, 4, -8, -10), [(12, -2, 4, 2), (-8, -2, 4, 2), "closed", "closed"])),
        asl(4, digits((44, 10, 40, 30), "straight", "spread")),
        asl(5, digits((-22, 0, -6, -8), [(15, -6, 2, 1), (0, -6, 2, 1), (12, -6, 2, 1), (18, -6, 2, 1)])),
        asl(6, digits((48, 36, 38, 24), [(9, 2, 4, 2), (0, 4, 5, 3), (-4, 14, 12, 7), (-10, 68, 44, 26)]),
            ("thumb pad", "pinky tip")),
        asl(7, digits((44, 38, 22, 20), [(9, 0, 4, 2), (0, 6, 8, 4), (-4, 64, 44, 26), (6, 14, 12, 6)]),
            ("thumb pad", "ring tip")),
        asl(8, digits((38, 34, 14, 18), [(9, 0, 4, 2), (0, 60, 44, 26), (5, 12, 10, 5), (12, 2, 6, 4)]),
            ("thumb pad", "middle tip")),
        asl(9, digits((32, 24, 14, 22), [(-6, 52, 50, 30), (-2, -4, 3, 1), (5, -4, 3, 1), (11, -6, 4, 2)]),
            ("thumb tip", "index tip")),
    ]  # fmt: skip


def _handshapes() -> list[Goal]:
    def shape(name: str, sketch: tuple[Row, Row, Row, Row, Row], *contacts: tuple[str, str]) -> Goal:
        return Goal(f"handshape_{name}", "sign", f"handshape of signed languages: {name.replace('_', ' ')}", sketch,
                    contacts)  # fmt: skip

    return [
        shape("claw_5", digits((-10, 24, 8, 40), "claw", (10, 0, 8, 14))),
        shape("bent_b", digits((12, -12, 6, 4), [(-5, 80, 4, 2), (0, 82, 4, 2), (-4, 82, 4, 2), (-8, 80, 4, 2)])),
        shape("flat_b", digits((22, -18, 8, 16), "straight", (-5, 0, -5, -10))),
        shape("bent_v", digits((42, 28, 44, 44), [(10, 6, 82, 46), (-8, 6, 84, 48), "closed", "closed"])),
        shape("horns", digits((42, 30, 38, 40), up("index", "pinky"), (4, 0, 0, 8)),
              ("thumb pad", "middle middle dorsal")),
        shape("ily", digits((-24, 2, -8, -10), up("index", "pinky"), (8, 0, 0, 14))),
        shape("flat_o", digits((36, 40, 10, 4), [(-2, 66, 20, 12), (0, 70, 12, 6), (-5, 72, 12, 6), (-9, 74, 10, 6)]),
              ("thumb pad", "middle pad")),
        shape("baby_o", digits((34, 24, 12, 24), [(-6, 54, 48, 28), "closed", "closed", "closed"]),
              ("thumb tip", "index tip")),
        shape("open_8", digits((20, 40, 8, 8), [(10, -4, 4, 2), (0, 58, 14, 8), (8, 4, 6, 3), (14, -2, 6, 3)])),
        shape("baby_c", digits((8, 34, 8, 24), [(0, 30, 50, 32), "closed", "closed", "closed"])),
        shape("bent_l", digits((-18, 0, 0, 20), [(2, 40, 6, 4), "closed", "closed", "closed"])),
        shape("claw_3", digits((-14, 10, 8, 40), [(9, 2, 62, 38), (-7, 2, 64, 40), "closed", "closed"])),
        shape("flat_c", digits((12, 50, 2, 2), [(-3, 64, 8, 4), (0, 66, 8, 4), (-4, 68, 8, 4), (-8, 70, 8, 4)])),
        shape("open_a", digits((-26, -4, -10, -12), [(-2, 84, 96, 50), (0, 86, 98, 52), (-2, 88, 96, 50),
              (-4, 90, 88, 44)])),
    ]  # fmt: skip


def _gestures() -> list[Goal]:
    def gesture(name: str, what: str, sketch: tuple[Row, Row, Row, Row, Row], *contacts: tuple[str, str]) -> Goal:
        return Goal(name, "gesture", what, sketch, contacts)

    return [
        gesture("pointing", "index finger out, thumb at ease", digits((20, 6, 24, 26),
                [(0, 2, 6, 3), (0, 74, 88, 48), (-2, 80, 90, 50), (-4, 82, 84, 44)])),
        gesture("ok_sign", "ring of thumb and index finger", digits((32, 26, 14, 24),
                [(-7, 52, 48, 30), (0, 10, 12, 6), (5, 6, 10, 5), (10, 2, 8, 4)]), ("thumb pad", "index tip")),
        gesture("thumb_up", "thumbs up", digits((-25, 8, -12, -16), "closed")),
        gesture("victory", "peace", digits((44, 28, 44, 42),
                [(14, 2, 6, 3), (-11, 2, 6, 3), (-2, 84, 94, 50), (-4, 86, 86, 44)]),
                ("thumb pad", "ring middle dorsal")),
        gesture("call_me", "telephone", digits((-22, 16, -10, -12),
                [(-2, 78, 92, 50), (0, 82, 94, 52), (-2, 80, 90, 48), (16, 8, 10, 6)])),
        gesture("stop", "flat hand, palm out", digits((-2, -14, 4, 2), [(-3, -6, 2, 1), (0, -6, 2, 1), (-3, -6, 2, 1),
                (-6, -6, 2, 1)])),
        gesture("beckon_one", "index finger beckons", digits((38, 26, 42, 42),
                [(0, 26, 62, 36), "closed", "closed", "closed"])),
        gesture("beckon_all", "come here", digits((4, 14, 8, 12),
                [(0, 40, 36, 20), (0, 48, 40, 22), (-1, 54, 40, 22), (-2, 58, 38, 20)])),
        gesture("snap_ready", "snap, before", digits((40, 30, 14, 10),
                [(4, 34, 28, 16), (0, 62, 34, 10), (-2, 72, 74, 42), (-4, 76, 76, 42)]), ("thumb pad", "middle pad")),
        gesture("snap_done", "snap, after", digits((20, 10, 14, 24),
                [(4, 30, 26, 14), (0, 84, 78, 44), (-2, 80, 86, 48), (-4, 82, 82, 46)])),
        gesture("gun", "finger gun", digits((-22, 10, -8, -8), [(-3, 0, 4, 2), (0, 2, 5, 3), "closed", "closed"])),
        gesture("fist_bump", "fist, thumb in front", digits((40, 26, 46, 48), [(-2, 80, 94, 50), (0, 84, 96, 52),
                (-2, 86, 94, 50), (-4, 88, 88, 46)])),
        gesture("vulcan", "fingers parted in the middle", digits((-20, 2, -6, -8),
                [(-3, 0, 3, 1), (11, 0, 3, 1), (11, 0, 3, 1), (4, 0, 3, 1)])),
        gesture("fingers_crossed", "good luck", digits((42, 28, 42, 42),
                [(-13, 10, 6, 3), (16, -2, 24, 14), (-2, 80, 90, 50), (-4, 82, 86, 46)]),
                ("middle pad", "index distal dorsal")),
        gesture("money", "thumb rubs the fingers", digits((36, 34, 14, 20),
                [(-2, 52, 46, 20), (2, 50, 48, 22), (0, 66, 74, 42), (-2, 70, 72, 42)]),
                ("thumb pad", "index pad")),
        gesture("a_little", "thumb and index finger just apart", digits((20, 24, 10, 12),
                [(0, 34, 40, 24), (0, 70, 84, 46), (-2, 76, 86, 48), (-4, 80, 82, 44)])),
        gesture("finger_heart", "thumb across the index finger", digits((22, 0, 14, 12),
                [(4, 50, 40, 14), "closed", "closed", "closed"]), ("thumb distal ulnar", "index distal radial")),
        gesture("flick_ready", "nail of the middle finger behind the thumb", digits((36, 28, 20, 34),
                [(6, 16, 20, 10), (0, 60, 86, 40), (4, 34, 36, 20), (8, 28, 32, 18)]),
                ("thumb pad", "middle distal dorsal")),
        gesture("air_quotes", "two bent fingers", digits((42, 28, 42, 42),
                [(10, 20, 56, 30), (-6, 22, 58, 32), (-2, 82, 92, 50), (-4, 84, 86, 46)])),
        gesture("wave_hand", "hand half open in greeting", digits((-14, 4, -2, 2),
                [(8, 2, 12, 7), (0, 4, 14, 8), (6, 5, 14, 8), (12, 3, 12, 7)])),
        gesture("little_finger_promise", "hooked little finger", digits("across",
                ["closed", "closed", "closed", (4, 30, 70, 40)])),
    ]  # fmt: skip


def _piano() -> list[Goal]:
    rest: list[Row] = [(4, 24, 40, 24), (0, 28, 44, 26), (3, 27, 42, 26), (6, 22, 36, 22)]
    thumb: Row = (2, 14, 4, 10)

    def play(name: str, what: str, thumb_row: Row, rows: list[Row]) -> Goal:
        return Goal(f"piano_{name}", "piano", what, digits(thumb_row, rows))

    pressed: list[Row] = [(4, 46, 28, 10), (0, 50, 30, 11), (3, 50, 29, 11), (7, 46, 24, 9)]
    lifted: list[Row] = [(a, mcp - 12, pip, dip) for a, mcp, pip, dip in rest]

    def press(*fingers: int) -> list[Row]:
        return [pressed[i] if i in fingers else rest[i] for i in range(4)]

    goals = [
        play("rest", "five fingers on five keys", thumb, rest),
        play("thumb", "thumb pressing", (6, 28, 6, 6), rest),
    ]
    goals += [play(finger, f"{finger} finger pressing", thumb, press(i)) for i, finger in enumerate(FINGERS)]
    goals += [
        play("lifted", "all fingers lifted before the attack", (-6, 4, 0, 2), lifted),
        play("triad", "three notes: fingers 1, 3 and 5", (-4, 26, 2, 4),
             [(9, 20, 34, 20), (0, 44, 30, 12), (8, 24, 36, 22), (13, 40, 22, 8)]),
        play("octave", "stretched over an octave: fingers 1 and 5", (-26, 18, -10, -4),
             [(14, 4, 22, 12), (2, 6, 26, 14), (12, 8, 24, 14), (22, 22, 8, 3)]),
        play("octave_chord", "four notes over an octave: 1, 2, 4 and 5", (-24, 20, -8, -2),
             [(16, 26, 22, 8), (0, 14, 30, 18), (13, 28, 18, 7), (21, 28, 12, 5)]),
        play("thumb_under", "thumb passing under the hand", (40, 46, 14, 10),
             [(2, 26, 36, 22), (0, 38, 32, 14), (2, 26, 38, 24), (6, 20, 34, 22)]),
        play("trill", "index finger down, middle finger up", thumb,
             [(3, 48, 27, 10), (0, 14, 40, 24), (3, 26, 42, 26), (6, 22, 36, 22)]),
    ]  # fmt: skip
    return goals
