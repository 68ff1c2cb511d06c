#!/usr/bin/env python3
"""Links that fail and come back while others are served, with the real daemon.

    link_life_test.py BIN_DIR SHIM [ROUNDS [PEERS]]      default: 10 rounds, 10000 peers

Six serial ports, a TCP and a UDP link, each with a robot that asks all the time. The ports are
pseudo-terminals that SHIM (server/robots/links/testing/pty_as_serial_shim.c) makes libserialport take for
real ones; pulling one out is closing its other end. In each round first one half of the links is
torn down and comes back, then the other. Meanwhile each robot of the others gets an answer to each
request, its own and once; in the end every link serves, and the daemon holds no more descriptors
and hardly more memory than in the beginning.

Then strangers under many addresses flood the UDP link, and the robots of the others notice nothing.

Nothing is asserted about how fast any of this is. What is told of it: the slowest answers, without
the time for which this test waited for a processor itself (at the lowest priority beside five
builds, an answer took 4.6 s, all of them such waiting); and for how long the daemon's engine had
the slowest batch, by the daemon's own clock. Answers over ports are slower than over sockets: the
kernel carries the bytes of a pseudo-terminal in a thread of its own, flush_to_ldisc in a kworker,
which waits for a processor too. That alone delayed some by 80 to 160 ms, while the daemon's threads
ran and none of their system calls took long, and delays as much in a single process that has both
ends of a pseudo-terminal.
"""

import os
import pathlib
import re
import socket
import sys
import tempfile
import time
import tty

from asking_robot import CONFIG, EXCHANGES, PING, Robot, come_and_go, everyone_answered, serve
from checks import PATIENCE_S, check
from operated_daemon import OperatedDaemon
from stranger.wire import encode

MOST_GROWTH_KIB = 4096


class SerialRobot(Robot):
    def __init__(self, name, client, folder):
        self.port = folder / name
        super().__init__(name, client)

    def connect(self):
        self.fd, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self.fd, False)
        os.symlink(os.ttyname(slave), self.port)
        os.close(slave)

    def tear_down(self):
        os.unlink(self.port)
        os.close(self.fd)

    def send(self, data):
        check(os.write(self.fd, data) == len(data), f"{self.name}: the line is full")

    def receive(self):
        try:
            return os.read(self.fd, 4096)
        except OSError:  # until the daemon has opened the other end
            return b""

    @staticmethod
    def config(name):
        return (f'[[link]]\nname = "{name}"\nkind = "serial"\nport = "./{name}"\nbaud = 115200\n'
                "medium_access = false\n")


class NetworkRobot(Robot):
    def __init__(self, name, client, kind, port):
        self.kind = kind
        self.address = ("127.0.0.1", port)
        super().__init__(name, client)

    def connect(self):
        self.socket = socket.socket(socket.AF_INET, self.kind)
        self.socket.connect(self.address)
        self.socket.setblocking(False)
        self.fd = self.socket.fileno()

    def tear_down(self):
        self.socket.close()

    def send(self, data):
        self.socket.sendall(data)

    def receive(self):
        return self.socket.recv(4096)


class Daemon(OperatedDaemon):
    def port_of(self, link):
        return int(re.search(rf"link {link}: up, \w+ 127\.0\.0\.1:(\d+)", self.log())[1])

    def slowest_batch_s(self):
        """The end of the class of durations in which the daemon counts the slowest one."""
        metrics = self.call("GET", "/metrics")[1]
        classes = re.findall(r'pheromone_batch_seconds_bucket{le="(\S+)"} (\d+)', metrics)
        return next(float(end) for end, count in classes if count == classes[-1][1])

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))


def await_equal(read, expected, what):
    """The daemon closes its side a moment after we do."""
    end = time.monotonic() + PATIENCE_S
    while read() != expected:
        check(time.monotonic() < end, f"{what}: {read()}, in the beginning {expected}")
        time.sleep(0.05)


def check_memory(daemon, before_kib, what):
    growth_kib = daemon.rss_kib() - before_kib
    print(f"{what}: the daemon has grown by {growth_kib} KiB", flush=True)
    check(daemon.keeps_memory or growth_kib < MOST_GROWTH_KIB, f"{what}: +{growth_kib} KiB")


def rounds_of_loss(daemon, robots, rounds):
    serve(robots, everyone_answered(robots, EXCHANGES), "all are well")
    halves = (robots[0::2], robots[1::2])
    for half in halves:  # once before it is measured: what is needed for that is kept
        come_and_go(robots, half)
    descriptors, memory_kib = daemon.descriptors(), daemon.rss_kib()
    for robot in robots:
        robot.slowest_s = 0.0
    for _ in range(rounds):
        for half in halves:
            come_and_go(robots, half)
    ports, sockets = (max(robot.slowest_s for robot in robots if isinstance(robot, kind))
                      for kind in (SerialRobot, NetworkRobot))
    print(f"{rounds} rounds, {sum(robot.exchanges for robot in robots)} exchanges; the slowest "
          f"answer after {ports * 1000:.0f} ms over a port, {sockets * 1000:.0f} ms over a socket; "
          f"the slowest batch up to {daemon.slowest_batch_s() * 1000:g} ms in the engine",
          flush=True)
    await_equal(daemon.descriptors, descriptors, "descriptors")
    check_memory(daemon, memory_kib, f"{rounds} rounds")


def strangers(daemon, robots, address, count):
    """Each under an address of its own in 127.0.0.0/8, with any client's ID."""
    calm = [robot for robot in robots if not (isinstance(robot, NetworkRobot)
                                              and robot.kind == socket.SOCK_DGRAM)]
    memory_kib = daemon.rss_kib()
    for peer in range(count):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.bind((f"127.{1 + (peer >> 16)}.{peer >> 8 & 255}.{peer & 255}", 0))
            stranger.sendto(encode(bytes((1 + peer % 254, PING))), address)
        if peer % 500 == 0:
            serve(calm, everyone_answered(calm), "strangers flood another link")
    check_memory(daemon, memory_kib, f"{count} strangers")


def run(bin_dir, shim, folder, rounds, peers):
    names = [f"modem-{i}" for i in range(1, 7)]
    (folder / "test.toml").write_text(
        CONFIG + "".join(SerialRobot.config(name) for name in names)
        + "".join(f'[[link]]\nname = "{kind}"\nkind = "{kind}"\nlisten = "127.0.0.1:0"\n'
                  for kind in ("tcp", "udp")), encoding="ascii")
    robots = [SerialRobot(name, i + 1, folder) for i, name in enumerate(names)]
    daemon = Daemon(bin_dir, folder, LD_PRELOAD=str(shim))
    try:
        robots.append(NetworkRobot("tcp", 7, socket.SOCK_STREAM, daemon.port_of("tcp")))
        robots.append(NetworkRobot("udp", 8, socket.SOCK_DGRAM, daemon.port_of("udp")))
        rounds_of_loss(daemon, robots, rounds)
        strangers(daemon, robots, robots[-1].address, peers)
        daemon.stop()
        again = re.findall(r"opened \d+ times", daemon.log())
        check(len(again) >= 6, f"the summary does not tell of ports opened again:\n{daemon.log()}")
    except BaseException:
        print(daemon.log(), file=sys.stderr)
        raise
    finally:
        daemon.kill()


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[3:]] + [10, 10_000][len(sys.argv[3:]):]
    with tempfile.TemporaryDirectory() as temporary:
        run(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(),
            pathlib.Path(temporary), numbers[0], numbers[1])
    print("ok")
