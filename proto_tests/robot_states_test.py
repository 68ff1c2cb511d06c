#!/usr/bin/env python3
"""Robots brought into each of their states, as API, pheromonectl, metrics and the page show them.

    robot_states_test.py BIN_DIR [COMMAND...]

COMMAND, with the web port after it, runs dashboard/robots_shown.mjs; without it, there is no page.

Robots are simulated Pioneers with pheromone-robot, which tell where they truly are; what a healthy
robot never does, a client in Python does. All along, no robot that has truly stood still for long is
shown as driving.
"""

import contextlib
import json
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

from attach_test import Program
from operated_daemon import PATIENCE_S, OperatedDaemon, check
from stranger import wire
from test_config import link, map_of, pheromone, table

PATH_Y_M = 5.0
SENSE_UNKNOWN = 0x09  # of a pheromone that the server does not have
BATTERY_LOW, POSE_LOST, NET_EXCEPTION = 9, 11, 12
# The server says so after three seconds; the rest is for a busy machine.
STANDS_S = 3.0 + 4.0
CONFIG = (map_of(30.0, 30.0) + pheromone(1, "path")
          + table("[path]", pheromone="path", closed=True,
                  points_m=[[2.0, PATH_Y_M], [28.0, PATH_Y_M], [28.0, 25.0], [2.0, 25.0]])
          + link("udp", "udp", listen="127.0.0.1:0") + table("web", listen="127.0.0.1:0"))


class Robot:
    """A Pioneer that knows where it truly is, and the program that drives it."""

    def __init__(self, stack, bin_dir, udp_port, identifier, start, *options, wall=None):
        self.identifier = identifier
        walls = ("--wall", *wall) if wall else ()
        self.pioneer = Program(bin_dir / "pheromone-swarm", "pioneer", "--tcp", 0, "--start", *start,
                               "--poses", 0.1, *walls, stdin=subprocess.PIPE)
        stack.callback(self.pioneer.kill)
        self.pioneer.await_line("Ctrl-C ends it")
        port = re.search(r"127\.0\.0\.1:(\d+)", self.pioneer.text())[1]
        self.driver = Program(bin_dir / "pheromone-robot", "--robot", f"127.0.0.1:{port}", "--modem",
                              f"udp:127.0.0.1:{udp_port}", "--start", *start, "--id", identifier,
                              *options)
        stack.callback(self.driver.kill)
        self.moved_at = time.monotonic()
        self.pose = None
        self.read = 0

    def look(self):
        """Notes when it moved last."""
        lines = self.pioneer.lines
        while self.read < len(lines):
            found = re.search(r"true pose (.*)", lines[self.read])
            self.read += 1
            if found and found[1] != self.pose:
                self.pose = found[1]
                self.moved_at = time.monotonic()

    def stood_s(self):
        return time.monotonic() - self.moved_at

    def tell(self, line):
        self.pioneer.process.stdin.write(line + "\n")
        self.pioneer.process.stdin.flush()


class Played:
    """A robot that says what it is told to, and where it is."""

    def __init__(self, udp_port, identifier, kind=1):
        self.identifier, self.kind, self.x_mm, self.step_mm = identifier, kind, 3000, 0
        self.line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.line.connect(("127.0.0.1", udp_port))
        self.say(0x71, 1, 1, 0, 0)
        self.seq = 0

    def say(self, code, *data):
        self.line.send(wire.encode(bytes([self.identifier, code, *data])))

    def event(self, code, argument=0):
        self.seq += 1
        self.say(0x52, self.seq, code, *struct.pack("<h", argument))

    def step(self):
        self.x_mm += self.step_mm
        self.say(self.kind, *struct.pack("<hhH", self.x_mm, 20_000, 0))


class Page:
    """The dashboard in a browser; without one, nobody looks."""

    def __init__(self, stack, command, port):
        self.browser = None
        if command:
            self.browser = subprocess.Popen([*command, str(port)], stdin=subprocess.PIPE,
                                            stdout=subprocess.PIPE, text=True)
            stack.callback(self.end)
            self.read()

    def read(self):
        line = self.browser.stdout.readline()
        check(line, "the page is gone")
        return json.loads(line)

    def end(self):
        self.browser.stdin.close()
        check(self.browser.wait(PATIENCE_S) == 0, "the page is not clean")

    def await_text(self, where, text):
        end = time.monotonic() + PATIENCE_S
        shown = ""
        while self.browser and text not in shown:
            check(time.monotonic() < end, f"the page shows \"{shown}\", not \"{text}\"")
            self.browser.stdin.write("\n")
            self.browser.stdin.flush()
            shown = self.read().get(where, "")


