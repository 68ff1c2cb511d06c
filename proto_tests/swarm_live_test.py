#!/usr/bin/env python3
"""Robots that share a radio channel with the real daemon, in real time, and the end of such a run.

Three robots, two of them Pioneers, run on one channel against pheromoned's pty; in a second run two
channels lead to two ptys. The daemon freezes, ends, and another one takes its place: answers must
come again to every robot, and the program must end in an orderly way on SIGINT and at the end of
the scenario, and leave its files. Nothing is asserted about how fast any of this happens.

Usage: swarm_live_test.py BIN_DIR
"""

import csv
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
from test_config import pty

EXAMPLE = os.path.join(os.path.dirname(os.path.abspath(__file__)),
                       "../client_fw/swarm/examples/live.toml")


class Swarm:
    """pheromone-swarm run --daemon; remembers the lines it prints."""

    def __init__(self, bin_dir, scenario, ports, out, *arguments):
        self.process = subprocess.Popen(
            [os.path.join(bin_dir, "pheromone-swarm"), "run", scenario, "--daemon",
             ",".join(ports), "--out", out, *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.lines = []

    def read_until(self, answered, what):
        """Reads the lines, one a second, until `answered(robots with answers, robots)`."""
        end = time.monotonic() + PATIENCE_S
        for line in self.process.stdout:
            self.lines.append(line)
            found = re.search(r"(\d+) of (\d+) robots got answers", line)
            if found and answered(int(found[1]), int(found[2])):
                return
            check(time.monotonic() < end, f"gave up waiting until {what}")
        raise AssertionError(f"the program ended before {what}:\n{''.join(self.lines)}")

    def finish(self, stop):
        if stop:
            self.process.send_signal(signal.SIGINT)
        rest, _ = self.process.communicate(timeout=PATIENCE_S)
        self.lines.append(rest)
        text = "".join(self.lines)
        check(self.process.returncode == 0,
              f"the program ended with {self.process.returncode}:\n{text}")
        return text


def all_of(answered, robots):
    return answered == robots


def none_of(answered, _robots):
    return answered == 0


def end_processes(*owners):
    for owner in owners:
        if owner is not None and owner.process.poll() is None:
            owner.process.kill()
            owner.process.wait()


def check_files(out, robots):
    with open(os.path.join(out, "robots.csv"), encoding="ascii") as file:
        rows = list(csv.DictReader(file))
    check(len(rows) == robots, f"robots.csv has {len(rows)} robots")
    answers = {row["robot"]: int(row["answers"]) for row in rows}
    check(all(count > 0 for count in answers.values()), f"answers: {answers}")
    with open(os.path.join(out, "exchanges.csv"), encoding="ascii") as file:
        exchanges = list(csv.DictReader(file))
    for robot, count in answers.items():
        listed = sum(exchange["robot"] == robot for exchange in exchanges)
        # Of answers within the same millisecond there is one line.
        check(0 < listed <= count, f"robot {robot}: {listed} exchanges listed of {count}")
    with open(os.path.join(out, "tracks.csv"), encoding="ascii") as file:
        tracks = list(csv.DictReader(file))
    check({row["robot"] for row in tracks} == set(answers), "tracks.csv lacks robots")
    xml.dom.minidom.parse(os.path.join(out, "map.svg"))
    check(os.path.getsize(os.path.join(out, "summary.txt")) > 0, "summary.txt is empty")


def recovers_from_a_daemon_that_freezes_and_restarts(bin_dir, folder):
    ports = [os.path.join(folder, "radio-a.pty")]
    out = os.path.join(folder, "out")
    with open(EXAMPLE, encoding="utf-8") as file:
        example = file.read()
    scenario = os.path.join(folder, "long.toml")
    with open(scenario, "w", encoding="utf-8") as file:
        file.write(example.replace("duration_s = 30", "duration_s = 3600"))
    write_config(folder, default_config(bin_dir))
    daemon = OperatedDaemon(bin_dir, folder)
    swarm = Swarm(bin_dir, scenario, ports, out)
    try:
        swarm.read_until(all_of, "every robot gets answers")
        daemon.process.send_signal(signal.SIGSTOP)
        swarm.read_until(none_of, "nobody answers")
        daemon.process.send_signal(signal.SIGCONT)
        swarm.read_until(all_of, "every robot gets answers again")
        daemon.stop()
        swarm.read_until(none_of, "nobody is there to answer")
        daemon = OperatedDaemon(bin_dir, folder)
        swarm.read_until(all_of, "every robot gets answers from another daemon")
        text = swarm.finish(stop=True)
        daemon.stop()
    finally:
        end_processes(swarm, daemon)
    print(text)
    check(re.search(r", [1-9]\d* reconnects", text), "the reconnect was not counted")
    stops = [int(count) for count in re.findall(r"(\d+) fail-safe stops", text)]
    check(len(stops) == 3 and min(stops) >= 1, f"fail-safe stops: {stops}")
    check_files(out, 3)


def ends_by_itself_with_two_channels(bin_dir, folder):
    ports = [os.path.join(folder, f"radio-{letter}.pty") for letter in "ab"]
    out = os.path.join(folder, "out")
    config = default_config(bin_dir)
    before, _, rest = config.partition('[[link]]\nname = "radio-a"')
    check(rest, "the default configuration has no link radio-a")
    rest = rest[rest.index("[limits]"):]
    write_config(folder, before + "".join(map(pty, ("radio-a", "radio-b"))) + rest)
    with open(EXAMPLE, encoding="utf-8") as file:
        example = file.read()
    scenario = os.path.join(folder, "short.toml")
    with open(scenario, "w", encoding="utf-8") as file:
        file.write("[radio]\nchannels = 2\n" + example.replace("duration_s = 30",
                                                               "duration_s = 5"))
    daemon = OperatedDaemon(bin_dir, folder)
    swarm = None
    try:
        swarm = Swarm(bin_dir, scenario, ports, out)
        print(swarm.finish(stop=False))
        daemon.stop()
    finally:
        end_processes(swarm, daemon)
    check_files(out, 3)


def tells_what_is_wrong_with_ports(bin_dir, folder):
    for ports, expected in (("nowhere.pty", "nowhere.pty: No such file or directory"),
                            ("a.pty,b.pty", "1 channels, but 2 ports")):
        run = subprocess.run([os.path.join(bin_dir, "pheromone-swarm"), "run", EXAMPLE, "--daemon",
                              ports], cwd=folder, capture_output=True, text=True, check=False)
        check(run.returncode == 1 and expected in run.stderr, f"{run.returncode}: {run.stderr}")


if __name__ == "__main__":
    for test in (tells_what_is_wrong_with_ports, ends_by_itself_with_two_channels,
                 recovers_from_a_daemon_that_freezes_and_restarts):
        with tempfile.TemporaryDirectory() as temporary:
            test(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(temporary))
    print("ok")
