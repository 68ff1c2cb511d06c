#!/usr/bin/env python3
"""A terminal is for one program at a time: each of ours, when another has it, names it and ends with
exit status 1.

Usage: terminal_test.py BIN_DIR
"""

import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

from operated_daemon import PATIENCE_S, OperatedDaemon, await_that, check, default_config, write_config

HERE = pathlib.Path(__file__).resolve().parent
SCENARIO = HERE.parent / "client_fw/swarm/examples/live.toml"
CAPTURE = HERE / "replay/traffic.pcapng"
PYTHON = HERE.parent / "deploy/python"
LOCKS = pathlib.Path("/proc/locks")


def programs(bin_dir, port):
    """What they print before the error, and their command lines."""
    swarm, robot = bin_dir / "pheromone-swarm", bin_dir / "pheromone-robot"
    pose = ("--start", "0", "0", "0")
    return (("pheromone-swarm", (swarm, "live", "--modem", port)),
            ("pheromone-swarm", (swarm, "run", SCENARIO, "--daemon", port)),
            ("pheromone-robot", (robot, "--robot", "nowhere", "--modem", port, *pose)),
            ("pheromone-robot", (robot, "--robot", port, "--modem", "nowhere", *pose)),
            ("pheromonectl", (bin_dir / "pheromonectl", "replay", CAPTURE, "--to", port)),
            ("pheromone", ("env", f"PYTHONPATH={PYTHON}", sys.executable, "-B", "-m", "pheromone", port, "hello")))


def holders():
    """The processes that have a lock of flock."""
    return {int(line.split()[4]) for line in LOCKS.read_text().splitlines() if " FLOCK " in line}


def each_names_whoever_has_the_terminal(bin_dir, folder):
    port = folder / "radio-a.pty"
    write_config(folder, default_config(bin_dir))
    daemon = OperatedDaemon(bin_dir, folder)
    first = subprocess.Popen([bin_dir / "pheromone-swarm", "live", "--modem", port], cwd=folder,
                             stdout=subprocess.DEVNULL)
    try:
        await_that(lambda: first.pid in holders(), "the first program has the terminal")
        for name, command in programs(bin_dir, port):
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True,
                                  timeout=PATIENCE_S, check=False)
            expected = (rf"{name}: {re.escape(str(port))}: in use by pheromone-swarm "
                        rf"\(process {first.pid}, since \d{{4}}-\d\d-\d\d \d\d:\d\d:\d\d\)\n")
            check(done.returncode == 1 and re.fullmatch(expected, done.stderr),
                  f"{command}: ended with {done.returncode}: {done.stderr}")
        first.send_signal(signal.SIGINT)
        check(first.wait(PATIENCE_S) == 0, "the first program was not disturbed")
        done = subprocess.run(programs(bin_dir, port)[-1][1], capture_output=True, text=True,
                              timeout=PATIENCE_S, check=False)
        check(done.returncode == 0 and "protocol_version 1\n" in done.stdout, done.stderr)
        daemon.stop()
    finally:
        for process in (first, daemon.process):
            if process.poll() is None:
                process.kill()
                process.wait()


def main():
    with tempfile.TemporaryDirectory() as folder:
        each_names_whoever_has_the_terminal(pathlib.Path(os.path.abspath(sys.argv[1])),
                                            pathlib.Path(folder))
    print("ok")


if __name__ == "__main__":
    main()
