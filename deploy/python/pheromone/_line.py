"""A robot's line to the server: frames on a file descriptor, such as a terminal's."""

from __future__ import annotations

import fcntl
import os
import select
import termios
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

from . import wire


class Line:
    """Frames both ways on a file descriptor, which it owns."""

    moved = False  # the server may be another one than before; whoever looks into that clears it
    unanswered = b""  # the last request; a server that the line goes to gets it
    slowness = 1  # how much longer than usual a server may take

    def __init__(self, fd: int) -> None:
        self.fd = fd
        self.before_waiting: Callable[[], None] = lambda: None  # for a server that may not be there
        self.decoder = wire.Decoder()
        self._bodies: deque[bytes] = deque()

    def send(self, data: bytes) -> None:
        """Writes all of it."""
        while data:
            data = data[os.write(self.fd, data) :]

    def receive(self, deadline: float) -> bytes | None:
        """The body of the next frame, or None at the deadline (a time.monotonic())."""
        while not self._bodies:
            left = deadline - time.monotonic()
            if left <= 0 or not select.select((self.fd,), (), (), left)[0]:
                return None
            data = os.read(self.fd, 4096)
            if not data:
                raise ConnectionError("the other end has gone")
            self._bodies.extend(self.decoder.feed(data))
        return self._bodies.popleft()

    def go_on(self) -> None:
        """The server is silent: goes to another one, if there is one (servers.py)."""

    def forget(self) -> None:
        """What follows comes from elsewhere."""
        self.decoder = wire.Decoder()
        self._bodies.clear()

    def close(self) -> None:
        if self.fd >= 0:
            os.close(self.fd)
        self.fd = -1

    def __enter__(self) -> Line:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class InUse(Exception):
    """Another program has the terminal."""


def user_of(fd: int) -> str:
    """The program that has the lock of an open file, as far as Linux tells."""
    file = os.fstat(fd)
    name = f"{os.major(file.st_dev):02x}:{os.minor(file.st_dev):02x}:{file.st_ino}"
    try:
        locks = [line.split() for line in Path("/proc/locks").read_text().splitlines()]
        pid = next(lock[4] for lock in locks if lock[1] == "FLOCK" and lock[5] == name)
        program = Path(f"/proc/{pid}/comm").read_text().strip()
        ticks = int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19])
        lines = Path("/proc/stat").read_text().splitlines()
        boot = next(int(line.split()[1]) for line in lines if line.startswith("btime "))
    except (OSError, StopIteration, ValueError):
        return "another program"
    since = time.localtime(boot + ticks // os.sysconf("SC_CLK_TCK"))
    return f"{program} (process {pid}, since {time.strftime('%Y-%m-%d %H:%M:%S', since)})"


def open_terminal(path: str | os.PathLike[str], baud: int | None = None) -> Line:
    """Opens a terminal, real or pseudo, for this program alone, and makes it pass all bytes as they
    are, at a rate that the system knows, such as 9600; by default the one that it has. Raises InUse."""
    line = Line(os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_CLOEXEC))
    try:
        try:
            fcntl.flock(line.fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InUse(f"{path}: in use by {user_of(line.fd)}") from None
        settings = termios.tcgetattr(line.fd)
        settings[0] = settings[1] = settings[3] = 0  # nothing done to input, to output, locally
        settings[2] &= ~(termios.CSIZE | termios.PARENB)
        settings[2] |= termios.CS8 | termios.CLOCAL | termios.CREAD
        if baud is not None:
            rate = getattr(termios, f"B{baud}", None)
            if rate is None:
                raise ValueError(f"{baud} baud: the system has no such rate")
            settings[4] = settings[5] = rate
        settings[6][termios.VMIN], settings[6][termios.VTIME] = 1, 0
        termios.tcsetattr(line.fd, termios.TCSANOW, settings)
        termios.tcflush(line.fd, termios.TCIFLUSH)  # answers that somebody before us left
    except BaseException:
        line.close()
        raise
    return line
