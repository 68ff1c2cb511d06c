#!/usr/bin/env python3
"""The commands of client_fw/ros2/README.md, literally and in order, with two simulated TurtleBots. In a
network of its own, where every port is free; without one, the test is skipped.

Usage: ros2_page_test.py BIN_DIR TESTS_DIR
"""

import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent
PAGE = ROOT / "client_fw" / "ros2"
sys.dont_write_bytecode = True
sys.path[:0] = [str(PAGE / "testing"), str(ROOT / "deploy")]

from commands_test import bring_up_loopback  # noqa: E402
from operated_daemon import await_that, check  # noqa: E402
from peer import Base, Bases, Peer  # noqa: E402
from ros2_live_test import last_state  # noqa: E402

SKIPPED = 77


def check_files_beside_the_page():
    """What RViz and Nav2 are told to read is what is published, with its quality of service."""
    text = (PAGE / "README.md").read_text()
    rviz = (PAGE / "pheromone.rviz").read_text()
    for name, durability in re.findall(r"Value: (/pheromone/\w+)\n +Depth: 1\n +Durability Policy: (.*)",
                                       rviz):
        row = next(row for row in text.splitlines()
                   if row.startswith(f"| `{name}`") or (name in ("/pheromone/path", "/pheromone/trail")
                                                        and row.startswith("| `/pheromone/NAME`")))
        check(("Transient local" in row) == (durability == "Transient Local"), f"{name}: {durability}")
    check("map_topic: /pheromone/" in (PAGE / "nav2.yaml").read_text(), "nav2.yaml has no topic of ours")


def run(bin_dir, tests_dir, folder):
    blocks = re.findall(r"^```sh\n(.*?)^```", (PAGE / "README.md").read_text(), re.M | re.S)
    check(len(blocks) == 3, f"{len(blocks)} blocks of commands, expected three")
    environment = {**os.environ, "PATH": f"{bin_dir}:{os.environ['PATH']}", "ROS_LOCALHOST_ONLY": "1"}
    shells = []

    def begin(block):
        with open(folder / f"{len(shells)}.log", "wb") as log:
            shells.append(subprocess.Popen(["bash", "-e", "-c", block + "\nwait"], cwd=folder,
                                           env=environment, stdout=log, stderr=log,
                                           start_new_session=True))

    def log(number):
        check(shells[number].poll() is None, (folder / f"{number}.log").read_text())
        return (folder / f"{number}.log").read_text()

    peer = Peer(tests_dir, 0)
    tb1, tb2 = Base(peer, "tb1", (5, 3, -15)), Base(peer, "tb2", (5, 8, 180))
    bases = Bases([tb1, tb2])
    try:
        peer.read("rt/pheromone/path", "nav_msgs/msg/OccupancyGrid", latched=True)
        begin(blocks[0])
        await_that(lambda: "ready: " in log(0), "the server is ready")
        begin(blocks[1])
        await_that(lambda: peer.count("rt/pheromone/path") and all(
            last_state(log(1), f"tb{i}") == "stands: halted, until it is told to resume" for i in (1, 2)),
            "the robots are answered, and the map comes")
        resume, halt = blocks[2].splitlines()
        subprocess.run(["bash", "-c", resume], cwd=folder, env=environment, check=True)
        await_that(lambda: tb1.way_m > 0.3, "the first robot drives")
        check(tb2.way_m == 0, "the second was not told to")
        subprocess.run(["bash", "-c", halt], cwd=folder, env=environment, check=True)
        await_that(lambda: tb1.v == 0 and "halted" in last_state(log(1), "tb1"), "it is halted")
    except BaseException:
        for number in range(len(shells)):
            print((folder / f"{number}.log").read_text())
        raise
    finally:
        bases.stop()
        peer.close()
        for shell in shells:
            os.killpg(shell.pid, signal.SIGKILL)
            shell.wait()


def main():
    if os.environ.get("ROS2_PAGE_TEST_INSIDE") != "yes":
        own = ["unshare", "--net", *([] if os.geteuid() == 0 else ["--map-root-user"])]
        if shutil.which("unshare") is None or subprocess.run(
                [*own, "true"], capture_output=True, check=False).returncode != 0:
            print("no network namespace can be made here")
            sys.exit(SKIPPED)
        os.environ["ROS2_PAGE_TEST_INSIDE"] = "yes"
        os.execvp(own[0], [*own, sys.executable, *sys.argv])
    bring_up_loopback()
    check_files_beside_the_page()
    with tempfile.TemporaryDirectory() as folder:
        run(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(),
            pathlib.Path(folder))
    print("passed")


if __name__ == "__main__":
    main()
