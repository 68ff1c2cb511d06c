#!/usr/bin/env python3
"""A simulated robot against the real daemon over a pty, in real time, with a failure in the middle.

First the daemon freezes for a while, then it ends and another one takes its place. The robot must
stop by its fail-safe, count what it lost, come back by itself each time, stay on the path, and end
in an orderly way. Nothing is asserted about how fast any of this happens.

Usage: live_test.py BIN_DIR [SECONDS]      SECONDS: drive on for so long afterwards (default 5)
"""

import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import xml.dom.minidom

from operated_daemon import PATIENCE_S, OperatedDaemon, check, default_config, write_config


class Robot:
    """pheromone-swarm live; remembers the lines it prints."""

    def __init__(self, bin_dir, modem, out):
        self.process = subprocess.Popen(
            [os.path.join(bin_dir, "pheromone-swarm"), "live", "--modem", modem, "--out", out],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.lines = []

    def read_until(self, holds, what):
        """Reads the robot's lines, one a second, until `holds(line)`."""
        end = time.monotonic() + PATIENCE_S
        for line in self.process.stdout:
            self.lines.append(line)
            if holds(line):
                return
            check(time.monotonic() < end, f"gave up waiting until {what}")
        raise AssertionError(f"the robot ended before {what}:\n{''.join(self.lines)}")

    def stop(self):
        self.process.send_signal(signal.SIGINT)
        rest, _ = self.process.communicate(timeout=PATIENCE_S)
        self.lines.append(rest)
        check(self.process.returncode == 0, f"the robot ended with {self.process.returncode}")
        return "".join(self.lines)


def drives(line):
    speeds = re.search(r"wheels +(-?\d+) +(-?\d+) mm/s", line)
    return bool(speeds) and "stands" not in line and int(speeds[1]) + int(speeds[2]) > 0


def stands(line):
    speeds = re.search(r"wheels +(-?\d+) +(-?\d+) mm/s", line)
    return bool(speeds) and int(speeds[1]) == 0 and int(speeds[2]) == 0


def number_of(text, what):
    found = re.search(rf"(\d+) {what}", text)
    check(found, f"the summary does not tell of {what}:\n{text}")
    return int(found[1])


def check_balance(text):
    """Every exchange ended in an answer or was counted as lost; one may be in flight at the end."""
    asked = number_of(text, "requests") + number_of(text, "resynchronisations")
    asked += number_of(text, "hellos")
    ended = number_of(text, "answers") + number_of(text, "HELLO and PING answers")
    ended += number_of(text, "timeouts") + number_of(text, "errors")
    check(0 <= asked - ended <= 1, f"{asked} exchanges begun, {ended} accounted for:\n{text}")


def check_on_the_path(rows):
    """Once the robot has come near the path, it never leaves it."""
    column = rows[0].split(",").index("distance_from_path_mm")
    distances = [float(row.split(",")[column]) for row in rows[1:]]
    near = next((i for i, distance in enumerate(distances) if distance < 50), None)
    check(near is not None, "the robot never came near the path")
    check(max(distances[near:]) < 200, f"the robot left the path: {max(distances[near:])} mm")


def run(bin_dir, folder, seconds):
    modem = os.path.join(folder, "radio-a.pty")
    write_config(folder, default_config(bin_dir))
    daemon = OperatedDaemon(bin_dir, folder)
    robot = Robot(bin_dir, modem, folder)
    try:
        robot.read_until(drives, "the robot drives")

        daemon.process.send_signal(signal.SIGSTOP)
        robot.read_until(stands, "the robot stands for want of answers")
        daemon.process.send_signal(signal.SIGCONT)
        robot.read_until(drives, "the robot drives after the daemon was frozen")

        daemon.stop()
        robot.read_until(stands, "the robot stands without a daemon")
        daemon = OperatedDaemon(bin_dir, folder)
        robot.read_until(drives, "the robot drives with another daemon")
        for _ in range(seconds):
            robot.read_until(drives, "the robot drives on")

        text = robot.stop()
        daemon.stop()
    finally:
        for process in (robot.process, daemon.process):
            if process.poll() is None:
                process.kill()
                process.wait()

    print(text)
    check(number_of(text, "timeouts") > 0, "lost exchanges were not counted")
    check(number_of(text, "fail-safe stops") >= 2, "the fail-safe stops were not counted")
    check(number_of(text, "resynchronisations") > 0, "no resynchronisation was counted")
    check(number_of(text, "reconnects") > 0, "the reconnect was not counted")
    with open(os.path.join(folder, "track.csv"), encoding="ascii") as track:
        rows = track.read().splitlines()
    check(len(rows) > 20 and rows[0].startswith("time_s,x_m,y_m"), "track.csv is no track")
    check(all(len(row.split(",")) == len(rows[0].split(",")) for row in rows), "ragged track.csv")
    check_balance(text)
    check_on_the_path(rows)
    xml.dom.minidom.parse(os.path.join(folder, "track.svg"))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        run(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(temporary), int((sys.argv + ["5"])[2]))
    print("ok")
