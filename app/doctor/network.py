"""What devices need from the system: receive buffers, multicast, serial ports."""

from __future__ import annotations

import os
import socket
import sys
from pathlib import Path

from app.doctor.finding import Finding, good, problem, warning

RECEIVE_BUFFER = 4 * 1024 * 1024
"""What a device asks for [bytes]: a second of dense frames, while the machine is busy elsewhere."""

GROUP = "239.255.42.99"
"""Where OptiTrack servers multicast."""

_TIMEOUT_S = 2.0


def granted_receive_buffer() -> int:
    """Bytes of receive buffer that the system grants to a UDP socket that asks for RECEIVE_BUFFER."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
        granted = probe.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    # Linux reserves, and reports, twice the size for its own bookkeeping (man 7 socket).
    return granted // 2 if sys.platform.startswith("linux") else granted


def check_receive_buffer() -> list[Finding]:
    """Whether packets survive a busy moment."""
    granted = granted_receive_buffer()
    if granted >= RECEIVE_BUFFER:
        return [good("Receive buffer", f"{granted / 1024:,.0f} kB granted")]
    action = "Choose a larger socket buffer in the system's settings."
    if sys.platform.startswith("linux"):
        action = (
            f"Run: echo net.core.rmem_max={RECEIVE_BUFFER} | sudo tee /etc/sysctl.d/60-phalanx.conf "
            "&& sudo sysctl --system."
        )
    text = f"{granted / 1024:,.0f} kB granted of {RECEIVE_BUFFER / 1024:,.0f}: frames may be lost when busy."
    return [warning("Receive buffer", text, action)]


def check_multicast() -> list[Finding]:
    """Sends one datagram to the OptiTrack group over the default interface and receives it."""
    action = "Use unicast, or name this machine's address on the cameras' network as the device's interface."
    try:
        with (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        ):
            receiver.bind(("", 0))
            member = socket.inet_aton(GROUP) + socket.inet_aton("0.0.0.0")
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
            receiver.settimeout(_TIMEOUT_S)
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)  # never leaves this machine
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
            sender.sendto(b"phalanx", (GROUP, receiver.getsockname()[1]))
            received, _ = receiver.recvfrom(64)
    except OSError as error:
        return [warning("Multicast", f"does not work on the default interface ({error}).", action)]
    if received != b"phalanx":
        return [warning("Multicast", "something else answers.", action)]
    return [good("Multicast", "works on the default interface")]


def check_serial_ports() -> list[Finding]:
    """Whether the serial ports there are may be opened (Linux)."""
    if not sys.platform.startswith("linux"):
        return []
    ports = sorted(str(port) for pattern in ("ttyUSB*", "ttyACM*") for port in Path("/dev").glob(pattern))
    shut = [port for port in ports if not os.access(port, os.R_OK | os.W_OK)]
    if shut:
        text = f"{', '.join(shut)} may not be opened by this user."
        return [problem("Serial ports", text, 'Run: sudo usermod -aG dialout "$USER", then log in again.')]
    return [good("Serial ports", ", ".join(ports) if ports else "none plugged in")]
