"""The file of a take is deleted, moved or replaced while it is recorded: nothing of it is lost, and nothing of what
another program put there is touched."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from core.errors import TakeError
from core.level import Level
from core.profile import load_profile
from core.takes import record_file, rescue
from core.takes import writer as writer_of_takes
from core.takes.reader import open_take
from core.takes.record_file import RecordFile
from core.takes.safekeeping import Notice
from core.takes.seal import seal_take
from core.takes.take import DAMAGED, TakeCounts, TakeInfo
from core.takes.verify import verify
from core.takes.writer import Readable, TakeWriter
from tests.core.takes.frames import bits, plain_frame, plain_solved

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows itself keeps an open file where it is")

N = 300
STRANGER = b"somebody's notes, not a take"


class Stage:
    """A take of which half is recorded, and where it is put in safety."""

    def __init__(self, root: Path) -> None:
        self.folder, self.refuge = root / "takes", root / "data"
        self.path = self.folder / "take.mcap"
        self.notices: list[Notice] = []
        self.writer = TakeWriter(
            self.path, TakeInfo("take", rate_hz=120), load_profile("han19"), refuge=self.refuge,
            notify=self.notices.append,
        )  # fmt: skip
        self.record(0, N // 2)

    def record(self, begin: int, end: int) -> None:
        for i in range(begin, end):
            self.writer.raw("", plain_frame(i))
            self.writer.solved(plain_solved(i))

    def go_on(self) -> None:
        """Look, and record the other half while what there is is rescued."""
        self.writer.safety.look()
        for i in range(N // 2, N):
            self.record(i, i + 1)
            self.writer.safety.rescue_on()

    def seal(self) -> None:
        self.writer.seal(TakeCounts(N, N, solved=N))


def whole(path: Path, n: int = N) -> None:
    with open_take(path) as take:
        assert take.sealed and take.complete and take.counts == TakeCounts(n, n, solved=n)
        assert bits(tuple(take.raw)) == bits(tuple(plain_frame(i) for i in range(n)))
        assert bits(tuple(take.solved)) == bits(tuple(plain_solved(i) for i in range(n)))
    assert verify(path).ok


@pytest.fixture
def stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Stage:
    monkeypatch.setattr(rescue, "SLICE", 1 << 12)  # many slices
    return Stage(tmp_path)


def delete(stage: Stage) -> None:
    stage.path.unlink()


def replace(stage: Stage) -> None:
    other = stage.folder / "other"
    other.write_bytes(STRANGER)
    other.replace(stage.path)


def throw_away(stage: Stage) -> None:
    waste = stage.folder / ".Trash-0" / "files"
    waste.mkdir(parents=True)
    stage.path.rename(waste / "take.mcap")


def move_and_replace(stage: Stage) -> None:
    stage.path.rename(stage.folder / "take.mcap.old")
    stage.path.write_bytes(STRANGER)


@pytest.mark.parametrize("befall", [delete, replace, throw_away, move_and_replace])
def test_it_is_rescued_beside_its_name_and_recorded_on(stage: Stage, befall: Callable[[Stage], None]) -> None:
    befall(stage)
    stage.go_on()
    target = stage.folder / "take_rescued.mcap"
    assert [notice.level for notice in stage.notices] == [Level.PROBLEM, Level.WARNING]
    assert str(stage.path) in stage.notices[0].what and str(target) in stage.notices[1].what
    with open_take(target) as take:  # as if this process were killed now
        assert take.complete and len(take.raw) == len(take.solved) == N
    stage.seal()
    assert stage.writer.path == target and str(target) in stage.writer.safety.history
    whole(target)
    assert not stage.path.exists() or stage.path.read_bytes() == STRANGER
    assert not list(stage.folder.glob("*.sealing"))


@pytest.mark.parametrize("befall", [delete, replace, throw_away, move_and_replace])
def test_just_before_it_is_sealed(stage: Stage, befall: Callable[[Stage], None]) -> None:
    stage.record(N // 2, N)
    befall(stage)
    stage.seal()
    whole(stage.folder / "take_rescued.mcap")
    assert not stage.path.exists() or stage.path.read_bytes() == STRANGER


@pytest.mark.parametrize("befall", [delete, replace, throw_away, move_and_replace])
def test_while_it_is_sealed(stage: Stage, befall: Callable[[Stage], None]) -> None:
    stage.record(N // 2, N)
    told: list[float] = []

    def progress(share: float) -> None:
        if not told and share > 0.8:  # the copy is written, and being read back
            told.append(share)
            befall(stage)

    stage.writer.seal(TakeCounts(N, N, solved=N), progress)
    assert told
    whole(stage.folder / "take_rescued.mcap")
    assert not stage.path.exists() or stage.path.read_bytes() == STRANGER


def another_take(stage: Stage) -> None:
    other = stage.folder / "other.mcap"
    writer = TakeWriter(other, TakeInfo("other"), load_profile("han19"))
    writer.raw("", plain_frame(0))
    writer.close()
    other.replace(stage.path)


def pipe(stage: Stage) -> None:
    stage.path.unlink()
    os.mkfifo(stage.path)


def folder(stage: Stage) -> None:
    stage.path.unlink()
    stage.path.mkdir()


@pytest.mark.parametrize("befall", [delete, replace, another_take, pipe, folder])
def test_when_it_was_found_safe_just_before(
    stage: Stage, befall: Callable[[Stage], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another file is opened in its place, which may be anything."""
    stage.record(N // 2, N)
    secure, done = stage.writer.safety.secure, []

    def secured() -> None:
        secure()
        if not done:
            done.append(befall(stage))

    monkeypatch.setattr(stage.writer.safety, "secure", secured)
    stage.seal()
    whole(stage.folder / "take_rescued.mcap")


@pytest.mark.parametrize("befall", [delete, replace, another_take, pipe, folder])
def test_what_is_readable_of_it_is_never_that_of_another_file(
    stage: Stage, befall: Callable[[Stage], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    def opened(path: Path):
        befall(stage)
        return open_take(path)

    monkeypatch.setattr(writer_of_takes, "open_take", opened)
    assert stage.writer.readable() == Readable()


def test_a_take_that_is_sealed_later_is_not_put_over_another_file(stage: Stage) -> None:
    stage.record(N // 2, N)
    stage.writer.close()

    def progress(share: float) -> None:
        if share > 0.8 and stage.path.read_bytes() != STRANGER:
            replace(stage)

    with pytest.raises(TakeError, match=r"deleted, moved or replaced"):
        seal_take(stage.path, None, progress)
    assert stage.path.read_bytes() == STRANGER and not list(stage.folder.glob("*.sealing"))


def test_a_name_that_is_taken_is_left_alone(stage: Stage) -> None:
    (stage.folder / "take_rescued.mcap").write_bytes(STRANGER)
    delete(stage)
    stage.go_on()
    stage.seal()
    assert (stage.folder / "take_rescued.mcap").read_bytes() == STRANGER
    whole(stage.folder / "take_rescued2.mcap")


def test_the_copy_is_deleted_as_well(stage: Stage) -> None:
    delete(stage)
    stage.go_on()
    (stage.folder / "take_rescued.mcap").unlink()
    stage.writer.safety.look()
    stage.writer.safety.rescue_on()
    (stage.folder / "take_rescued.mcap").unlink()  # in the midst of it
    stage.seal()
    whole(stage.folder / "take_rescued.mcap")


@pytest.mark.skipif(sys.platform not in ("linux", "darwin"), reason="this system does not say where a file is now")
def test_a_moved_file_is_followed(stage: Stage) -> None:
    target = stage.folder / "day 2" / "better name.mcap"
    target.parent.mkdir()
    stage.path.rename(target)
    stage.go_on()
    assert [notice.level for notice in stage.notices] == [Level.WARNING]
    assert str(target) in stage.notices[0].what and stage.writer.path == target
    stage.seal()
    whole(target)
    assert os.listdir(stage.folder) == ["day 2"]  # noqa: PTH208
    assert not stage.refuge.exists()


@pytest.mark.skipif(sys.platform not in ("linux", "darwin"), reason="this system does not say where a file is now")
def test_so_is_a_moved_folder(stage: Stage) -> None:
    moved = stage.folder.rename(stage.folder.with_name("takes of today"))
    stage.go_on()
    stage.seal()
    whole(moved / "take.mcap")


@pytest.mark.parametrize("again", [False, True])
def test_without_its_folder_it_goes_to_the_refuge(stage: Stage, again: bool) -> None:
    shutil.rmtree(stage.folder)
    if again:  # another folder of that name is not the one it was put into: a mount point shows when a disk is gone
        (stage.folder.parent / "other").mkdir()
        (stage.folder.parent / "other").rename(stage.folder)
    stage.go_on()
    stage.seal()
    whole(stage.refuge / "take_rescued.mcap")
    assert str(stage.refuge) in stage.writer.safety.history
    assert not again or not list(stage.folder.iterdir())


def test_a_disk_that_is_taken_away(tmp_path: Path) -> None:
    (tmp_path / "takes").mkdir()
    if not mount(tmp_path / "takes", "8m"):
        pytest.skip("needs the right to mount a disk")
    stage = Stage(tmp_path)
    subprocess.run(["umount", "-l", str(stage.folder)], check=True)
    stage.go_on()
    stage.seal()
    whole(stage.refuge / "take_rescued.mcap")
    assert not list(stage.folder.iterdir())


def test_a_folder_without_room_is_left_for_the_refuge(tmp_path: Path) -> None:
    (tmp_path / "takes").mkdir()
    if not mount(tmp_path / "takes", "160k"):
        pytest.skip("needs the right to mount a small disk")
    stage = Stage(tmp_path)
    try:
        while stage.writer.bytes_written < 90_000:
            stage.writer.set_info(stage.writer.info)
        delete(stage)
        stage.go_on()
        stage.seal()
        whole(stage.refuge / "take_rescued.mcap")
        assert not list(stage.folder.iterdir())
    finally:
        stage.writer.close()
        subprocess.run(["umount", str(stage.folder)], check=True)


def test_where_there_is_room_nowhere_it_is_said_and_recorded_on_and_tried_again(stage: Stage) -> None:
    stage.refuge.write_bytes(b"in the way")
    shutil.rmtree(stage.folder)
    for _ in range(3):
        stage.writer.safety.look()
    assert [notice.level for notice in stage.notices] == [Level.PROBLEM, Level.PROBLEM]
    assert "could not be copied" in stage.notices[1].what and not stage.writer.safety.safe
    stage.record(N // 2, N)
    with pytest.raises(TakeError, match="could not be copied"):
        stage.seal()
    stage.refuge.unlink()
    stage.seal()
    whole(stage.refuge / "take_rescued.mcap")


def test_what_the_disk_does_not_give_back_is_said_and_the_rest_is_kept(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = record_file.RecordFile.read

    def bad_sector(file: record_file.RecordFile, offset: int, n: int) -> bytes:
        if offset <= 4 * rescue.SLICE < offset + n:
            raise OSError(5, "Input/output error")
        return read(file, offset, n)

    monkeypatch.setattr(record_file.RecordFile, "read", bad_sector)
    delete(stage)
    stage.go_on()
    assert "could not be read" in stage.writer.safety.history
    with pytest.raises(TakeError, match="damaged"):
        stage.seal()
    stage.writer.close()
    with open_take(stage.writer.path) as take:
        assert 0 < take.lost_raw < 50 and len(take.raw) + take.lost_raw == N


def copied_over(stage: Stage) -> None:
    """As `cp` does it: another program's bytes in the very file."""
    with stage.path.open("r+b") as file:
        file.truncate()
        file.write(STRANGER)


def another_take_copied_over(stage: Stage) -> None:
    other = TakeWriter(stage.folder / "other.mcap", TakeInfo("other", rate_hz=120), load_profile("han19"))
    for i in range(1000, 1010):
        other.raw("", plain_frame(i))
        other.solved(plain_solved(i))
    other.seal(TakeCounts(10, 10, solved=10))
    data = other.path.read_bytes()
    other.path.unlink()
    with stage.path.open("r+b") as file:
        file.truncate()
        file.write(data)


def cut(size: int) -> Callable[[Stage], None]:
    def befall(stage: Stage) -> None:
        os.truncate(stage.path, size)

    return befall


def appended(stage: Stage) -> None:
    with stage.path.open("ab") as file:
        file.write(STRANGER)


def sealed_as_far_as_it_can_be(stage: Stage) -> list[int]:
    """Numbers of the frames that are in it."""
    assert stage.writer.safety.find_out()
    raw, solved, *_ = stage.writer.readable()
    came = stage.writer.acknowledged
    stage.writer.seal(TakeCounts(came, raw, {DAMAGED: came - raw}, solved=solved))
    with open_take(stage.writer.path) as take:
        assert take.sealed and take.complete and len(take.raw) == raw and len(take.solved) == solved
        numbers = [frame.sequence for frame in take.raw]
        assert bits(tuple(take.raw)) == bits(tuple(plain_frame(i) for i in numbers))
        assert take.profile.to_json() == load_profile("han19").to_json()
    assert verify(stage.writer.path).ok
    return numbers


@pytest.mark.parametrize(
    ("befall", "kept"),
    [
        (cut(0), 0), (cut(10), 0), (cut(4096), 0), (cut(30_000), None), (appended, N // 2), (copied_over, 0),
        (another_take_copied_over, 0),
    ],
)  # fmt: skip
def test_a_file_that_is_cut_short_or_written_into_is_said_and_recorded_on_beside_it(
    stage: Stage, befall: Callable[[Stage], None], kept: int | None
) -> None:
    befall(stage)
    left = stage.path.read_bytes()
    stage.record(N // 2, N // 2 + 5)  # before anybody looks
    stage.go_on()
    assert [notice.level for notice in stage.notices] == [Level.PROBLEM, Level.WARNING]
    assert "cut short or written into" in stage.notices[0].what and "record it again" in stage.notices[0].action
    assert stage.writer.safety.level is Level.PROBLEM  # whatever is safe now: frames are lost
    numbers = sealed_as_far_as_it_can_be(stage)
    before, after = [i for i in numbers if i < N // 2], set(range(N // 2, N))
    assert set(numbers) >= after and before == list(range(len(before)))
    assert len(before) == kept if kept is not None else 0 < len(before) < N // 2
    assert stage.path.read_bytes()[: len(left)] == left and stage.writer.path != stage.path


def test_it_is_cut_again_while_what_is_left_is_copied(stage: Stage) -> None:
    os.truncate(stage.path, 40_000)
    stage.writer.safety.look()
    stage.writer.safety.rescue_on()
    os.truncate(stage.path, 30_000)
    for i in range(N // 2, N):
        stage.record(i, i + 1)
        stage.writer.safety.rescue_on()
    assert set(sealed_as_far_as_it_can_be(stage)) >= set(range(N // 2, N))


def test_so_is_the_copy(stage: Stage) -> None:
    os.truncate(stage.path, 30_000)
    stage.go_on()
    os.truncate(stage.folder / "take_rescued.mcap", 0)
    stage.record(N, N + 5)
    numbers = sealed_as_far_as_it_can_be(stage)
    assert numbers == list(range(N, N + 5)) and stage.writer.path.name == "take_rescued2.mcap"


def test_what_was_cut_is_not_sealed_as_if_it_were_there(stage: Stage) -> None:
    os.truncate(stage.path, 30_000)
    stage.go_on()
    with pytest.raises(TakeError, match="damaged"):
        stage.seal()


def test_nothing_is_said_of_a_file_that_stays(stage: Stage) -> None:
    stage.go_on()
    stage.seal()
    assert stage.notices == [] and stage.writer.safety.history == stage.writer.safety.trouble == ""
    whole(stage.path)


def mount(folder: Path, size: str) -> bool:
    if sys.platform != "linux":
        return False
    command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def test_a_folder_that_goes_while_the_take_begins_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "takes"

    def gone() -> dict[str, str]:
        shutil.rmtree(folder)
        return {}

    monkeypatch.setattr(writer_of_takes, "library_versions", gone)
    with pytest.raises(TakeError, match="cannot be created"):
        TakeWriter(folder / "take.mcap", TakeInfo("take"), load_profile("han19"))
    assert not folder.exists()


def forgotten(file: RecordFile) -> None:
    """The system knows nothing of this open file any more, as of one on a network disk that was started anew."""
    os.close(file._raw.fileno())


def test_a_file_that_the_system_has_forgotten_raises_nothing_but_what_is_said(stage: Stage) -> None:
    """Its descriptor cannot be asked, read or closed: it is told, and the recording thread goes on."""
    forgotten(stage.writer._file)
    stage.writer.safety.look()
    while stage.writer.safety.rescuing:
        stage.writer.safety.rescue_on()
    assert [notice.level for notice in stage.notices][:1] == [Level.PROBLEM]
    assert "cannot be reached" in stage.notices[0].what


def test_nor_does_one_whose_copy_is_forgotten(stage: Stage) -> None:
    stage.path.unlink()
    stage.writer.safety.look()
    stage.writer.safety.rescue_on()
    rescue = stage.writer.safety._rescue
    assert rescue is not None
    forgotten(rescue.target)
    for _ in range(3):
        stage.writer.safety.look()
        stage.writer.safety.rescue_on()
    stage.writer.safety.secure()
    assert stage.writer.safety.safe


def test_a_take_that_never_began_and_is_forgotten_ends_without_a_word(stage: Stage) -> None:
    forgotten(stage.writer._file)
    stage.writer.discard()
    assert stage.notices == []


def test_what_is_sealed_is_not_called_lost_for_the_file_that_it_was_made_from(stage: Stage) -> None:
    """A network disk may refuse to close a file of which a sealed copy, read back, has the place already."""
    stage.record(N // 2, N)
    done: list[float] = []

    def progress(share: float) -> None:
        if not done and share > 0.8:
            done.append(share)
            forgotten(stage.writer._file)

    stage.writer.seal(TakeCounts(N, N, solved=N), progress)
    whole(stage.path)
