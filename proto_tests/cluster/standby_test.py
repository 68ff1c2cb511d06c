#!/usr/bin/env python3
"""Two servers with a modem each on the same two radio channels: one sends, the other stands by.

Sixteen robots take part in rounds. The server that sends is killed, then the other one is stopped and
goes on: each time the robots get answers again, without anybody's help, and whoever fell silent stays
silent. How long the robots were without the server is printed, and asserted nowhere.

    standby_test.py BIN_DIR
"""

import json
import os
import pathlib
import pty
import select
import signal
import sys
import tempfile
import threading
import time
import tty

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from asking_robot import check  # noqa: E402
from cluster.machines import Machines  # noqa: E402
from operated_daemon import await_that  # noqa: E402
from swarm_live_test import Swarm, all_of, end_processes  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402

BYTE_S = 10 / 9600
MAP = map_of(10.0, 10.0) + pheromone(1, "trail")
CHANNELS = ("radio-a", "radio-b")
RADIO = dict(medium_access=True, baud=9600, turnaround_ms=2, server_delay_ms=20,
             adapter_latency_ms=0, on=["a", "b"])
ROBOTS = 16


class Air:
    """What the servers' modems send arrives at the robots, and the robots' frames at both modems. Who
    sends is noted: (node, when, bytes)."""

    def __init__(self, modems, path):
        self.modems = modems
        self.sent = []
        self.robots, self.end = pty.openpty()
        tty.setraw(self.end)
        path.symlink_to(os.ttyname(self.end))
        self.ends = False
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        files = {}
        while not self.ends:
            for node, path in self.modems.items():
                if node not in files and path.exists():
                    try:
                        files[node] = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
                    except OSError:
                        pass  # the terminal of a server that was killed
            ready, _, _ = select.select([self.robots, *files.values()], [], [], 0.05)
            for node, file in list(files.items()):
                if file in ready:
                    try:
                        data = os.read(file, 4096)
                    except OSError:
                        data = b""
                    if data:
                        self.sent.append((node, time.monotonic(), len(data)))
                        os.write(self.robots, data)
                    else:
                        os.close(files.pop(node))
            if self.robots in ready:
                data = os.read(self.robots, 4096)
                for file in files.values():
                    try:
                        os.write(file, data)
                    except OSError:
                        pass

    def close(self):
        self.ends = True
        self.thread.join()

    def check_one_at_a_time(self):
        until = {}
        for node, when, size in list(self.sent):
            for other, end in until.items():
                check(other == node or end <= when, f"{node} sends {end - when:.3f} s too early")
            until[node] = max(until.get(node, 0), when) + size * BYTE_S

    def changes(self):
        """Who sent, one after the other, and for how long nobody did in between."""
        changes = []
        for (before, end, size), (node, when, _) in zip(self.sent, self.sent[1:]):
            if before != node:
                changes.append((before, node, when - end - size * BYTE_S))
        return changes


def scenario():
    return (table("run", duration_s=3600)
            + table("radio", channels=len(CHANNELS), baud=9600, turnaround_s=0.002) + MAP
            + table("[robots]", pheromone="trail", count=ROBOTS, trail=True, speed_m_per_s=0.1,
                    spread_m=1.0, starts=[[5, 5, 0]]))


def states(machines, node):
    """Empty: it does not respond; it may be ending."""
    try:
        status, text = machines.daemons[node].call("GET", "/api/v1/links")
    except OSError:
        return []
    return [it["state"] for it in json.loads(text)["links"]
            if it["name"] in CHANNELS] if status == 200 else []


def are_of(machines, owner, standby):
    sends, stands_by = states(machines, owner), states(machines, standby)
    return (bool(sends) and bool(stands_by) and all("standby" not in it for it in sends)
            and all(f"standby: node {owner} sends" in it for it in stands_by))


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        (folder / "scenario.toml").write_text(scenario())
        config = MAP + "".join(link(name, "pty", path=f"{name}.pty", **RADIO) for name in CHANNELS)
        airs = []
        swarm = None
        machines = Machines(bin_dir, folder, config=config)
        try:
            airs = [Air({node: machines.folders[node] / f"{name}.pty" for node in "ab"},
                        folder / f"{name}.air") for name in CHANNELS]
            await_that(lambda: are_of(machines, "a", "b"), "the first of the list sends")
            swarm = Swarm(bin_dir, folder / "scenario.toml",
                          [str(folder / f"{name}.air") for name in CHANNELS], folder / "out",
                          "--medium-access")
            swarm.read_until(all_of, "every robot gets answers")

            machines.kill("a")
            for name in CHANNELS:  # a terminal that it leads to may be another program's now
                (machines.folders["a"] / f"{name}.pty").unlink()
            await_that(lambda: all(air.changes() for air in airs), "the standby sends")
            swarm.read_until(all_of, "every robot gets answers again")
            machines.start("a")
            await_that(lambda: are_of(machines, "b", "a"), "who comes back stands by")

            stopped = machines.daemons["b"]
            stopped.process.send_signal(signal.SIGSTOP)
            await_that(lambda: all(len(air.changes()) == 2 for air in airs), "the standby sends")
            stopped.process.send_signal(signal.SIGCONT)
            swarm.read_until(all_of, "every robot gets answers again")
            # It may have made changes that never happened, and end.
            await_that(lambda: stopped.process.poll() is not None or are_of(machines, "a", "b"),
                       "it notices")
            swarm.read_until(all_of, "every robot still gets answers")
            swarm.finish(stop=True)
        finally:
            end_processes(swarm)
            for air in airs:
                air.close()
            machines.close()
        for name, air in zip(CHANNELS, airs):
            air.check_one_at_a_time()
            changes = air.changes()
            check([it[:2] for it in changes] == [("a", "b"), ("b", "a")], f"{name}: {changes}")
            print(name, *(f"{before} to {after}: {silence:.2f} s"
                          for before, after, silence in changes))
    print("ok")


if __name__ == "__main__":
    main()
