#!/usr/bin/env python3
"""Robots in bad air and the real daemon with its journal, in real time: 0, 1 and 3 % of bytes damaged.

Channel and modems are simulated; the daemon's end is a pty with medium_access = true. The robots leave
trails, so that each answer waits for the journal. Every robot must get answers, and from 1 % on ROUNDs
must be coded; the rates are printed, beside B_1, one exchange at a time with instant knowledge of what
was lost.

Usage: bad_air_live_test.py BIN_DIR [SECONDS]     default: 60 of each case
"""

import csv
import pathlib
import sys
import tempfile

from asking_robot import CONFIG
from checks import check
from operated_daemon import OperatedDaemon
from swarm_live_test import Swarm, end_processes
from swarm_rounds_test import LINK, SCENARIO, channel

CASES = [(robots, damaged) for robots in (8, 4) for damaged in (0.0, 0.01, 0.03)]
TRACE_BYTES = 15 + 13
BYTE_S = 10 / 9600
TURNAROUND_S = 0.002


def bound(damaged):
    return (1 - damaged) ** TRACE_BYTES / (TRACE_BYTES * BYTE_S + 2 * TURNAROUND_S)


def measure(bin_dir, folder, robots, damaged, seconds):
    (folder / "test.toml").write_text(CONFIG.replace("tau_s = 30.0", "tau_s = 0") + LINK)
    scenario = folder / "scenario.toml"
    bit_error = 1 - (1 - damaged) ** (1 / 8)
    scenario.write_text(SCENARIO.replace("duration_s = 15", f"duration_s = {seconds}")
                        .replace("count = 8", f"count = {robots}")
                        .replace("[radio]", f"[radio]\nbit_error = {bit_error:.6f}"))
    daemon = OperatedDaemon(bin_dir, folder)
    swarm = None
    try:
        swarm = Swarm(bin_dir, scenario, [str(folder / "radio-a.pty")], folder / "out",
                      "--medium-access")
        swarm.process.wait(seconds + 60)
        counters = channel(bin_dir, daemon)
        daemon.stop()
    finally:
        end_processes(swarm, daemon)
    with open(folder / "out" / "robots.csv", encoding="ascii") as file:
        rows = list(csv.DictReader(file))
    answers = [int(row["answers"]) for row in rows]
    check(len(answers) == robots and min(answers) > 0, f"answers: {answers}")
    check(damaged == 0 or counters["coded_rounds"] > counters["rounds"] / 2,
          f"rounds were not coded: {counters}")
    rate = sum(answers) / seconds
    most = min(bound(damaged), 5 * robots)
    print(f"{robots} robots, {100 * damaged:g} %: {rate:.1f} answers/s, {rate / most:.2f} of B_1; "
          f"least of a robot {min(answers) / seconds:.1f}/s; "
          f"{sum(int(row['fail_safe_stops']) for row in rows)} fail-safe stops; "
          f"{counters['rounds']} rounds, {counters['coded_rounds']} coded", flush=True)


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    seconds = int(sys.argv[2]) if len(sys.argv) > 2 else 60
    for robots, damaged in CASES:
        with tempfile.TemporaryDirectory() as folder:
            measure(bin_dir, pathlib.Path(folder), robots, damaged, seconds)
    print("ok")


if __name__ == "__main__":
    main()
