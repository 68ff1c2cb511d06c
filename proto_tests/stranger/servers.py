"""A line over TCP or UDP to one of several servers (section 8, "Several servers")."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Sequence

from .client import Line

PATIENCE_S = 0.15


def connect(address: str) -> int:
    """Opens "HOST:PORT" by TCP or "udp:HOST:PORT"; gives the file descriptor."""
    kind = socket.SOCK_DGRAM if address.startswith("udp:") else socket.SOCK_STREAM
    host, _, port = address.removeprefix("udp:").removeprefix("tcp:").rpartition(":")
    family, kind, _, _, where = socket.getaddrinfo(host.strip("[]"), int(port), type=kind)[0]
    with socket.socket(family, kind) as opened:
        opened.settimeout(PATIENCE_S)
        opened.connect(where)
        opened.setblocking(True)
        if kind == socket.SOCK_STREAM:
            opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            forget = struct.pack("ii", 1, 0)  # what has not left when it is closed
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, forget)
        return opened.detach()


class Servers(Line):
    """Speaks to the first of `addresses` that is there, and stays with the one that answers. To
    go on after 150 ms, a Client wants a timeout of half of that: a request, and a PING."""

    def __init__(self, addresses: Sequence[str]) -> None:
        if len({address.startswith("udp:") for address in addresses}) != 1:
            raise ValueError("the servers are to be either all by TCP or all by UDP")
        super().__init__(-1)
        self.addresses = list(addresses)
        self.server = -1  # the place of the one that is spoken to
        self._moves = 0  # since a server was heard
        self.go_on()
        if self.fd < 0:
            raise ConnectionError("none of the servers is there: " + ", ".join(self.addresses))
        self._moves = 0
        self.moved = False

    @property
    def slowness(self) -> int:  # type: ignore[override]
        """Doubles, twice, when all have been tried."""
        return 1 << min(self._moves // len(self.addresses), 2)

    def go_on(self) -> None:
        """Goes to the next server that is there, with what is unanswered. Without any, all that is
        sent is lost, until the next time."""
        for _ in self.addresses:
            self.close()
            self.server = (self.server + 1) % len(self.addresses)
            self._moves += 1
            self.moved = True
            self.forget()
            try:
                self.fd = connect(self.addresses[self.server])
                super().send(self.unanswered)
                return
            except OSError:
                self.close()

    def send(self, data: bytes) -> None:
        try:
            if self.fd >= 0:
                super().send(data)
        except OSError:
            self._leave()

    def receive(self, deadline: float) -> bytes | None:
        while True:
            if self.fd < 0:
                time.sleep(max(0.0, deadline - time.monotonic()))
                return None
            try:
                body = super().receive(deadline)
            except OSError:
                self._leave()
            else:
                if body is not None:
                    self._moves = 0
                return body

    def _leave(self) -> None:
        """The server has gone: at once, but only once round the list."""
        if self._moves < len(self.addresses):
            self.go_on()
        else:
            self.close()
