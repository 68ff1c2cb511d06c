#!/usr/bin/env python3
"""Makes the captures of the replay corpus: a real pheromoned, and robots that follow a script.

Usage: record.py BIN_DIR [NAME]...          all of them, or only these

Each NAME.pcapng comes with NAME.answers, which begins with where it is from; ./bless writes the
answers of the engine below. Run it when a format has changed on purpose (the state that a capture
begins with is in the engine's format), and look at the difference before committing it.
"""

import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from stranger import wire  # noqa: E402
from stranger.client import Client, open_terminal  # noqa: E402

PATIENCE_S = 30

CONFIG = """[map]
width_m = 4.0
height_m = 4.0
cell_m = 0.1
[antennas]
bias_m = 0.33
[[pheromone]]
type = 1
name = "trail"
core_m = 0.1
sigma_m = 0.4
tau_s = 0.05
quantum = 0.125
maximum = 1.0
[[pheromone]]
type = 2
name = "path"
core_m = 0.1
sigma_m = 0.4
tau_s = 0
quantum = 0.125
maximum = 1.0
[[path]]
pheromone = "path"
shape = "polyline"
points_m = [[0.5, 2.0], [3.5, 2.0]]
[[link]]
name = "radio-a"
kind = "pty"
path = "radio-a.pty"
gap_timeout_ms = 50
[[link]]
name = "radio-b"
kind = "pty"
path = "radio-b.pty"
[capture]
start = true
folder = "captures"
"""


class Lab:
    """A pheromoned in a folder of its own, a line to each of its links, and a robot on each."""

    def __init__(self, bin_dir, folder):
        self.bin_dir = bin_dir
        self.folder = folder
        (folder / "lab.toml").write_text(CONFIG)
        with open(folder / "log", "wb") as log:
            self.process = subprocess.Popen([bin_dir / "pheromoned", "--config", "lab.toml"],
                                            cwd=folder, stdout=log, stderr=log)
        self.await_log("ready: 2 of 2 links up")
        self.lines = [open_terminal(folder / f"radio-{it}.pty") for it in "ab"]
        self.robots = [Client(line, 1 + 15 * i, timeout=5) for i, line in enumerate(self.lines)]
        for i, robot in enumerate(self.robots):  # one of them has the number of DLE
            robot._ping_tag = b"corpus %d" % i  # the same in each run

    def await_log(self, text, times=1):
        deadline = time.monotonic() + PATIENCE_S
        while (self.folder / "log").read_text().count(text) < times:
            if time.monotonic() > deadline or self.process.poll() is not None:
                sys.exit(f"waited for {text!r} in\n{(self.folder / 'log').read_text()}")
            time.sleep(0.01)

    def reload(self, config, times):
        (self.folder / "lab.toml").write_text(config)
        self.process.send_signal(signal.SIGHUP)
        self.await_log("configuration reread", times)

    def ctl(self, *arguments):
        subprocess.run([self.bin_dir / "pheromonectl", *arguments], cwd=self.folder, check=True)

    def end(self):
        """The capture."""
        for line in self.lines:
            line.close()
        self.process.send_signal(signal.SIGTERM)
        if self.process.wait(PATIENCE_S) != 0:
            sys.exit((self.folder / "log").read_text())
        [capture] = (self.folder / "captures").iterdir()
        return capture


def frame(name, client, **fields):
    return wire.encode(wire.build(name, client, **fields))


def await_frames(line, count):
    for _ in range(count):
        if line.receive(time.monotonic() + PATIENCE_S) is None:
            sys.exit("an answer is missing")


def traffic(lab):
    """Two robots on two links send HELLO, TRACE, DEPOSIT, SENSE of both types, PING and EVENT."""
    for robot in lab.robots:
        robot.hello(0x1010)
    for i in range(6):
        for robot in lab.robots:
            robot.trace(1, 1000 + 50 * i, 2000, 16 * i)
            robot.sense(2, 1000 + 50 * i, 1900, 0)
            robot.sense(1, 1000, 2000, 0x8000, wide=True)
    lab.robots[0].deposit(2, 3000, 1000, 8)
    lab.robots[0].sense(2, 2900, 1000, 0)
    lab.robots[1].event(3, -16)
    lab.robots[1].ping(b"\x10\x02\x10\x03")


def damaged(lab):
    """Noise, bad CRCs, bad escapes, frames that are too long, too short, cut off or restarted, and
    one that is late in the middle: link radio-a times out, radio-b waits."""
    for robot in lab.robots:
        robot.hello(7)
    good = frame("SENSE", 1, type=2, x=1000, y=2000, heading=0)
    wrong = good[:-4] + bytes([good[-4] ^ 1]) + good[-3:]
    for bytes_before in (b"noise\x10", wrong, b"\x10\x02\x01\x10\x41", b"\x10\x02" + bytes(80),
                         b"\x10\x02\x10\x03", good[:7], b"\x10\x02\x00\x00\x00\x00\x10\x03"):
        lab.lines[0].send(bytes_before)
        lab.lines[0].send(good)
        await_frames(lab.lines[0], 1)
    for line in lab.lines:
        line.send(good[:6])
    time.sleep(0.1)
    for line in lab.lines:
        line.send(good[6:])
    await_frames(lab.lines[1], 1)
    lab.robots[0].ping(b"still here")


