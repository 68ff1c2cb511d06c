"""Clients that come and go, or do not read; the client as a program."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import time
from pathlib import Path

from ..client import open_terminal
from ..wire import DLE, START, Message, build, encode
from .daemon import Daemon
from .report import PATIENCE_S, check_equal, log
from .robot import Robot

PYTHON = Path(__file__).resolve().parents[3] / "deploy/python"


def check_reopening(daemon: Daemon, link: str) -> None:
    for turn in range(20):
        with open_terminal(daemon.path(link)) as line:
            check_equal(Robot(line, 5).ping(bytes((turn,))), bytes((turn,)), "PING after opening")
            line.send(START + bytes((5, DLE)))  # and break off after an odd DLE
    daemon.check_alive("after the terminal was closed")
    log("reopening: 20 clients came, broke off and went")


DEAF_S = 10.0  # it takes so long unless the daemon takes all


def check_deaf_client(daemon: Daemon, link: str, other: Robot) -> None:
    """A client that asks and asks and never reads blocks neither the daemon nor other links."""
    wire = encode(build("PING", 5, payload=bytes(16)))
    with open_terminal(daemon.path(link)) as line:
        os.set_blocking(line.fd, False)
        taken, deadline = 0, time.monotonic() + DEAF_S
        while taken < 500_000 and time.monotonic() < deadline:
            try:
                taken += os.write(line.fd, wire)
            except BlockingIOError:
                select.select((), (line.fd,), (), 0.1)  # the daemon may stop reading, too
                if not taken:
                    continue
                check_equal(other.ping(b"meanwhile"), b"meanwhile", "PING on the other link")
        check_equal(other.ping(b"afterwards"), b"afterwards", "PING on the other link")
        os.set_blocking(line.fd, True)
        late = Robot(line, 5).say(b"")
        echo = Message("PING_ANSWER", 5, {"payload": bytes(16)})
        assert all(message == echo for message in late), f"{late} are no echoes"
    daemon.check_alive("after the deaf client")
    log(f"a deaf client: {taken} bytes of PINGs, {len(late)} echoes kept, the other link lives")


def check_program(daemon: Daemon, link: str) -> None:
    """python3 -m pheromone."""

    def run(*words: str) -> str:
        command = (sys.executable, "-B", "-m", "pheromone", "--id", "9", "--timeout", "30",
                   str(daemon.path(link)))
        done = subprocess.run(
            (*command, *words), cwd=PYTHON, capture_output=True, text=True, timeout=PATIENCE_S,
            check=False
        )
        assert done.returncode == 0, f"pheromone {words}: {done.stderr}"
        return done.stdout

    assert "protocol_version 1\n" in run("hello"), "hello"
    assert run("ping", "1002").startswith("echo 10 02 after "), "ping"
    assert run("deposit", "1", "-7000", "600", "2") == "deposited\n", "deposit"
    expected = "left 8192 right 5120 (units: 2 1.25)\n"
    check_equal(run("sense", "1", "-7000", "500", "0"), expected, "sense")
    check_equal(run("trace", "1", "-7000", "500", "0"), expected, "trace")
    log("the program: hello, ping, deposit, sense, trace")
