"""`phalanx record DEVICE --beside DEVICE`: several devices as one take, by the real command."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from core.takes.reader import open_take
from tests.app.command import phalanx
from tests.app.stage import server
from tests.app.takes import write_take
from tests.app.test_record_waits import recording
from tests.some import some

FIRST, SECOND = "natnet-1/markers", "natnet-2/markers"


def test_two_servers_are_one_take_that_is_verified_cut_and_recovered(tmp_path: Path) -> None:
    path = tmp_path / "both.mcap"
    with server() as one, server(rate_hz=60.0) as other:
        beside = (f"command-port={other.command_port}", f"data_port={other.data_port}", "server=127.0.0.1")
        ran = phalanx(
            "record", "natnet", "--command-port", one.command_port, "--data-port", one.data_port, "--seconds", 3,
            "--solve-every", 2, "--out", path, "--json", "--beside", "natnet", *beside,
        )  # fmt: skip
    assert ran.code in (0, 3), ran.err  # 3 where this machine was held up
    figures = ran.figures
    assert figures["solving"] == FIRST and list(figures["streams"]) == [FIRST, SECOND]
    for of in some(figures["streams"].values()):
        assert of["received"] == of["written"] + sum(of["dropped"].values()) > 60
    assert {name: figures[name] for name in ("received", "written", "dropped")} == {
        name: figures["streams"][FIRST][name] for name in ("received", "written", "dropped")
    }
    assert figures["unsolved"]["left out by choice"] == pytest.approx(figures["written"] / 2, abs=2)
    assert f"127.0.0.1:{one.command_port} and " in ran.err and f"127.0.0.1:{other.command_port}." in ran.err
    assert f"{SECOND}: received {figures['streams'][SECOND]['received']:,} = written" in ran.out
    with open_take(path) as take:
        assert take.solving == FIRST and take.info.rate_hz == 120.0 and take.streams[SECOND].info.rate_hz == 60.0
        frames = {key: len(stream.frames) for key, stream in take.streams.items()}
        assert frames == {key: of["written"] for key, of in figures["streams"].items()}
        assert take.streams[SECOND].clock and str(other.command_port) in take.info.device["natnet-2: Server"]
    verified = phalanx("verify", path, "--json")
    assert verified.figures["ok"] is True and verified.code == ran.code
    assert (
        verified.figures["raw"] == frames[FIRST]
        and {key: of["frames"] for key, of in verified.figures["streams"].items()} == frames
    )
    info = phalanx("info", path, "--json")
    assert f"{FIRST} was solved, beside it 1 more" in info.out
    assert info.figures["verdict"]["headline"] == figures["verdict"]["headline"]
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert phalanx("verify", cut).code == 3
    recovered = phalanx("recover", cut, "--json")
    assert recovered.code == 3 and recovered.figures["lost"] > 0
    again = phalanx("verify", recovered.figures["recovered_take"], "--json")
    assert again.code == 3 and 0 < again.figures["raw"] < frames[FIRST]
    assert 0 < again.figures["streams"][SECOND]["frames"] < frames[SECOND]


@pytest.mark.skipif(sys.platform == "win32", reason="sends signals")
def test_a_stream_that_falls_silent_is_said_once_and_so_is_its_return(tmp_path: Path) -> None:
    with server() as one, server(rate_hz=60.0) as other:
        ports = other.command_port, other.data_port
        with recording(
            ("-m", "app"), "natnet", "--server", "127.0.0.1", "--command-port", one.command_port,
            "--data-port", one.data_port, "--out", tmp_path / "both.mcap",
            "--beside", "natnet", f"command_port={ports[0]}", f"data_port={ports[1]}", "server=127.0.0.1",
        ) as command:  # fmt: skip
            command.says("Recording both.mcap")
            other.close()
            command.says(f"phalanx: {SECOND} (")
            with server(*ports, 60.0):
                command.says("is back.")
                command.interrupt()
                ran = command.ended()
    silent, back = (line for line in ran.err.splitlines() if line.startswith(f"phalanx: {SECOND}"))
    assert f"127.0.0.1:{ports[0]}): no frame has come for " in silent
    assert back.endswith(f"127.0.0.1:{ports[0]}): is back.")
    assert ran.code == 3 and f"{SECOND}: " in ran.out


def test_files_beside_a_server_are_recorded_to_the_end_of_the_last(tmp_path: Path) -> None:
    """Whole, from their first frames; what is live has no end and does not decide."""
    short, long = write_take(tmp_path, "short", 60), write_take(tmp_path, "long", 200)
    with server() as simulator:
        ran = phalanx(
            "record", "playback", "--file", long, "--out", tmp_path / "all.mcap", "--json",
            "--beside", "playback", f"file={short}",
            "--beside", "natnet", f"command_port={simulator.command_port}", f"data_port={simulator.data_port}",
        )  # fmt: skip
    assert ran.code in (0, 3), ran.err  # the shorter one has ended before the take
    assert ran.figures["solving"] == "playback-1/markers"
    written = {key: of["written"] for key, of in ran.figures["streams"].items()}
    assert (written["playback-1/markers"], written["playback-2/markers"]) == (200, 60)
    assert written[FIRST] > 60
    with open_take(tmp_path / "all.mcap") as take:
        assert [frame.sequence for frame in take.raw] == list(range(200))
        assert [frame.sequence for frame in take.streams["playback-2/markers"].frames] == list(range(60))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("natnet", "1511"), "'1511' sets nothing"),
        (("natnet", "port=1511"), "has no setting 'port'"),
        (("natnet", "command_port=many"), "Command port: 'many' is not valid"),
        (("camera",), "Device 'camera' is not known"),
    ],
)
def test_what_is_wrong_with_a_device_beside_is_said_before_anything_is_waited_for(
    tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    ran = phalanx("record", "natnet", "--out", tmp_path / "take", "--beside", *words)
    assert ran.code == 1 and said in ran.err and "Preparing" not in ran.err
    assert not list(tmp_path.iterdir())
