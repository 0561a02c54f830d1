"""LCM's udpm: short messages of one multicast group, to and fro."""

from __future__ import annotations

import os
import select
import socket
import struct
import time
import urllib.parse
from typing import Optional

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
_MAGIC = b"LC02"


class UdpmBus:
    """A socket in a multicast group.

    :param url: ``udpm://GROUP:PORT?ttl=N``; None: LCM_DEFAULT_URL, else LCM's own
    :param channels: names of those that are read
    """

    def __init__(self, url: Optional[str], channels: set[str]):
        url = url or os.environ.get("LCM_DEFAULT_URL") or DEFAULT_URL
        parsed = urllib.parse.urlparse(url)
        default = urllib.parse.urlparse(DEFAULT_URL)
        if parsed.scheme != "udpm":
            raise ValueError(f"{url}: must be a udpm URL: udpm://GROUP:PORT?ttl=N")
        options = dict(urllib.parse.parse_qsl(parsed.query))
        ttl = int(options.get("ttl", 0))
        self._address = (parsed.hostname or default.hostname, parsed.port or default.port)
        self._channels = {name.encode() for name in channels}
        self._sequence = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
            self._socket.bind(self._address)  # to the group: no other one on the port is heard
            group = struct.pack("=4sl", socket.inet_aton(self._address[0]), socket.INADDR_ANY)
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
            self._socket.setblocking(False)
        except OSError as error:
            self._socket.close()
            raise OSError(f"{url}: {error.strerror}; is there a multicast route?") from error

    def close(self) -> None:
        self._socket.close()

    def fileno(self) -> int:
        """For select() beside others."""
        return self._socket.fileno()

    @property
    def receive_buffer_bytes(self) -> int:
        """What the kernel keeps until it is read."""
        return self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)

    def receive(self, timeout_s: float = 0.0) -> Optional[tuple[str, bytes]]:
        """The next message on one of the channels, with the channel's name; None after the time."""
        deadline = time.monotonic() + timeout_s
        while True:
            datagram = self._next_datagram()
            if datagram is None:
                left = deadline - time.monotonic()
                if left <= 0 or not select.select([self._socket], [], [], left)[0]:
                    return None
                continue
            channel, end, data = datagram[8:].partition(b"\0")
            if datagram[:4] == _MAGIC and end and channel in self._channels:
                return channel.decode(), data

    def _next_datagram(self) -> Optional[bytes]:
        try:
            return self._socket.recv(65536)
        except BlockingIOError:
            return None

    def publish(self, channel: str, data: bytes) -> None:
        """Sends a message, at most 65000 bytes of it."""
        header = _MAGIC + struct.pack(">I", self._sequence & 0xFFFFFFFF)
        self._sequence += 1
        self._socket.sendto(header + channel.encode() + b"\0" + data, self._address)