def retries(lab):
    """Requests again, byte for byte; a seq for two things; an old one; a robot that said no HELLO; a
    HELLO with a new nonce; opcodes, lengths and places that do not exist."""
    robot, line = lab.robots[0], lab.lines[0]
    line.send(frame("TRACE", 1, type=1, seq=0, x=1000, y=2000, heading=0))
    await_frames(line, 1)
    robot.hello(7)
    for seq in (1, 1, 2, 2, 1, 2):
        line.send(frame("TRACE", 1, type=1, seq=seq, x=1000, y=2000 + seq, heading=0))
    await_frames(line, 5)
    line.send(frame("TRACE", 1, type=1, seq=2, x=0, y=0, heading=0))
    line.send(frame("TRACE", 1, type=9, seq=3, x=1000, y=2000, heading=0))
    line.send(frame("DEPOSIT", 1, type=1, seq=4, x=-1000, y=2000, quanta=1))
    line.send(wire.encode(bytes([1, 0x7F])) + wire.encode(bytes([1, 0x01, 0])))
    await_frames(line, 5)
    robot.hello(8)
    line.send(frame("TRACE", 1, type=1, seq=2, x=1000, y=2000, heading=0))
    await_frames(line, 1)


def evaporation(lab):
    """A trail loses one quantum every 50 ms, while two robots sense it from both sides."""
    for robot in lab.robots:
        robot.hello(7)
    lab.robots[0].deposit(1, 2000, 2000, 8)
    for _ in range(12):
        for robot in lab.robots:
            robot.sense(1, 1900, 2000, 0)
        time.sleep(0.04)
    lab.robots[1].trace(1, 2000, 2000, 0)
    lab.robots[0].sense(1, 1900, 2000, 0)


def reload(lab):
    """SIGHUP twice: another tau, which freezes what is there; another antenna distance, after which
    robots have to say HELLO again."""
    robot = lab.robots[0]
    robot.hello(7)
    robot.deposit(1, 2000, 2000, 8)
    slower = CONFIG.replace("tau_s = 0.05", "tau_s = 0.2")
    lab.reload(slower, 1)
    for _ in range(4):
        robot.sense(1, 1900, 2000, 0)
        time.sleep(0.04)
    lab.reload(slower.replace("bias_m = 0.33", "bias_m = 0.2"), 2)
    lab.lines[0].send(frame("TRACE", 1, type=1, seq=9, x=1000, y=2000, heading=0))
    await_frames(lab.lines[0], 1)
    robot.hello(7)
    robot.trace(1, 1900, 2000, 0)


def commands(lab):
    """A command that is repeated until it is acknowledged, and deposits of the operator."""
    acknowledged = []
    robot = Client(lab.lines[0], 1, timeout=5, on_command=lambda it: acknowledged.append(it) or 0)
    robot.hello(7)
    lab.ctl("command", "radio-a", "1", "speed", "-256", "--no-wait")
    time.sleep(0.6)  # deaf for two transmissions
    robot.listen(0.2)
    lab.ctl("deposit", "trail", "2", "2", "--quanta", "8")
    robot.sense(1, 1900, 2000, 0)
    lab.ctl("halt")
    robot.listen(0.5)


SCENARIOS = [traffic, damaged, retries, evaporation, reload, commands]


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    names = sys.argv[2:] or [it.__name__ for it in SCENARIOS]
    version = subprocess.run([bin_dir / "pheromoned", "--version"], text=True, capture_output=True,
                             check=True).stdout.strip()
    for scenario in SCENARIOS:
        name = scenario.__name__
        if name not in names:
            continue
        with tempfile.TemporaryDirectory() as folder:
            lab = Lab(bin_dir, pathlib.Path(folder))
            scenario(lab)
            capture = lab.end()
            recorded = time.strftime("%Y-%m-%d", time.gmtime(os.stat(capture).st_mtime))
            (HERE / f"{name}.pcapng").write_bytes(capture.read_bytes())
        what = " ".join(scenario.__doc__.split())
        (HERE / f"{name}.answers").write_text(
            f"# {what}\n# Recorded by record.py with {version} on {recorded}; written by "
            "./bless. Field time in ms, link, frame.\n")
        print(f"{name}: recorded")
    subprocess.run([HERE / "bless", bin_dir, *names], check=True)


if __name__ == "__main__":
    main()