class Swarm:
    def __init__(self, stack, bin_dir, folder, page):
        self.stack, self.bin_dir, self.folder = stack, bin_dir, folder
        (folder / "test.toml").write_text(CONFIG)
        self.daemon = OperatedDaemon(bin_dir, folder)
        stack.callback(self.daemon.kill)
        self.port = self.daemon.udp_port()
        self.page = Page(stack, page, self.daemon.web_port())
        self.robots, self.played = {}, {}
        self.over = threading.Event()
        self.player = threading.Thread(target=self.play, daemon=True)
        self.player.start()
        stack.callback(self.player.join)
        stack.callback(self.over.set)

    def play(self):
        while not self.over.wait(0.1):
            for robot in list(self.played.values()):
                robot.step()

    def drive(self, identifier, start, *options, **more):
        self.robots[identifier] = Robot(self.stack, self.bin_dir, self.port, identifier, start,
                                        *options, **more)
        return self.robots[identifier]

    def playing(self, identifier, **options):
        self.played[identifier] = Played(self.port, identifier, **options)
        return self.played[identifier]

    def clients(self):
        status, told = self.daemon.call("GET", "/api/v1/clients")
        check(status == 200, told)
        clients = {client["id"]: client["state"] for client in json.loads(told)["clients"]}
        for robot in self.robots.values():
            robot.look()
            state = clients.get(robot.identifier, {"is": "not known"})
            check(state["is"] not in ("driving", "going to its goal") or robot.stood_s() < STANDS_S,
                  f"robot {robot.identifier} has truly stood for {robot.stood_s():.1f} s, and is shown "
                  f"as {state}")
        return clients

    def await_state(self, identifier, state, reason=""):
        """Until it is shown so, by all who show it."""
        end = time.monotonic() + PATIENCE_S
        shown = state + (f" ({reason})" if reason else "")
        while True:  # a robot that drives stands for a moment if the machine pauses
            seen = self.clients().get(identifier, {})
            told = f"the API has {seen}"
            if (seen.get("is"), seen.get("reason") or "") == (state, reason):
                row = next(line for line in self.tool("clients").splitlines()
                           if re.match(rf"\S+\s+{identifier}\s", line.strip()))
                counted = re.findall(rf'robot_states{{link="udp",state="{state}"}} (\d+)', self.metrics())
                if shown in row and counted and int(counted[0]) >= 1:
                    break
                told += f", pheromonectl clients \"{row}\", metrics count {counted} as {state}"
            driver = self.robots[identifier].driver.text() if identifier in self.robots else ""
            check(time.monotonic() < end, f"robot {identifier} is not \"{shown}\": {told}\n{driver}")
            time.sleep(0.05)
        self.page.await_text(f"udp/{identifier}", f", {state}" + (f", {reason}" if reason else ""))
        print(f"robot {identifier}: {shown}", flush=True)

    def tool(self, *words, status=0):
        done = subprocess.run([str(it) for it in (self.bin_dir / "pheromonectl", "--socket",
                                                  self.folder / "pheromoned.sock", *words)],
                              capture_output=True, text=True, check=False)
        check(done.returncode == status, f"{words}: {done.returncode}\n{done.stdout}{done.stderr}")
        return done.stdout

    def metrics(self):
        return self.daemon.call("GET", "/metrics")[1]


def by_themselves(swarm):
    """What a robot comes to without an operator."""
    on_path = (PATH_Y_M, 0.0)
    swarm.drive(1, (3.0, *on_path), "--released")
    swarm.drive(2, (3.0, *on_path))
    swarm.drive(3, (8.0, *on_path), "--released", wall=(10.0, 4.0, 10.0, 6.0))
    swarm.drive(4, (15.0, 15.0, 0.0), "--released")
    swarm.drive(5, (-5.0, PATH_Y_M, 0.0), "--released")
    by_hand = swarm.drive(6, (25.0, *on_path), "--released")
    swarm.await_state(1, "driving")
    swarm.await_state(2, "halted", "since its start")
    swarm.await_state(3, "halted", "stall or bumper")
    swarm.await_state(4, "trail lost")
    swarm.await_state(5, "off the map")
    swarm.await_state(6, "driving")
    by_hand.tell("stop")
    swarm.await_state(6, "halted", "stopped by hand")


def played(swarm):
    """What robots tell of themselves. 101 drives."""
    swarm.playing(101).step_mm = 5
    for identifier in (102, 103):
        swarm.playing(identifier)
    swarm.playing(104, kind=SENSE_UNKNOWN)
    swarm.await_state(101, "driving")
    swarm.played[101].event(BATTERY_LOW, 110)
    swarm.await_state(101, "alarm", "battery low")
    swarm.played[102].event(POSE_LOST)
    swarm.await_state(102, "halted", "it does not know where it is")
    swarm.played[103].event(NET_EXCEPTION)
    swarm.await_state(103, "halted", "its net has an exception")
    swarm.await_state(104, "refused", "unknown pheromone")


def silent(swarm):
    swarm.robots[4].driver.process.send_signal(signal.SIGSTOP)
    swarm.await_state(4, "silent")
    swarm.robots[4].driver.process.send_signal(signal.SIGCONT)


def by_operators(swarm):
    swarm.tool("command", "udp", 1, "halt")
    swarm.await_state(1, "halted", "by an operator")
    swarm.tool("command", "udp", 1, "resume")
    swarm.await_state(1, "driving")
    swarm.tool("command", "udp", 2, "resume")
    swarm.await_state(2, "driving")
    swarm.tool("goto", "udp", 2, 28, 8)
    swarm.await_state(2, "going to its goal")
    swarm.tool("goto", "udp", 2, 8, 8)
    swarm.await_state(2, "at its goal")
    # 101 is deaf.
    check("robot 101 on udp was not seen to stand" in swarm.tool("halt", status=1), "101 stands")
    swarm.await_state(1, "halted", "by the halt of all")
    swarm.await_state(101, "alarm", "it was told to halt, and moves")
    swarm.robots[4].driver.process.send_signal(signal.SIGSTOP)
    swarm.await_state(4, "silent")
    swarm.page.await_text("halted", "; not yet: robot 101; silent: robot 4")


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        swarm = Swarm(stack, bin_dir, pathlib.Path(folder), sys.argv[2:])
        for part in (by_themselves, played, silent, by_operators):
            part(swarm)
    print("ok")


if __name__ == "__main__":
    main()
