#!/usr/bin/env python3
"""Robots with two servers, one of which is absent, stops, is killed, or comes back.

The servers are no cluster: they have the same configuration and painted path, and epochs of their
own. So each move also shows that the robot says HELLO again and drives on.

Usage: several_servers_test.py BIN_DIR [ROUNDS]

With ROUNDS, 20 say, it measures instead: over UDP and TCP, with SIGKILL and SIGSTOP, as often as that
the server is taken away from a robot that senses and from one that lays a trail, and a table tells for
how long they had no answer, and how often that stopped them.
"""

import contextlib
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

from attach_test import PATH_Y, START, Pioneer, Program, ends
from free_numbers import free_port
from operated_daemon import PATIENCE_S, OperatedDaemon, await_that, check
from stranger.client import Client, NoAnswer
from stranger.servers import Servers
from stranger.testing.report import check_equal
from test_config import link, map_of, pheromone


class Server:
    """A daemon with a path painted, at ports that stay the same."""

    def __init__(self, bin_dir, folder):
        self.bin_dir, self.folder = bin_dir, folder
        folder.mkdir()
        self.ports = {"tcp": free_port(), "udp": free_port()}
        (folder / "test.toml").write_text(map_of(60.0, 4.0, wide=True) + pheromone(1, "path") + "".join(
            link(kind, kind, listen=f"127.0.0.1:{port}") for kind, port in self.ports.items()))
        self.start()

    def start(self):
        self.daemon = OperatedDaemon(self.bin_dir, self.folder)
        subprocess.run([self.bin_dir / "pheromonectl", "paint", "path", "1", str(PATH_Y), "58",
                        str(PATH_Y), "--radius", "0.05"], cwd=self.folder, check=True,
                       stdout=subprocess.DEVNULL, timeout=PATIENCE_S)

    def address(self, kind):
        return ("udp:" if kind == "udp" else "") + f"127.0.0.1:{self.ports[kind]}"

    def take_away(self, sent):
        self.daemon.process.send_signal(sent)
        if sent == signal.SIGKILL:
            self.daemon.process.wait()
        else:
            os.waitid(os.P_PID, self.daemon.process.pid, os.WSTOPPED)

    def bring_back(self, sent):
        if sent == signal.SIGSTOP:
            self.daemon.process.send_signal(signal.SIGCONT)
        else:
            self.start()


class World:
    """Two servers, and robots with their Pioneers."""

    def __init__(self, bin_dir, folder):
        self.bin_dir = bin_dir
        self.ending = contextlib.ExitStack()
        self.servers = []
        for name in ("a", "b"):
            self.servers.append(Server(bin_dir, folder / name))
            self.ending.callback(lambda server=self.servers[-1]: server.daemon.kill())

    def robot(self, addresses, *options):
        """One that drives."""
        pioneer = Pioneer(self.bin_dir, "--tcp", "0")
        self.ending.callback(pioneer.kill)
        modems = [word for address in addresses for word in ("--modem", address)]
        robot = Program(self.bin_dir / "pheromone-robot", "--robot", f"127.0.0.1:{pioneer.tcp_port()}",
                        *modems, "--start", *START, "--wide", "--speed", "300", "--released", *options)
        self.ending.callback(robot.kill)
        robot.await_line(" drives")
        return robot, pioneer

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.ending.close()


def nobody(kind):
    return ("udp:" if kind == "udp" else "") + f"127.0.0.1:{free_port()}"


def spoken_to(robot):
    """The address of the server that has answered it last, as it tells. A server that is late on a busy
    machine is left, too."""
    return re.findall(r"server (\S+): (?:answers|HELLO answered)", robot.text())[-1]


def await_greeting(robot, address, since):
    """Steers by its answers, and has said HELLO to it."""
    await_that(lambda: spoken_to(robot) == address, f"{address} answers")
    robot.await_line(f"server {address}: HELLO answered", since)


def passes_over_a_server_that_is_absent(bin_dir, folder):
    with World(bin_dir, folder) as world:
        for kind in ("udp", "tcp"):
            absent, present = nobody(kind), world.servers[0].address(kind)
            for addresses in ((absent, present), (present, absent)):
                robot, _ = world.robot(addresses)
                await_greeting(robot, present, 0)
                ends(robot, signal.SIGTERM)


def drives_on_with_the_other_server(bin_dir, folder, kind, lays_trail):
    """One freezes, and is back; then the other one is killed."""
    with World(bin_dir, folder) as world:
        by_address = {server.address(kind): server for server in world.servers}
        robot, pioneer = world.robot(by_address, *(["--lay-trail"] if lays_trail else []))
        for sent in (signal.SIGSTOP, signal.SIGKILL):
            since = len(robot.lines)
            here = spoken_to(robot)
            by_address[here].take_away(sent)
            there = next(address for address in by_address if address != here)
            await_greeting(robot, there, since)
            pioneer.drives()
            by_address[here].bring_back(sent)
        ends(robot, signal.SIGTERM)
        print(robot.text())


