import pytest

from core.takes.formats import code_pages, read_recording
from tests.core.formats import test_trc
from tests.data import case_path

CHINESE = ["拇指", "食指", "中指尖", "无名指", "小指", "手腕", "左手_拇指尖", "手背1", "掌骨"]
WESTERN = [
    "pouce_é",
    "Zeigefingerkuppe ä",
    "größe",
    "médius",
    "Muñeca",
    "côté gauche",
    "kämmen",
    "Anna’s thumb",
    "“tip”",
]
JAPANESE = ["親指", "人差し指", "右手_中指", "てのひら", "サンプル"]


@pytest.mark.parametrize(
    ("name", "page"),
    [*((name, "gbk") for name in CHINESE), *((name, "cp1252") for name in WESTERN), *((n, "cp932") for n in JAPANESE)],
)
def test_names_are_read_in_the_code_page_they_were_written_in(tmp_path, name, page):
    path = tmp_path / "names.trc"
    text = test_trc.HEADER.format(unit="mm", a=name, b="Back") + test_trc.ROWS
    path.write_bytes(text.encode(page))
    recording = read_recording(path)
    assert recording.labels == (name, "Back")
    assert f"Names in it are not UTF-8; they were read in the code page {code_pages.WORDS[page]}." in recording.warnings
    plain = test_trc.write(tmp_path)
    assert recording.points_m.tobytes() == read_recording(plain).points_m.tobytes()


@pytest.mark.parametrize(
    "name", [*CHINESE, *WESTERN, *JAPANESE, "большой палец", "αντίχειρας", "אגודל", "إبهام", "엄지", "ĳ"]
)
def test_utf8_stays_utf8(tmp_path, name):
    path = test_trc.write(tmp_path, a=name)
    recording = read_recording(path)
    assert recording.labels == (name, "IndexTip")
    assert not any("code page" in warning for warning in recording.warnings)


def test_one_page_for_the_whole_file(tmp_path):
    path = tmp_path / "names.trc"
    text = test_trc.HEADER.format(unit="mm", a="食指", b="中指").replace("pinch", "录制") + test_trc.ROWS
    path.write_bytes(text.encode("gbk"))
    assert read_recording(path).labels == ("食指", "中指")


def test_bytes_of_no_code_page_spoil_only_the_name(tmp_path):
    path = tmp_path / "names.trc"
    text = test_trc.HEADER.format(unit="mm", a="Tip", b="Back") + test_trc.ROWS
    path.write_bytes(text.encode().replace(b"Tip", b"T\x81\xffp"))
    recording = read_recording(path)
    assert recording.labels[1] == "Back"
    assert recording.points_m.shape == (2, 2, 3)


@pytest.mark.parametrize(("name", "label"), [("trc_latin.trc", "pouce_é"), ("trc_gbk.trc", "拇指")])
def test_reported_files(name, label):
    recording = read_recording(case_path("files", "08-text-in-the-code-page-of-windows", name))
    assert recording.labels == (label, "B")
    assert (recording.points_m * 1000).round(9).tolist() == [[[1, 2, 3], [4, 5, 6]]] * 3
    assert len(recording.warnings) == 1
