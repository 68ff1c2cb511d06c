#!/usr/bin/env python3
"""The daemon behind every kind of modem, in real time: each turnaround at each baud rate.

One robot a channel asks ten times a second and leaves a trail, so that each answer waits for the
journal. `pheromone-swarm run --daemon` plays both modems and the channel; the daemon's end is a pty
with medium_access = true. A USB adapter holds what it receives back for 1 or 16 ms. Prints, for each
channel, the requests and what became of them; at least 999 of 1000 have to be answered. (A pty has
no line that keys a modem: serial_link_test has one.)

Usage: live_matrix_test.py BIN_DIR [SECONDS_A_CHANNEL]   (45; at most 50)
"""

import csv
import os
import pathlib
import sys
import tempfile

from asking_robot import CONFIG
from checks import check
from operated_daemon import OperatedDaemon
from swarm_live_test import Swarm, end_processes

TURNAROUNDS_MS = (0, 2, 5, 12, 20, 50)
BAUDS = (9600, 19200, 38400, 57600, 115200)
ADAPTERS_MS = (0, 1, 16)
SERVER_DELAY_MS = 20  # of a busy machine with a journal on an ordinary disk
FIRST_WINDOW_MS = 100  # of a robot that does not yet know its server's

MAP = CONFIG.replace("tau_s = 30.0", "tau_s = 0")
LINK = """
[[link]]
name = "{name}"
kind = "pty"
path = "{name}.pty"
medium_access = true
baud = {baud}
turnaround_ms = {turnaround_ms}
server_delay_ms = {delay_ms}
adapter_latency_ms = {adapter_ms}
"""
SCENARIO = """
[run]
duration_s = {seconds}
[radio]
baud = {baud}
turnaround_s = {turnaround_s}
server_delay_s = {delay_s}
adapter_latency_s = {adapter_s}
{map}
[[robots]]
pheromone = "trail"
trail = true
speed_m_per_s = 0.02
period_s = {period_s}
starts = [[5, 5, 0]]
"""


def cases(adapter_ms):
    for baud in BAUDS:
        for turnaround_ms in TURNAROUNDS_MS:
            yield {"baud": baud, "turnaround_ms": turnaround_ms, "adapter_ms": adapter_ms,
                   "delay_ms": SERVER_DELAY_MS,
                   "name": f"b{baud}t{turnaround_ms}a{adapter_ms}"}


def run(bin_dir, folder, adapter_ms, seconds):
    """Returns (case, requests, answers, timeouts, errors, stops) of each channel."""
    all_cases = list(cases(adapter_ms))
    (folder / "test.toml").write_text(
        MAP + "".join(LINK.format(**case) for case in all_cases) +
        '[journal]\nfolder = "journal"\n')
    daemon = OperatedDaemon(bin_dir, folder)
    swarms = []
    try:
        for case in all_cases:
            scenario = folder / f"{case['name']}.toml"
            # The longest exchange: a TRACE of 27 bytes, its answer, and the window between them.
            exchange_s = (60 * 10 / case["baud"] +
                          (3 * case["turnaround_ms"] + case["adapter_ms"] + 2 * SERVER_DELAY_MS) /
                          1000)
            scenario.write_text(SCENARIO.format(
                seconds=seconds, baud=case["baud"], turnaround_s=case["turnaround_ms"] / 1000,
                delay_s=SERVER_DELAY_MS / 1000, adapter_s=adapter_ms / 1000, map=MAP,
                period_s=round(max(0.1, exchange_s), 3)))
            swarms.append(Swarm(bin_dir, scenario, [str(folder / f"{case['name']}.pty")],
                                folder / case["name"], "--medium-access"))
        for swarm in swarms:
            swarm.finish(stop=False)
        daemon.stop()
    finally:
        end_processes(*swarms, daemon)
    for case in all_cases:
        with open(folder / case["name"] / "robots.csv", encoding="ascii") as file:
            row = next(csv.DictReader(file))
        yield (case, *(int(row[key]) for key in
                       ("requests", "answers", "timeouts", "errors", "fail_safe_stops")))


def main(bin_dir, seconds):
    requests_in_all = answers_in_all = lost = 0
    print("adapter_ms,baud,turnaround_ms,requests,answers,timeouts,errors,fail_safe_stops")
    for adapter_ms in ADAPTERS_MS:
        with tempfile.TemporaryDirectory() as temporary:
            for case, requests, answers, *others in run(bin_dir, pathlib.Path(temporary),
                                                        adapter_ms, seconds):
                print(adapter_ms, case["baud"], case["turnaround_ms"], requests, answers, *others,
                      sep=",", flush=True)
                requests_in_all += requests
                answers_in_all += answers
                # One may be under way at the end; the first HELLO may not wait for long enough.
                slow = 2 * case["turnaround_ms"] + adapter_ms + SERVER_DELAY_MS > FIRST_WINDOW_MS
                lost += max(0, requests - answers - 1 - int(slow))
                check(answers > 0, f"nothing was answered on {case['name']}")
    print(f"{answers_in_all} of {requests_in_all} requests answered, {lost} lost")
    check(lost * 1000 <= requests_in_all, f"{lost} lost, expected at most one of 1000")


if __name__ == "__main__":
    main(pathlib.Path(os.path.abspath(sys.argv[1])), int(sys.argv[2]) if len(sys.argv) > 2 else 45)
    print("ok")
