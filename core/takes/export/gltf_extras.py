"""What a .glb file says beside its geometry, in `extras`, where glTF leaves room for it.

Only numbers, texts, and lists of numbers or of objects: others do not become custom properties in Blender.
"""

from __future__ import annotations

import math

from core.frames import HandKey
from core.gltf import Document
from core.hand.joint_axes import JointAxes
from core.takes.export.content import Content
from core.takes.export.held import HeldSpan
from core.takes.take import program_version


def asset(content: Content) -> Document:
    """The format's version, and what wrote the file, in which units, at what rate, and from what."""
    facts = {"program": "Phalanx", "version": program_version(), "unit": "m", "up": "Y"}
    return {
        "version": "2.0",
        "generator": f"Phalanx {program_version()}",
        "extras": facts | {"rate_hz": content.grid.rate_hz} | _made(content),
    }


def _made(content: Content) -> Document:
    """From which file, with which profiles, and how."""
    made = content.made
    profiles = [
        {"performer": profile.performer, "layout": profile.layout.name, "sha256": sha256}
        for profile, sha256 in zip(content.cast, made.profiles_sha256, strict=True)
    ]
    source = {"source": content.solution.file, "source_sha256": made.source_sha256}
    said: Document = {name: text for name, text in source.items() if text}
    return said | {"profiles": profiles} | ({"settings": "; ".join(made.lines)} if made.settings else {})


def of_take(content: Content) -> Document:
    """Of the scene and of its animation: name, performer, shot, rating, notes, date and marks, where there are any."""
    info = content.solution.info
    performers = ", ".join(content.performers) or content.cast[0].performer or (info.performer if info else "")
    about: Document = {"take": content.solution.name, "rate_hz": content.timeline.rate_hz}
    if performers:
        about["performer"] = performers
    if info:
        said = {"shot": info.shot, "rating": info.rating, "notes": info.notes}
        about |= {key: text for key, text in said.items() if text}
        about["created_utc"] = info.created_utc.isoformat()
    marks = [
        {"time_s": float(mark.time_s), "text": mark.text}
        for mark in content.solution.marks
        if math.isfinite(mark.time_s)
    ]
    return about | ({"marks": marks} if marks else {})


def of_hand(content: Content, hand: HandKey) -> Document:
    """Whose it is, which, and from when to when its pose is held."""
    performer = content.performers[hand.performer]
    return {"hand": hand.side} | ({"performer": performer} if performer else {}) | _held(content, content.held(hand))


def of_prop(content: Content, name: str) -> Document:
    """The `extras` of a prop's node, if there is anything to say: from when to when its pose is held."""
    held = _held(content, content.held(name))
    return {"extras": held} if held else {}


def of_joint(axes: JointAxes, joint: int) -> Document:
    """Unit vectors in the node's own frame: along its bone, and the axes of its angles where it has any."""
    vectors = (("bone", axes.bones), ("flexion_axis", axes.flexion), ("abduction_axis", axes.abduction))
    return {name: rows[joint].tolist() for name, rows in vectors if not math.isnan(rows[joint, 0])}


def _held(content: Content, spans: tuple[HeldSpan, ...]) -> Document:
    """Short lacks of frames are no holding where keys stand at the frames' own times: between two the hand moves on."""
    even = content.options.rate_hz is not None
    held = [
        {"from_s": span.from_s, "to_s": span.to_s, "reason": span.reason}
        for span in spans
        if even or not span.blended(content.timeline.rate_hz)
    ]
    return {"held": held} if held else {}
