#!/usr/bin/env python3
"""The AVR image in real time against the real daemon over a pty, with a simulated Pioneer.

A smoke test: the robot moves along the path, stands when the daemon is frozen, drives again when it
goes on, and everything ends in an orderly way. What happens when, and to the byte, is tested in
virtual time (avr_firmware_test).

Usage: avr_live_test.py BIN_DIR AVR_LIVE IMAGE
"""

import pathlib
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from operated_daemon import PATIENCE_S, OperatedDaemon, check, write_config  # noqa: E402
from test_config import map_of, pheromone, pty, table  # noqa: E402

# The robot starts at (0, 0), facing along +x: 0.1 m beside a straight path.
CONFIG = (map_of(10.0, 4.0, origin_x_m=-1.0, origin_y_m=-2.0) + pheromone(1, "path")
          + table("[path]", name="line", pheromone="path", shape="polyline",
                  points_m=[[0.0, 0.1], [8.5, 0.1]])
          + pty("radio-a"))


def read_until(robot, lines, holds, what):
    """Reads the robot's lines, two a second, until `holds(x, y)`."""
    end = time.monotonic() + PATIENCE_S
    for line in robot.stdout:
        lines.append(line)
        x_m, y_m = (float(word) for word in line.split()[:2])
        if holds(x_m, y_m):
            return
        check(time.monotonic() < end, f"gave up waiting until {what}:\n{''.join(lines)}")
    raise AssertionError(f"the robot ended before {what}:\n{''.join(lines)}")


def run(bin_dir, avr_live, image, folder):
    write_config(folder, CONFIG)
    lines = []
    with OperatedDaemon(bin_dir, folder) as daemon, subprocess.Popen(
            [avr_live, image, folder / "radio-a.pty"], stdout=subprocess.PIPE, text=True) as robot:
        try:
            read_until(robot, lines, lambda x, y: x > 1.0, "it has moved a metre along the path")
            check(abs(float(lines[-1].split()[1]) - 0.1) < 0.15, f"off the path: {lines[-1]}")

            daemon.process.send_signal(signal.SIGSTOP)
            places = []

            def stands(x_m, y_m):
                places.append((x_m, y_m))
                return len(places) >= 3 and places[-1] == places[-2]

            read_until(robot, lines, stands, "it stands for want of answers")
            daemon.process.send_signal(signal.SIGCONT)
            x_m = places[-1][0]
            read_until(robot, lines, lambda x, y: x > x_m + 0.3, "it drives again")

            robot.send_signal(signal.SIGTERM)
            robot.communicate(timeout=PATIENCE_S)
            check(robot.returncode == 0, f"the robot ended with status {robot.returncode}")
            daemon.stop()
        finally:
            robot.kill()
    print("".join(lines[-1:]))


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        run(*(pathlib.Path(it).resolve() for it in sys.argv[1:]), pathlib.Path(folder))


if __name__ == "__main__":
    main()
