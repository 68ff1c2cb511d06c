"""A line over TCP or UDP to one of several servers (section 8, "Several servers")."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Sequence
from typing import Any, NamedTuple

from ._line import Line, open_terminal

PATIENCE_S = 0.15


class Place(NamedTuple):
    family: socket.AddressFamily
    kind: socket.SocketKind
    where: Any


def resolve(address: str) -> Place:
    """Looks "HOST:PORT", by TCP, or "udp:HOST:PORT" up; that of a name may take many seconds."""
    kind = socket.SOCK_DGRAM if address.startswith("udp:") else socket.SOCK_STREAM
    host, _, port = address.removeprefix("udp:").removeprefix("tcp:").rpartition(":")
    family, kind, _, _, where = socket.getaddrinfo(host.strip("[]"), int(port), type=kind)[0]
    return Place(family, kind, where)


def connect(place: Place) -> int:
    """Gives the file descriptor, after PATIENCE_S at the latest."""
    with socket.socket(place.family, place.kind) as opened:
        opened.settimeout(PATIENCE_S)
        opened.connect(place.where)
        opened.setblocking(True)
        if place.kind == socket.SOCK_STREAM:
            opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            forget = struct.pack("ii", 1, 0)  # what has not left when it is closed
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, forget)
        return opened.detach()


def open_line(path: str, baud: int | None = None) -> Line:
    """A terminal, such as radio-a.pty, or HOST:PORT for TCP, or udp:HOST:PORT; with commas between
    several servers. The path of a terminal has a slash, or no colon."""
    if "/" in path or ":" not in path:
        return open_terminal(path, baud)
    return Servers(path.split(","))


class Servers(Line):
    """Speaks to the first of `addresses` that is there, and stays with the one that answers. To
    go on after 150 ms, a Client wants a timeout of half of that: a request, and a PING. Names are
    looked up once, here; one that is not known then is that of a server that is never there."""

    def __init__(self, addresses: Sequence[str]) -> None:
        if len({address.startswith("udp:") for address in addresses}) != 1:
            raise ValueError("the servers are to be either all by TCP or all by UDP")
        super().__init__(-1)
        self.addresses = list(addresses)
        self.server = -1  # the place of the one that is spoken to
        self._moves = 0  # since a server was heard
        self._places: list[Place | None] = []
        for address in addresses:
            try:
                self._places.append(resolve(address))
            except OSError:
                self._places.append(None)
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
        sent is lost, until the next time. Calls `before_waiting` before it waits for a connection,
        which UDP does not need."""
        for _ in self.addresses:
            self.close()
            self.server = (self.server + 1) % len(self.addresses)
            self._moves += 1
            self.moved = True
            self.forget()
            place = self._places[self.server]
            if place is None:
                continue
            if place.kind == socket.SOCK_STREAM:
                self.before_waiting()
            try:
                self.fd = connect(place)
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
