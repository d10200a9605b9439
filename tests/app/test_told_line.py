"""What the markers of a performer measure, in the tracking panel."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtWidgets import QApplication

from app.panels.told_line import told_title
from core.observability import AngleTold, Observability, observability
from core.profile import load_profile


def test_the_title_counts_angles_of_digits_alone():
    def told(*shares):
        return Observability(tuple(AngleTold("", share, 0.1) for share in (*[1.0] * 6, *shares)), ())

    assert told_title(told(*[1.0] * 20)) == "20 of 20 joint angles"
    assert told_title(told(*[1.0] * 16, 0.9, 0.89, 0.5, 0.49)) == "17 of 20 joint angles, 2 in part"


def test_each_performers_line_follows_what_is_worn(window, qtbot):
    box = window.tracking.performers
    line = box.blocks[0].told
    qtbot.waitUntil(lambda: line.text() == "17 of 20 joint angles, 3 in part", timeout=60_000)
    assert "DIP of the index, middle and ring fingers" in line.toolTip()
    box.blocks[0].profile.choose("schroeder8")
    expected = observability(load_profile("schroeder8"))
    qtbot.waitUntil(lambda: line.text() == told_title(expected), timeout=60_000)
    tip = " ".join(line.toolTip().split())
    assert all(words in tip for words in expected.words)
    assert max(map(len, line.toolTip().splitlines())) <= 100
    box.add_performer("schroeder17")
    second = box.blocks[1].told
    qtbot.waitUntil(lambda: second.text() == "20 of 20 joint angles", timeout=60_000)
    assert line.text() == told_title(expected)
    window.undo.undo()  # gone, with its line
    window.undo.undo()
    qtbot.waitUntil(lambda: line.text() == "17 of 20 joint angles, 3 in part", timeout=60_000)


def test_another_name_is_nothing_new_and_a_performer_may_go_before_the_answer(window, qtbot, monkeypatch):
    from app.panels import told_line

    box, asked = window.tracking.performers, []
    line = box.blocks[0].told
    qtbot.waitUntil(lambda: line.text().startswith("17"), timeout=60_000)
    held = []
    monkeypatch.setattr(window.worker, "background", lambda work, done: held.append((work, done)))
    monkeypatch.setattr(told_line, "observability", lambda profile: asked.append(profile))
    window.worker.set_profile(replace(load_profile("han19"), performer="Ann"), 0)
    qtbot.waitUntil(lambda: window.worker.session.profile.performer == "Ann", timeout=10_000)
    assert not held
    box.add_performer("schroeder6")
    qtbot.waitUntil(lambda: len(box.blocks) == 2 and bool(held), timeout=10_000)
    told = observability(load_profile("schroeder6"))
    gone = box.blocks[1].told
    box.remove_performer(1)
    qtbot.waitUntil(lambda: len(box.blocks) == 1, timeout=10_000)
    gone.deleteLater()
    QApplication.sendPostedEvents(None, 52)  # deferred deletes
    for _, done in held:
        done(told)  # nobody is there to hear it
    assert line.text().startswith("17")
