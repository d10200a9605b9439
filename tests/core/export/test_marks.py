"""What an operator said of a take, in the files: marks, notes, rating, shot, performer."""

import csv
import json
import struct
from dataclasses import replace
from datetime import UTC, datetime

import ezc3d
import numpy as np
import pytest

from core.takes.export import ExportOptions, c3d, export
from core.takes.take import Mark, TakeInfo
from tests.core.export.recordings import RATE, solution

NOTES = "Second try – Anna is tired.\n" + "A very long line, in which much is said. " * 10
INFO = TakeInfo(
    "inner name",
    "Anna Lena",
    datetime(2025, 3, 14, 15, 9, 26, tzinfo=UTC),
    RATE,
    notes=NOTES,
    rating="A",
    shot="coffee",
)  # fmt: skip
MARKS = (Mark(0.5, "Grasp"), Mark(1.25, ""), Mark(0.75, "Griff löst sich"))


def marked(marks=MARKS, **changes):
    return replace(solution(lost=()), info=INFO, marks=marks, file="take 1.mcap", **changes)


def parameters(path):
    return {
        group: {name: one["value"] for name, one in values.items() if name != "__METADATA__"}
        for group, values in ezc3d.c3d(str(path))["parameters"].items()
    }


def header_events(path):
    data = path.read_bytes()[:512]
    key, count = struct.unpack_from("<HH", data, 298)
    times = struct.unpack_from("<18f", data, 304)
    labels = [data[396 + 4 * i : 400 + 4 * i].decode() for i in range(18)]
    return key, count, times[:count], data[376 : 376 + count], labels[:count]


def test_marks_are_events_of_c3d(tmp_path):
    path = export(marked(), ["c3d"], tmp_path)[0]
    event = parameters(path)["EVENT"]
    assert event["USED"].tolist() == [3] and event["CONTEXTS"] == ["General"] * 3
    assert event["LABELS"] == ["Grasp", "Griff löst sich", "Mark 3"] and event["SUBJECTS"] == ["Anna Lena"] * 3
    assert np.allclose(event["TIMES"], [[0, 0, 0], [0.5, 0.75, 1.25]], atol=1e-6)
    key, count, times, flags, labels = header_events(path)
    assert (key, count, flags, labels) == (12345, 3, b"\1\1\1", ["Gras", "Grif", "M3  "])
    assert times == pytest.approx((0.5, 0.75, 1.25))
    events = ezc3d.c3d(str(path))["header"]["events"]
    assert events["events_label"][:3] == ("Gras", "Grif", "M3  ")
    assert events["events_time"][:3] == pytest.approx((0.5, 0.75, 1.25))


def test_times_of_events_have_minutes_and_parts_have_their_own(tmp_path, monkeypatch):
    monkeypatch.setattr(c3d, "MAX_FRAMES", 100)
    paths = export(marked(), ["c3d"], tmp_path)[:3]
    times = [parameters(path).get("EVENT", {"TIMES": np.empty((2, 0))})["TIMES"][1] for path in paths]
    begin = 100 / RATE
    assert [list(np.round(one, 5)) for one in times] == [[0.5, 0.75], [round(1.25 - begin, 5)], []]
    from core.takes.export.c3d_events import Event, event_group

    assert event_group([Event(125.5, "x")], "")["EVENT"]["TIMES"].tolist() == [[2.0], [5.5]]


def test_no_marks_no_events(tmp_path):
    paths = export(marked(marks=()), ["c3d"], tmp_path)
    assert [path.name for path in paths] == ["take 1.c3d"]
    assert "EVENT" not in parameters(paths[0]) and header_events(paths[0])[:2] == (0, 0)


def test_more_marks_than_c3d_holds(tmp_path):
    many = tuple(Mark(i * 0.005, f"mark {i} " + "ä" * 300) for i in range(300))
    path, marks = export(marked(marks=many), ["c3d"], tmp_path)
    event = parameters(path)["EVENT"]
    assert len(event["LABELS"]) == 255 and event["TIMES"].shape == (2, 255) and header_events(path)[1] == 18
    assert event["LABELS"][7].startswith("mark 7 ää")
    with marks.open(encoding="utf-8", newline="") as stream:
        assert len(list(csv.DictReader(stream))) == 300


