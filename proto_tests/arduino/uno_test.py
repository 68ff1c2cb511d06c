#!/usr/bin/env python3
"""Images of Arduino's Uno in real time against the real daemon over a pty.

    uno_test.py BIN_DIR ARDUINO_LIVE IMAGE encoders|steppers CHANGES [KEY_H]

The robot follows a path. Then it is halted, told over the radio to deposit without a pause, and
makes so many CHANGES while bytes are lost both ways and its reset button is pressed: what a
stranger then senses there is as many quanta as the robot has sent numbers. At last the supply is
switched off and on: it has another nonce, and what it was told. With KEY_H, the image's, the link
requires signing, and no number of HELLO is used twice.
"""

import os
import pathlib
import random
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tty

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from operated_daemon import OperatedDaemon, await_that, check, write_config  # noqa: E402
from operated_robot import OperatedRobot, signing  # noqa: E402
from stranger import wire  # noqa: E402
from stranger.client import Client, Line  # noqa: E402
from stranger.servers import connect, resolve  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402

ROBOT = 1
TRACE = 0x30
MARKS = 2
HELLO = 0x71
MAX_STACK = 384  # bytes, beside what the budget tests allow for static memory
SIGNED_HELLO = 2 + 4 + 6  # bytes of a first one: protocol/README.md, section 18
QUANTUM = 0.002  # more than 1/4096, which is what the protocol can tell
# The robot starts at (0, 0), facing along +x: 0.05 m beside a straight path. It deposits at one
# node, and what is sensed there is the sum, since a core is larger than it.
CONFIG = (map_of(12.0, 4.0, bias_m=0.1, origin_x_m=-1.0, origin_y_m=-2.0) + pheromone(1, "path")
          + pheromone(MARKS, "marks", core_m=0.6, sigma_m=0.4, quantum=QUANTUM, maximum=7.5)
          + table("[path]", name="line", pheromone="path", shape="polyline",
                  points_m=[[0.0, 0.05], [10.5, 0.05]])
          + link("udp", "udp", listen="127.0.0.1:0"))


class Air(threading.Thread):
    """Between the robot's terminal and the daemon's. Notes what the robot says before any of it is
    lost: how many numbers its TRACEs had, and the nonces of its HELLOs."""

    def __init__(self, modem):
        super().__init__(daemon=True)
        self.robot, self.terminal = os.openpty()
        self.server = os.open(modem, os.O_RDWR | os.O_NOCTTY)
        for fd in (self.robot, self.terminal, self.server):
            tty.setraw(fd)
        self.loss = 0.0
        self.random = random.Random(1)
        self.decoder = wire.Decoder()
        self.numbers = 0  # of TRACEs
        self.last = None
        self.repeats = 0
        self.nonces = []
        self.first_hellos = []  # nonce and number of signed ones
        self.answers = wire.Decoder()
        self.answered = None  # the last number
        self.start()

    def run(self):
        while True:
            for fd in select.select((self.robot, self.server), (), ())[0]:
                data = os.read(fd, 4096)
                if fd == self.robot:
                    for body in self.decoder.feed(data):
                        self.heard(body)
                else:
                    data = self.lose(data)
                    for body in self.answers.feed(data):
                        if body[0] == ROBOT and body[1] == TRACE | MARKS | 0x80:
                            self.answered = body[2]
                    os.write(self.robot, data)
                    continue
                os.write(self.server, self.lose(data))

    def heard(self, body):
        if body[1] == TRACE | MARKS:
            if body[2] != self.last:
                self.numbers += 1
                self.last = body[2]
            else:
                self.repeats += 1
        elif body[1] == HELLO:
            self.nonces.append(int.from_bytes(body[2:4], "little"))
            if len(body) == SIGNED_HELLO:
                self.first_hellos.append((body[2:4], body[6:8]))

    def lose(self, data):
        return bytes(byte for byte in data if self.random.random() >= self.loss)


