"""Sockets that change their address."""

from __future__ import annotations

import socket
import sys

import pytest

from devices.common.udp import Udp

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs a second loopback address")


def test_sockets_move_to_another_address() -> None:
    """This machine got another address while it was open: what was bound to the old one reaches nobody."""
    sockets = Udp("127.0.0.1", follows=True)
    try:
        sockets.move("127.0.0.2")
        assert sockets.local == sockets.speaking.getsockname()[0] == "127.0.0.2"
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
            server.bind(("127.0.0.1", 0))
            server.settimeout(5)
            sockets.send(b"hello", *server.getsockname())
            _, sender = server.recvfrom(100)
            assert sender == sockets.speaking.getsockname()
            server.sendto(b"welcome", sender)
            got = sockets.receive(5)
        assert got is not None
        assert (got.data, got.address, got.port > 0, got.slack_s) == (b"welcome", "127.0.0.1", True, 0.0)
    finally:
        sockets.close()


def test_sockets_that_cannot_move_stay() -> None:
    sockets = Udp("127.0.0.1", follows=True)
    try:
        before = sockets.speaking.getsockname()
        with pytest.raises(OSError, match="assign"):
            sockets.move("203.0.113.7")
        assert sockets.speaking.getsockname() == before
        assert sockets.receive(0.0) is None
    finally:
        sockets.close()
