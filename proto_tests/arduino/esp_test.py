#!/usr/bin/env python3
"""A sketch for an ESP on this host against the real daemon's UDP link, in real time.

    esp_test.py BIN_DIR SKETCH [KEY_H]

The robot waits for a resume, follows a path, stands when the daemon is frozen, and goes on. Settings
told over the radio are in its EEPROM when it starts again, with another nonce. When it was not
switched on but reset, it does not know where it is, and stands for twice as long as one that was
switched on needed to drive on. With KEY_H, the sketch's, the link requires signing, which a
sketch that cannot write to its EEPROM does not do.
"""

import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from operated_daemon import OperatedDaemon, await_that, check, write_config  # noqa: E402
from operated_robot import OperatedRobot, signing  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402

# The robot starts at (0, 0), facing along +x: 0.05 m beside a straight path.
CONFIG = (map_of(12.0, 4.0, bias_m=0.1, origin_x_m=-1.0, origin_y_m=-2.0) + pheromone(1, "path")
          + table("[path]", name="line", pheromone="path", shape="polyline",
                  points_m=[[0.0, 0.05], [10.5, 0.05]]))
START_RELEASED = 12
FIRST_NONCE = 41_001  # of an EEPROM that is empty: shim/host.cc has no random numbers


class Robot:
    def __init__(self, program, port, eeprom, *how):
        self.process = subprocess.Popen([program, str(port), eeprom, *how], stdout=subprocess.PIPE,
                                        text=True)
        self.x_m = self.y_m = 0.0
        self.lines = 0
        self.standing = 0  # the last of them, without a move
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            x_m, y_m, _ = (float(word) for word in line.split())
            self.standing = self.standing + 1 if (x_m, y_m) == (self.x_m, self.y_m) else 0
            self.x_m, self.y_m = x_m, y_m
            self.lines += 1

    def end(self):
        self.process.send_signal(signal.SIGTERM)
        check(self.process.wait(60) == 0, "the sketch failed")


def unsigned_frames(daemon):
    (udp,) = json.loads(daemon.call("GET", "/api/v1/links")[1])["links"]
    return udp["counters"]["unsigned_frames"]


def run(bin_dir, program, key_header, folder):
    udp = link("udp", "udp", listen="127.0.0.1:0", **signing(key_header, folder))
    write_config(folder, CONFIG + udp)
    daemon = OperatedDaemon(bin_dir, folder)
    operated = OperatedRobot(daemon, "udp")
    robots = []

    def last_event():
        return operated.last("last_event").get("event")

    try:
        robots.append(Robot(program, daemon.udp_port(), folder / "eeprom"))
        robot = robots[-1]
        await_that(lambda: operated.known(), "it says HELLO")
        nonce = operated.known()["nonce"]
        check(nonce == FIRST_NONCE, f"its first nonce is {nonce}")
        check(robot.x_m == 0, "it drives without having been resumed")
        operated.command("set", 7, 300)
        operated.command("resume")
        await_that(lambda: robot.x_m > 0.5, "it follows the path")
        check(abs(robot.y_m - 0.05) < 0.1, f"off the path: {robot.y_m}")
        daemon.process.send_signal(signal.SIGSTOP)
        await_that(lambda: robot.standing >= 2, "it stands for want of answers")
        daemon.process.send_signal(signal.SIGCONT)
        x_m = robot.x_m
        await_that(lambda: robot.x_m > x_m + 0.2, "it drives again")
        robot.end()
        robots.append(Robot(program, daemon.udp_port(), folder / "eeprom"))
        await_that(lambda: operated.known()["nonce"] != nonce, "it boots with another nonce")
        operated.command("get", 7)
        await_that(lambda: last_event() == "parameter value", "it tells")
        check(operated.last("last_event")["argument"] == 300, "its speed was kept")
        stored = (folder / "eeprom").read_bytes()
        operated.command("set", START_RELEASED, 1)
        await_that(lambda: (folder / "eeprom").read_bytes() != stored, "it is stored")
        robots[-1].end()
        robots.append(Robot(program, daemon.udp_port(), folder / "eeprom"))
        await_that(lambda: robots[-1].x_m > 0.1, "switched on, it is at its start, and released")
        robots[-1].end()
        lines = robots[-1].lines
        robots.append(Robot(program, daemon.udp_port(), folder / "eeprom", "reset"))
        robot = robots[-1]
        await_that(lambda: last_event() == "pose lost", "it does not know where it is")
        told = robot.lines
        await_that(lambda: robot.lines >= told + 2 * lines, "it prints where it stands")
        check((robot.x_m, robot.y_m) == (0, 0), f"it drives, to {robot.x_m}, {robot.y_m} m")
        robot.end()
        if key_header is not None:
            check(unsigned_frames(daemon) == 0, "it has sent unsigned frames")
            robots.append(Robot(program, daemon.udp_port(), folder / "missing" / "eeprom"))
            await_that(lambda: unsigned_frames(daemon) > 0,
                       "it does not sign with a number that is not stored")
            robots[-1].end()
        daemon.stop()
    finally:
        for process in [robot.process for robot in robots] + [daemon.process]:
            if process.poll() is None:
                process.kill()
                process.wait()


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    bin_dir, program = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    key_header = pathlib.Path(sys.argv[3]) if len(sys.argv) > 3 else None
    with tempfile.TemporaryDirectory() as folder:
        run(bin_dir, program, key_header, pathlib.Path(folder))


if __name__ == "__main__":
    main()
