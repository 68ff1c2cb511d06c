#!/usr/bin/env python3
"""Eight robots on a radio channel that the real daemon shares out in rounds, in real time.

The robots leave trails, so that each answer waits for the journal. Their channel and its modems are
simulated; the daemon's end is a pty with medium_access = true. For a while the daemon freezes: every
robot must get answers again, and everything must end in an orderly way. While the journal's disk is
stuck, every robot must go on getting answers. Nothing is asserted about
how fast any of this happens.

Usage: swarm_rounds_test.py BIN_DIR
"""

import csv
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile

from asking_robot import CONFIG
from checks import check
from operated_daemon import OperatedDaemon
from swarm_live_test import Swarm, all_of, end_processes, none_of

LINK = """
[[link]]
name = "radio-a"
kind = "pty"
path = "radio-a.pty"
medium_access = true
baud = 9600
turnaround_ms = 2
server_delay_ms = 20
adapter_latency_ms = 0
[journal]
folder = "journal"
"""
SCENARIO = """
[run]
duration_s = 15
[radio]
baud = 9600
turnaround_s = 0.002
""" + CONFIG.replace("tau_s = 30.0", "tau_s = 0") + """
[[robots]]
pheromone = "trail"
count = 8
trail = true
speed_m_per_s = 0.1
spread_m = 1.0
starts = [[5, 5, 0]]
"""


def channel(bin_dir, daemon):
    """The counters of the link, as pheromonectl tells them."""
    told = subprocess.run(
        [bin_dir / "pheromonectl", "--socket", daemon.folder / "pheromoned.sock", "--json", "links"],
        check=True, capture_output=True, text=True).stdout
    return json.loads(told)["links"][0]["counters"]


def check_answers(out):
    with open(out / "robots.csv", encoding="ascii") as file:
        answers = [int(row["answers"]) for row in csv.DictReader(file)]
    check(len(answers) == 8 and min(answers) > 0, f"answers: {answers}")


def serves_eight_robots_in_rounds(bin_dir, folder):
    (folder / "test.toml").write_text(CONFIG.replace("tau_s = 30.0", "tau_s = 0") + LINK)
    scenario = folder / "scenario.toml"
    scenario.write_text(SCENARIO)
    daemon = OperatedDaemon(bin_dir, folder)
    swarm = None
    try:
        swarm = Swarm(bin_dir, scenario, [str(folder / "radio-a.pty")], folder / "out",
                      "--medium-access")
        print(swarm.finish(stop=False))
        counters = channel(bin_dir, daemon)
        print(json.dumps(counters))
        check(counters["rounds"] > 0, "there were no rounds")
        check(counters["turns"] > counters["missed_turns"], "nobody took a turn")
        daemon.stop()
    finally:
        end_processes(swarm, daemon)
    check_answers(folder / "out")


def answers_while_the_disk_is_stuck(bin_dir, folder):
    (folder / "test.toml").write_text(CONFIG.replace("tau_s = 30.0", "tau_s = 0") + LINK)
    scenario = folder / "scenario.toml"
    scenario.write_text(SCENARIO.replace("duration_s = 15", "duration_s = 3600"))
    daemon = OperatedDaemon(bin_dir, folder, SICK_DISK=str(folder), LD_PRELOAD=str(
        bin_dir.parent / "tests" / "libsick_disk_shim.so"))
    swarm = None
    try:
        swarm = Swarm(bin_dir, scenario, [str(folder / "radio-a.pty")], folder / "out",
                      "--medium-access")
        swarm.read_until(all_of, "every robot gets answers")
        (folder / "stuck").touch()
        for _ in range(3):
            swarm.read_until(all_of, "every robot gets answers while the disk is stuck")
        (folder / "stuck").unlink()
        swarm.read_until(all_of, "every robot gets answers again")
        swarm.finish(stop=True)
        daemon.stop()
    finally:
        (folder / "stuck").unlink(missing_ok=True)
        end_processes(swarm, daemon)
    check_answers(folder / "out")


def recovers_from_a_daemon_that_freezes(bin_dir, folder):
    (folder / "test.toml").write_text(CONFIG.replace("tau_s = 30.0", "tau_s = 0") + LINK)
    scenario = folder / "scenario.toml"
    scenario.write_text(SCENARIO.replace("duration_s = 15", "duration_s = 3600"))
    daemon = OperatedDaemon(bin_dir, folder)
    swarm = None
    try:
        swarm = Swarm(bin_dir, scenario, [str(folder / "radio-a.pty")], folder / "out",
                      "--medium-access")
        swarm.read_until(all_of, "every robot gets answers")
        daemon.process.send_signal(signal.SIGSTOP)
        swarm.read_until(none_of, "nobody answers")
        daemon.process.send_signal(signal.SIGCONT)
        swarm.read_until(all_of, "every robot gets answers again")
        before = channel(bin_dir, daemon)["rounds"]
        swarm.read_until(lambda *_: channel(bin_dir, daemon)["rounds"] > before, "rounds go on")
        swarm.finish(stop=True)
        daemon.stop()
    finally:
        end_processes(swarm, daemon)
    check_answers(folder / "out")


if __name__ == "__main__":
    for test in (serves_eight_robots_in_rounds, answers_while_the_disk_is_stuck,
                 recovers_from_a_daemon_that_freezes):
        with tempfile.TemporaryDirectory() as temporary:
            test(pathlib.Path(os.path.abspath(sys.argv[1])), pathlib.Path(temporary))
    print("ok")