class Robot:
    def __init__(self, program, image, air, kind):
        self.process = subprocess.Popen([program, image, os.ttyname(air.terminal), kind],
                                        stdout=subprocess.PIPE, text=True)
        self.x_m = self.y_m = self.stack = 0
        self.stands = True
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            x_m, y_m, _, _, stack = line.split()
            pose = (float(x_m), float(y_m))
            self.stands = pose == (self.x_m, self.y_m)
            self.x_m, self.y_m = pose
            self.stack = int(stack)

    def signal(self, which):
        check(self.process.poll() is None, "the image failed")
        self.process.send_signal(which)


def run(bin_dir, program, image, kind, changes, key_header, folder):
    radio = link("radio-a", "pty", path="radio-a.pty", **signing(key_header, folder, ROBOT))
    write_config(folder, CONFIG + radio)
    daemon = OperatedDaemon(bin_dir, folder)
    operated = OperatedRobot(daemon, "radio-a", ROBOT)
    robot = None
    try:
        air = Air(folder / "radio-a.pty")
        robot = Robot(program, image, air, kind)
        await_that(lambda: air.nonces, "it says HELLO")
        check(air.nonces[0] == 1, f"the first nonce is {air.nonces[0]}")
        await_that(lambda: operated.known(), "the server knows it")
        check(robot.x_m == 0, "it drives without having been resumed")
        operated.command("resume")
        await_that(lambda: robot.x_m > 0.5, "it follows the path")
        check(abs(robot.y_m - 0.05) < 0.1, f"off the path: {robot.y_m}")
        operated.command("halt")
        await_that(lambda: robot.stands, "it stands")
        operated.command("set", 8, 0)
        operated.command("set", 1, MARKS)
        operated.command("set", 3, 1)
        await_that(lambda: air.numbers > 0, "it deposits")

        air.loss = 0.004
        rng = random.Random(2)
        resets = 0
        while air.numbers < changes:
            time.sleep(rng.uniform(0.5, 3))  # nothing waits for it: moments to press a button
            check(operated.last("last_event").get("event") != "pose lost", "a reset lost its pose")
            robot.signal(signal.SIGUSR1)
            resets += 1
        air.loss = 0.0
        operated.command("set", 3, 0)
        await_that(lambda: air.answered == air.last, "its last change is answered")
        with Line(connect(resolve(f"udp:127.0.0.1:{daemon.udp_port()}"))) as line:
            stranger = Client(line, 99)
            stranger.hello(nonce=1)
            x_mm = round(robot.x_m * 1000) - 200  # only what is ahead is sensed
            y_mm = round(robot.y_m * 1000)
            sensed = stranger.sense(pheromone=MARKS, x=x_mm, y=y_mm, heading=0)
        print(f"{air.numbers} changes, {air.repeats} repeated, {resets} resets, sensed {sensed}, "
              f"stack {robot.stack} bytes")
        check(0 < robot.stack <= MAX_STACK, "its stack is too deep")
        check(set(air.nonces) == {1}, "a reset lost its memory")
        once_each = round(air.numbers * QUANTUM * 4096)
        check(sensed.left == sensed.right == once_each, f"not {once_each}: not once each")

        robot.signal(signal.SIGUSR2)
        await_that(lambda: air.nonces[-1] != 1, "it boots")
        check(air.nonces[-1] > 1, "its boot number was used before")
        await_that(lambda: operated.known()["nonce"] == air.nonces[-1], "the server greets it")
        check(bool(air.first_hellos) == (key_header is not None), "signed, or not")
        check(len(set(air.first_hellos)) == len(air.first_hellos), "a HELLO's number came twice")
        operated.command("set", 3, 1)
        numbers = air.numbers
        await_that(lambda: air.numbers > numbers, "its other settings are those it was told")
        robot.signal(signal.SIGTERM)
        check(robot.process.wait(60) == 0, "the image failed")
        daemon.stop()
    finally:
        for process in (robot and robot.process, daemon.process):
            if process is not None and process.poll() is None:
                process.kill()
                process.wait()


def main():
    if len(sys.argv) not in (6, 7):
        sys.exit(__doc__)
    bin_dir, program, image = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
    key_header = pathlib.Path(sys.argv[6]) if len(sys.argv) > 6 else None
    with tempfile.TemporaryDirectory() as folder:
        run(bin_dir, program, image, sys.argv[4], int(sys.argv[5]), key_header,
            pathlib.Path(folder))


if __name__ == "__main__":
    main()
