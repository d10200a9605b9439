"""Choices that come and go, as serial ports: asked for when they are shown, and what is chosen is never lost."""

from __future__ import annotations

import argparse

import pytest
from PySide6.QtWidgets import QComboBox

from app.commands.device_options import add_device_options, device_settings
from app.panels.offered_choice import OfferedChoice
from app.panels.parameter_form import ParameterForm
from devices.device import Parameter


class Ports:
    """What is plugged in, and how often somebody asked."""

    def __init__(self, *there: str) -> None:
        self.there, self.asked = list(there), 0

    def __call__(self) -> list[str]:
        self.asked += 1
        return list(self.there)

    def parameter(self) -> Parameter:
        return Parameter("port", "Port", "", choices=self, help="Where the glove is plugged in.")


@pytest.fixture
def ports() -> Ports:
    return Ports("/dev/a", "/dev/b")


@pytest.fixture
def form(ports, qtbot):
    made = ParameterForm([ports.parameter()], {"port": "/dev/b"})
    qtbot.addWidget(made)
    made.resize(300, 200)
    made.show()
    qtbot.waitExposed(made)
    return made


def items(choice: QComboBox) -> list[str]:
    return [choice.itemText(i) for i in range(choice.count())]


def test_a_form_asks_when_it_is_shown_and_when_its_list_is_opened(form, ports) -> None:
    choice = form.editor("port")
    assert isinstance(choice, OfferedChoice) and choice.currentText() == "/dev/b"
    assert items(choice) == ["/dev/a", "/dev/b"] and not form.problems["port"].isVisible()
    ports.there.append("/dev/c")
    choice.showPopup()
    assert items(choice) == ["/dev/a", "/dev/b", "/dev/c"]
    choice.hidePopup()


def test_what_is_chosen_and_gone_is_said_and_stays_until_another_is_chosen(form, ports) -> None:
    choice, problem, edited = form.editor("port"), form.problems["port"], []
    form.edited.connect(lambda name, value: edited.append((name, value)))
    ports.there.remove("/dev/b")
    choice.showPopup()
    assert choice.currentText() == "/dev/b" and items(choice) == ["/dev/b", "/dev/a"]
    assert problem.isVisible() and problem.text().startswith("/dev/b is not there now. Connect it, or choose another.")
    assert edited == []  # to look is no choice
    choice.setCurrentIndex(1)
    assert edited == [("port", "/dev/a")] and not problem.isVisible()
    choice.hidePopup()


def test_a_setting_that_is_not_there_is_shown_as_it_is(form, ports) -> None:
    form.set_values({"port": "socket://10.0.0.1:7001"})
    assert form.editor("port").currentText() == "socket://10.0.0.1:7001"
    assert form.problems["port"].isVisible()
    form.set_values({"port": "/dev/a"})
    assert form.editor("port").currentText() == "/dev/a" and not form.problems["port"].isVisible()


def test_the_command_line_asks_when_its_help_is_shown_and_takes_what_is_not_there(ports) -> None:
    parser = argparse.ArgumentParser()
    add_device_options(parser, (ports.parameter(),))
    given = device_settings(parser.parse_args(["--port", "/dev/elsewhere"]))
    assert given == {"port": "/dev/elsewhere"} and ports.asked == 0
    assert ports.parameter().check(given["port"]) == "/dev/elsewhere"
    text = " ".join(parser.format_help().split())
    assert "--port PORT Where the glove is plugged in. now: /dev/a, /dev/b" in text and ports.asked == 1
    ports.there.clear()
    assert "now: none" in parser.format_help()
