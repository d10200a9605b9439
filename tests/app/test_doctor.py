"""The doctor: every finding true of this machine, and a remedy wherever something is missing."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from app import doctor
from app.doctor import network, packages, screen, storage
from app.virtual_display import has_display, virtual_display
from devices.device import Level
from tests.app.command import phalanx
from tests.data import ROOT


def test_doctor_runs_and_every_light_that_is_not_green_has_a_remedy() -> None:
    ran = phalanx("doctor", "--json")
    findings = ran.figures["findings"]
    assert {"Python", "Display", "3D view", "Kernel cache", "Receive buffer", "Multicast", "Disk"} <= {
        finding["topic"] for finding in findings
    }
    for finding in findings:
        assert finding["level"] in ("good", "warning", "problem")
        assert bool(finding["action"]) == (finding["level"] != "good")
        assert finding["text"] in ran.out
    problems = sum(finding["level"] == "problem" for finding in findings)
    assert ran.figures["problems"] == problems
    assert ran.code == (1 if problems else 0)


def test_a_missing_library_and_program_name_their_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "system_libraries.txt").write_text(
        "# comment\nlibno-such-thing.so.9 libnosuch9\n/no-such-program nosuch\n"
    )
    monkeypatch.setattr(screen, "files", lambda package: tmp_path)
    assert screen.missing_packages() == ["libnosuch9", "nosuch"]
    (finding,) = screen.check_libraries()
    assert finding.level is Level.PROBLEM
    assert "apt-get install --no-install-recommends libnosuch9 nosuch" in finding.action


def test_packages_missing_and_other_than_tested(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packages, "requires", lambda name: ["numpy>=2", "no-such-package>=1", 'x; extra == "dev"'])
    (finding,) = packages.check_packages()
    assert (finding.level, "no-such-package" in finding.text) == (Level.PROBLEM, True)
    monkeypatch.setattr(packages, "requires", lambda name: ["numpy>=2"])
    pins = tmp_path / "constraints.txt"
    pins.write_text("numpy==1.0\n")
    monkeypatch.setattr(packages, "CONSTRAINTS", pins)
    (finding,) = packages.check_packages()
    assert (finding.level, "tested with 1.0" in finding.text) == (Level.WARNING, True)


def test_receive_buffer_is_what_a_socket_is_granted() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        smallest = probe.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 2
    granted = network.granted_receive_buffer()
    assert min(smallest, network.RECEIVE_BUFFER) <= granted <= network.RECEIVE_BUFFER
    (finding,) = network.check_receive_buffer()
    assert (finding.level is Level.GOOD) == (granted == network.RECEIVE_BUFFER)


def test_a_small_buffer_says_how_to_enlarge_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(network, "granted_receive_buffer", lambda: 212_992)
    (finding,) = network.check_receive_buffer()
    assert finding.level is Level.WARNING
    assert "208 kB" in finding.text
    assert finding.action


def test_disk(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from collections import namedtuple

    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(storage, "takes_folder", lambda: tmp_path / "not" / "yet")
    for free, level in ((5e8, Level.PROBLEM), (5e9, Level.WARNING), (5e11, Level.GOOD)):
        monkeypatch.setattr(storage.shutil, "disk_usage", lambda path, free=free: usage(1e12, 0, free))
        assert [finding.level for finding in storage.check_disk()] == [level]
    assert list(tmp_path.iterdir()) == []


def test_a_check_that_fails_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    def check_the_moon() -> list[doctor.Finding]:
        raise OSError("too far")

    monkeypatch.setattr(doctor, "CHECKS", (check_the_moon,))
    (finding,) = doctor.examine()
    assert (finding.level, finding.topic) == (Level.PROBLEM, "The moon")
    assert "too far" in finding.text


def test_bootstrap_and_doctor_read_one_list_of_libraries() -> None:
    assert "resources/system_libraries.txt" in (ROOT / "packaging" / "bootstrap.sh").read_text(encoding="utf-8")


def test_virtual_display_lasts_as_long_as_its_block(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":60999")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert not has_display()
    with virtual_display() as name:
        assert has_display()
        with virtual_display() as other:
            assert other != name
        assert has_display()
    assert not has_display()
