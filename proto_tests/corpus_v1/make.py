#!/usr/bin/env python3
"""Makes the files of this folder with a server of the version whose files they are to be.

    make.py --bin BIN_DIR_OF_THAT_VERSION

Needed once. What it does is in README.md; the files are not made anew, for they are to show what a
server of that time wrote.
"""

import argparse
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
EXAMPLES = HERE.parents[1] / "deploy" / "examples"
sys.path.insert(0, str(HERE.parent))
from stranger.client import Client, open_terminal  # noqa: E402

TRACKER_PORT = 49607
MORE = """
[journal]
folder = "journal"
keep_snapshots = 2
[capture]
folder = "captures"
[control]
socket = "server.sock"
"""


class Server:
    running = []

    def __init__(self, bin_dir, folder):
        self.bin_dir, self.folder = bin_dir, folder
        self.process = subprocess.Popen([bin_dir / "pheromoned", "--config", "test.toml"],
                                        cwd=folder, stderr=subprocess.PIPE, text=True)
        Server.running.append(self)
        self.log = ""
        self.await_log("ready")

    def await_log(self, words):
        while words not in self.log:
            line = self.process.stderr.readline()
            if not line:
                raise RuntimeError(self.log)
            self.log += line

    def ctl(self, *arguments):
        result = subprocess.run([self.bin_dir / "pheromonectl", "--socket",
                                 self.folder / "server.sock", *map(str, arguments)],
                                text=True, capture_output=True, timeout=60, check=False)
        print(" ".join(map(str, arguments)), "->", result.returncode,
              (result.stdout + result.stderr).strip()[:200])
        return result

    def stop(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        self.log += self.process.stderr.read()
        self.process.wait(timeout=60)


def configuration(tau_s, path):
    text = (EXAMPLES / "all-laws.toml").read_text()
    text = re.sub(r"127\.0\.0\.1:4960", f"127.0.0.1:{TRACKER_PORT}", text)
    text = text.replace("tau_s = 30.0", f"tau_s = {tau_s}", 1)
    text = text.replace("[[1.0, 1.0], [4.0, 1.0], [4.0, 3.0]]", path)
    return text + MORE


def observe(*poses):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.sendto("\n".join(poses).encode(), ("127.0.0.1", TRACKER_PORT))


def drive(folder):
    """Two robots send HELLO, deposit all types, and receive commands."""
    robots = {}
    for number in (7, 9):
        robot = Client(open_terminal(folder / "radio-a.pty"), number, timeout=5)
        robot.hello(1000 + number)
        for i in range(30):
            robot.trace(1 + i % 8, 300 + 90 * i, 300 * (number - 7) + 20 * i, 500 * i)
        for pheromone in range(1, 9):
            robot.deposit(pheromone, 900 + 200 * pheromone, 500, 2)
        robot.event(1, number)
        robot.line.close()
        robots[number] = robot
    return robots


def make(bin_dir, folder):
    for name in ("course.svg", "hill.csv"):
        shutil.copy(EXAMPLES / name, folder)
    config = folder / "test.toml"
    config.write_text(configuration(30.0, "[[1.0, 1.0], [4.0, 1.0], [4.0, 3.0]]"))

    server = Server(bin_dir, folder)                       # the first segment, without a recording
    drive(folder)
    server.ctl("paint", "permanent", 1, 6, 5, 6.5, 5, 7, "--radius", 0.2)
    server.ctl("paint", "scent", "--area", 8, 1, 9, 2, "--units", 1)
    server.ctl("deposit", "counter", 6, 6)
    server.ctl("snapshot")
    drive(folder)                                          # the next change, with which it is made
    time.sleep(1)
    server.stop()

    server = Server(bin_dir, folder)                       # the second, from its first event recorded
    server.ctl("capture", "start")
    drive(folder)
    observe("pose radio-a 7 2.5 3.5 90", "pose radio-a 9 6 6 -45")
    server.ctl("command", "radio-a", 7, "speed", 150, "--no-wait")
    server.ctl("command", "radio-a", 9, "go-to", 1000, 2000, "--no-wait")
    drive(folder)
    config.write_text(configuration(45.0, "[[1.0, 1.5], [4.0, 1.5], [4.5, 3.0], [2.0, 2.0]]"))
    server.ctl("reload")
    server.ctl("erase", "counter", 1, 6, 3, 6, "--radius", 0.3)
    server.ctl("erase", "linear", "--all")
    server.ctl("paint", "exponential", "--all", "--units", 0.25, "--add")
    server.ctl("halt")
    drive(folder)
    server.ctl("snapshot")
    drive(folder)
    time.sleep(2)
    server.ctl("capture", "stop")
    server.stop()

    server = Server(bin_dir, folder)                       # the third ends without an orderly end
    drive(folder)
    server.stop(signal.SIGKILL)


def state_of(bin_dir, folder):
    said = subprocess.run([bin_dir / "pheromonectl", "journal", "check", folder], text=True,
                          capture_output=True, check=True).stdout
    print(said)
    return re.search(r"state: sequence (\d+), .*hash (\w+)", said).groups(), said


def keep(bin_dir, folder):
    lines = ["# what | sequence | state hash"]
    shutil.rmtree(HERE / "journal", ignore_errors=True)
    (HERE / "journal").mkdir()
    for path in sorted((folder / "journal").iterdir()):
        if path.suffix in (".segment", ".snapshot"):
            shutil.copy(path, HERE / "journal")
    (sequence, state_hash), said = state_of(bin_dir, HERE / "journal")
    lines.append(f"journal {sequence} {state_hash}")
    for name, state_hash in re.findall(r"^(\d+\.snapshot): state hash (\w+)", said, re.M):
        lines.append(f"{name} {int(name.split('.')[0])} {state_hash}")
    recording = sorted((folder / "captures").glob("*.pcapng"))
    assert len(recording) == 1, recording
    shutil.copy(recording[0], HERE / "recording.pcapng")
    said = subprocess.run([bin_dir / "pheromonectl", "replay", HERE / "recording.pcapng"], text=True,
                          capture_output=True, check=True).stdout
    print(said)
    lines.append("recording - " + re.search(r"state hash (\w+)", said)[1])
    (HERE / "expected.txt").write_text("\n".join(lines) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", required=True, type=pathlib.Path)
    bin_dir = parser.parse_args().bin.resolve()
    with tempfile.TemporaryDirectory() as name:
        try:
            make(bin_dir, pathlib.Path(name))
            keep(bin_dir, pathlib.Path(name))
        finally:
            for server in Server.running:
                server.process.kill()


if __name__ == "__main__":
    main()