def a_client_written_from_the_specification_goes_on_too(bin_dir, folder):
    """And what it lays is there once, where it was answered."""
    here = {"pheromone": 1, "x": 5000, "y": 3500, "heading": 0}
    with World(bin_dir, folder) as world:
        first, second = world.servers
        with Servers([nobody("udp"), first.address("udp"), second.address("udp")]) as line:
            robot = Client(line, 9, timeout=3)  # a server that is late on a busy machine is not left
            epoch = robot.hello(1).epoch
            check_equal(line.server, 1, "the first of the list that is there")
            before = robot.sense(**here).left
            robot.deposit(1, here["x"], here["y"])
            quantum = robot.sense(**here).left - before
            check(quantum > 100, f"a deposit is sensed: {quantum}")

            first.take_away(signal.SIGSTOP)
            with contextlib.suppress(NoAnswer):
                robot.sense(**here)
            check_equal(robot.sense(**here).left, before, "the second has nothing there")
            check_equal(line.server, 2, "it went on")
            robot.trace(**here)  # its epoch was noticed: otherwise it would have to say hello
            check_equal(robot.sense(**here).left - before, quantum, "one quantum at the second")
            first.bring_back(signal.SIGSTOP)
            robot.ping(b"still")
            check_equal(line.server, 2, "it stays where it is answered")

            second.take_away(signal.SIGKILL)
            robot.trace(**here)
            check_equal(line.server, 1, "round the list")
            check(abs(robot.sense(**here).left - before - 2 * quantum) <= 1, "two quanta at the first")
            check_equal(robot.hello(1).epoch, epoch, "the first has not changed")
        second.bring_back(signal.SIGKILL)
        with Servers([nobody("tcp"), first.address("tcp"), second.address("tcp")]) as line:
            robot = Client(line, 10, timeout=3)
            epoch = robot.hello(1).epoch
            first.take_away(signal.SIGKILL)
            robot.ping(b"who?")
            check_equal(line.server, 2, "it went on")
            check(robot.hello(1).epoch != epoch, "and noticed the other epoch")


def silence_s(robot, address, since):
    """For how long it had no answer before it went there."""
    told = robot.await_line(f"server {address}: answers, ", since)
    return float(re.search(r"answers, ([\d.]+) s after", robot.lines[told - 1])[1])


def measure(bin_dir, rounds):
    print("silence of a robot with two servers when one is taken away, s, and fail-safe stops of all rounds")
    print("kind  signal   request  rounds  median     max  stops")
    for kind in ("udp", "tcp"):
        for sent in (signal.SIGKILL, signal.SIGSTOP):
            with tempfile.TemporaryDirectory() as folder, World(bin_dir, pathlib.Path(folder)) as world:
                by_address = {server.address(kind): server for server in world.servers}
                robots = {"SENSE": world.robot(by_address)[0],
                          "TRACE": world.robot(by_address, "--id", "2", "--lay-trail")[0]}
                silences = {name: [] for name in robots}
                for _ in range(rounds):
                    since = {name: len(robot.lines) for name, robot in robots.items()}
                    here = spoken_to(robots["SENSE"])
                    there = next(address for address in by_address if address != here)
                    concerned = {name: robot for name, robot in robots.items() if spoken_to(robot) == here}
                    by_address[here].take_away(sent)
                    for name, robot in concerned.items():
                        silences[name].append(silence_s(robot, there, since[name]))
                        await_greeting(robot, there, since[name])  # its epoch is another one
                    by_address[here].bring_back(sent)
                for name, robot in robots.items():
                    ends(robot, signal.SIGTERM)
                    stops = re.search(r"(\d+) fail-safe stops", robot.text())[1]
                    row = sorted(silences[name])
                    print(f"{kind:4}  {sent.name}  {name}    {len(row):6}  {row[len(row) // 2]:6.3f}  "
                          f"{row[-1]:6.3f}  {stops:>5}", flush=True)


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    if len(sys.argv) > 2:
        measure(bin_dir, int(sys.argv[2]))
        return
    for test in (passes_over_a_server_that_is_absent,
                 a_client_written_from_the_specification_goes_on_too):
        print(f"--- {test.__name__}", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            test(bin_dir, pathlib.Path(folder))
    for kind in ("udp", "tcp"):
        for lays_trail in (False, True):
            print(f"--- drives_on_with_the_other_server: {kind}, lays a trail: {lays_trail}", flush=True)
            with tempfile.TemporaryDirectory() as folder:
                drives_on_with_the_other_server(bin_dir, pathlib.Path(folder), kind, lays_trail)
    print("ok")


if __name__ == "__main__":
    main()
