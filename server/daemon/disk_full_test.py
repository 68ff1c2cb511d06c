#!/usr/bin/env python3
"""pheromoned on a disk that fills up: a small tmpfs. Needs the right to mount; without it the test
says so and counts as skipped (exit status 77).

    disk_full_test.py --pheromoned build/release/bin/pheromoned
"""

import argparse
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

import running_daemon
from running_daemon import CONFIG, PATIENCE_S, PTY, Running

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "proto_tests"))
from checks import await_that, check  # noqa: E402
from stranger.client import Client, ErrorAnswer, open_terminal  # noqa: E402

SKIPPED = 77
READ_ONLY = 8
MEBIBYTE = 1 << 20


def start(folder):
    server = Running(folder, "--config", "test.toml")
    server.await_log("ready")
    return server, Client(open_terminal(folder / "radio-a.pty"), 7, timeout=PATIENCE_S)


def refuses(robot):
    try:
        robot.deposit(1, 5000, 5000)
    except ErrorAnswer as refused:
        check(refused.reason == READ_ONLY, f"refused with {refused.reason}")
        return True
    return False


def fill(file):
    """What is left of its disk."""
    with open(file, "wb", buffering=0) as filler:
        try:
            while True:
                filler.write(bytes(65536))
        except OSError:
            pass


def does_not_start(folder, disk, journal):
    """With a configuration that is not yet in the log: 1, so that systemd tries again."""
    with Running(folder, "--config", "test.toml") as server:
        status = server.end()
        check(status == 1, f"exit status {status} at a full disk")
        check("o space left on " in server.log, f"the reason is told: {server.log}")
        check(f"free space on the disk of {disk / journal}" in server.log, "what to do is told")
        check("resample" not in server.log and "move the folder" not in server.log,
              "nobody is told to move the state away")


def start_while_full(folder, disk):
    config = folder / "test.toml"
    text = config.read_text()
    fill(disk / "filler")
    config.write_text(text.replace("tau_s = 0", "tau_s = 60"))
    does_not_start(folder, disk, "state")
    config.write_text(text.replace("/state", "/first"))
    does_not_start(folder, disk, "first")
    (disk / "filler").unlink()
    config.write_text(text.replace("tau_s = 0", "tau_s = 60"))
    server, _ = start(folder)
    with server:
        check(server.stop() == 0, "it starts once there is space")


def ctl(folder, *command):
    program = pathlib.Path(running_daemon.PHEROMONED).with_name("pheromonectl")
    result = subprocess.run([program, *command], cwd=folder, text=True, capture_output=True,
                            timeout=PATIENCE_S, check=False)
    # Of a halt, 1 says that a robot was not seen to stand: this one only answers.
    check(result.returncode == 0 or (command == ("halt",) and result.returncode == 1),
          f"pheromonectl {command}: {result.stderr}")
    return result.stdout


def halt_while_read_only(folder, robot):
    """It comes three times, and a recording of it is replayed although no log has it."""
    ctl(folder, "capture", "start")
    ctl(folder, "halt")
    for _ in range(3):
        body = robot.line.receive(time.monotonic() + PATIENCE_S)
        check(body is not None and body[:2] == b"\xff\xd1" and body[3] == 1, f"a halt, not {body}")
    check(refuses(robot), "changes are still refused")
    ctl(folder, "capture", "stop")
    [file] = (folder / "captures").iterdir()
    ctl(folder, "replay", file)  # without a difference


def run(folder, disk):
    (folder / "test.toml").write_text(
        CONFIG.replace("tau_s = 30.0", "tau_s = 0") + PTY
        + f'[journal]\nfolder = "{disk}/state"\nsegment_mib = 1\n')
    server, robot = start(folder)
    with server:
        epoch = robot.hello(1).epoch
        robot.deposit(1, 5000, 5000)
        fill(disk / "filler")
        # What is reserved is used up first.
        acknowledged = 1
        while not refuses(robot):
            acknowledged += 1
            check(acknowledged < 400_000, "a full disk refuses changes")
        print(f"disk full: {acknowledged} changes acknowledged before they were refused")
        server.await_log("changes are refused")
        answer = robot.sense(1, 5000, 5200, 0)
        check(answer is not None and refuses(robot), "SENSE goes on, changes are refused")
        halt_while_read_only(folder, robot)
        (disk / "filler").unlink()
        await_that(lambda: not refuses(robot), "freed space heals it without a restart")
        server.await_log("changes are accepted again")
        robot.deposit(1, 5200, 5200)
        answers = {(x, y): robot.sense(1, x, y, 0)
                   for x in range(4600, 5600, 100) for y in range(4600, 5600, 100)}
        server.stop(signal.SIGKILL)
    server, robot = start(folder)
    with server:
        check({at: robot.sense(1, *at, 0) for at in answers} == answers,
              "nothing that was acknowledged is lost")
        check(robot.hello(1).epoch == epoch, "the epoch goes on")
        check(server.stop() == 0, "an orderly end")
    start_while_full(folder, disk)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pheromoned", required=True)
    running_daemon.PHEROMONED = str(pathlib.Path(parser.parse_args().pheromoned).resolve())
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        disk = folder / "disk"
        disk.mkdir()
        mounted = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={24 * MEBIBYTE}", "tmpfs", str(disk)],
            capture_output=True, text=True, check=False)
        if mounted.returncode != 0:
            print(f"skipped: a small tmpfs cannot be mounted: {mounted.stderr.strip()}")
            return SKIPPED
        try:
            run(folder, disk)
        finally:
            subprocess.run(["umount", "-l", str(disk)], check=False)
    print("disk full: ok")
    return 0


if __name__ == "__main__":
    sys.exit(main())
