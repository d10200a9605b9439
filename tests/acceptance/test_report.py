"""The table of what was opened where, and its place in the guide."""

from __future__ import annotations

import pytest

from tests.acceptance.report import BEGIN, END, Row, markdown, write_into
from tests.data import ROOT

ROWS = [
    Row("glTF", "three.js 1", "whole", "joints", 300, 0.0412, "µm"),
    Row("C3D", "ezc3d 1", "whole", "points", 1000, 0.0, "µm"),
    Row("glTF", "three.js 1", "marks", "joints", 400, 0.0611, "µm"),
]
TABLE = """\
| format | opened in | kinds of takes | compared | values | largest difference |
| --- | --- | --- | --- | --- | --- |
| C3D | ezc3d 1 | 1 | points | 1,000 | none |
| glTF | three.js 1 | 2 | joints | 700 | 0.062 µm |

Not opened, for it was not there: Blender.
"""


def test_a_line_for_each_format_program_and_thing_rounded_up() -> None:
    assert markdown(ROWS, ["Blender", "Blender"]) == TABLE


def test_the_table_replaces_the_one_before(tmp_path) -> None:
    document = tmp_path / "guide.md"
    document.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n", encoding="utf-8")
    write_into(document, TABLE)
    assert document.read_text(encoding="utf-8") == f"before\n{BEGIN}\n{TABLE}{END}\nafter\n"


def test_a_document_without_a_place_for_it_is_left_alone(tmp_path) -> None:
    document = tmp_path / "guide.md"
    document.write_text("nothing\n", encoding="utf-8")
    with pytest.raises(ValueError, match="no place for the table"):
        write_into(document, TABLE)
    assert document.read_text(encoding="utf-8") == "nothing\n"


def test_the_guide_has_the_table_of_every_format_and_nothing_missing() -> None:
    text = (ROOT / "docs" / "exports.md").read_text(encoding="utf-8")
    table = text.partition(BEGIN)[2].partition(END)[0]
    assert {line.split("|")[1].strip() for line in table.splitlines()[3:] if line.startswith("|")} == {
        "C3D", "TRC", "CSV", "BVH", "glTF",
    }  # fmt: skip
    assert "Not opened" not in table