def test_a_mark_keeps_its_frame_where_the_clock_is_not_the_rate(tmp_path):
    """Frames came at 119 Hz, stated as 120: what is marked at the 120th is an event at the 120th of the file."""
    from core.frames import Times

    base = marked()

    def at(frame, i):
        return replace(frame, times=Times(i / 119.0, i / 119.0, i / 119.0))

    slow = replace(
        base,
        raw=tuple(at(frame, i) for i, frame in enumerate(base.raw)),
        solved=tuple(at(frame, i) for i, frame in enumerate(base.solved)),
        marks=(Mark(120 / 119.0, "now"),),
    )
    path, marks = export(slow, ["c3d"], tmp_path)
    assert parameters(path)["POINT"]["RATE"][0] == pytest.approx(119.0, abs=1e-3)
    assert parameters(path)["EVENT"]["TIMES"][1, 0] == pytest.approx(120 / 119.0, abs=1e-5)
    assert marks.read_text().splitlines()[1] == "1.008403,7120,now,1.008403"


def test_c3d_says_whose_take_it_is(tmp_path):
    said = parameters(export(marked(), ["c3d"], tmp_path)[0])
    assert said["SUBJECTS"]["NAMES"] == ["Anna Lena"] and said["SUBJECTS"]["LABEL_PREFIXES"] == [""]
    own = said["PHALANX"]
    assert (own["PERFORMER"], own["SHOT"], own["RATING"]) == (["Anna Lena"], ["coffee"], ["A"])
    assert own["CREATED_UTC"] == ["2025-03-14T15:09:26+00:00"] and own["TAKE"] == ["take 1"]
    assert "".join(own["NOTES"]).replace(" ", "") == NOTES.replace("\n", "").replace(" ", "")
    assert said["TRIAL"]["ACTUAL_END_FIELD"].tolist() == [240, 0] and said["MANUFACTURER"]["COMPANY"] == ["Phalanx"]


def test_a_record_beside_the_files_says_it_of_all(tmp_path):
    export(marked(), ["trc", "csv"], tmp_path, options=ExportOptions(up="z", unit="m", measured=True))
    told = json.loads((tmp_path / "take 1_export.json").read_text(encoding="utf-8"))
    recording = told["recording"]
    assert told["program"] == "Phalanx" and told["version"]
    assert {key: recording[key] for key in ("name", "file", "take", "performer", "shot", "rating", "notes")} == {
        "name": "take 1", "file": "take 1.mcap", "take": "inner name", "performer": "Anna Lena", "shot": "coffee",
        "rating": "A", "notes": NOTES,
    }  # fmt: skip
    assert recording["rate_hz"] == RATE and recording["performers"][0]["layout"] == "han19"
    files = {one["file"]: one for one in told["files"]}
    assert list(files) == ["take 1.trc", "markers.csv", "angles.csv", "joints.csv", "marks.csv"]
    trc, markers = files["take 1.trc"], files["markers.csv"]
    assert (trc["unit"], trc["up"], trc["rate_hz"], trc["options"]) == ("m", "z", RATE, {"measured": True})
    assert (markers["unit"], markers["up"], markers["rate_hz"]) == ("m", "z", None)


def test_a_record_is_added_to(tmp_path):
    export(marked(marks=()), ["trc"], tmp_path)
    export(marked(marks=()), ["c3d"], tmp_path)
    record = tmp_path / "take 1_export.json"
    assert [one["file"] for one in json.loads(record.read_text())["files"]] == ["take 1.trc", "take 1.c3d"]
    (tmp_path / "take 1.trc").unlink()
    export(marked(marks=()), ["c3d"], tmp_path, overwrite=True, options=ExportOptions(unit="cm"))
    (only,) = json.loads(record.read_text())["files"]
    assert (only["file"], only["unit"]) == ("take 1.c3d", "cm")


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"program": "Other", "files": []}', '{"program": "Phalanx", "files": 3}']
)
def test_a_file_of_that_name_that_is_no_record_stays(tmp_path, text):
    from core.takes.export import export_each

    record = tmp_path / "take 1_export.json"
    record.write_text(text)
    exported = export_each(marked(marks=()), ["c3d"], tmp_path)
    assert [path.name for path in exported.files] == ["take 1.c3d"] and record.read_text() == text
    assert "is no record of an export" in exported.failed["record"].what
