"""Sockets that change their address."""

from __future__ import annotations

import socket
import sys

import pytest

from devices.natnet.transport import Transport

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs a second loopback address")


def test_a_transport_moves_to_another_address() -> None:
    """This machine got another address while it was open: what was bound to the old one reaches nobody."""
    transport = Transport("127.0.0.1", follows=True)
    try:
        transport.move("127.0.0.2")
        assert transport.local == transport.command.getsockname()[0] == "127.0.0.2"
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
            server.bind(("127.0.0.1", 0))
            server.settimeout(5)
            transport.send(b"hello", *server.getsockname())
            _, sender = server.recvfrom(100)
            assert sender == transport.command.getsockname()
            server.sendto(b"welcome", sender)
            got = transport.receive(5)
        assert got is not None
        assert (got.data, got.address, got.port > 0, got.slack_s) == (b"welcome", "127.0.0.1", True, 0.0)
    finally:
        transport.close()


def test_one_that_cannot_move_stays() -> None:
    transport = Transport("127.0.0.1", follows=True)
    try:
        before = transport.command.getsockname()
        with pytest.raises(OSError, match="assign"):
            transport.move("203.0.113.7")
        assert transport.command.getsockname() == before
        assert transport.receive(0.0) is None
    finally:
        transport.close()
