#!/usr/bin/env python3
"""Two servers with a modem each on the same two radio channels: one sends, the other stands by.

Robots take part in rounds. The machine of the server that sends is killed, the server and its member of
etcd, and comes back to stand by; at the end the server that sends is stopped and goes on. Each time the
robots get answers again, without anybody's help; whoever fell silent stays silent, and the other one
goes on with the rounds. For how long the robots stood is printed, and asserted nowhere.

    standby_test.py BIN_DIR [--robots 4] [--kills 1]
"""

import argparse
import contextlib
import csv
import json
import os
import pathlib
import pty
import select
import signal
import statistics
import sys
import tempfile
import threading
import time
import tty

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from checks import check  # noqa: E402
from cluster.machines import Machines  # noqa: E402
from operated_daemon import await_that  # noqa: E402
from stranger.wire import NO_INTENSITIES, Decoder, parse  # noqa: E402
from swarm_live_test import Swarm, check_files, end_processes  # noqa: E402
from test_config import link, map_of, pheromone, table  # noqa: E402

BYTE_S = 10 / 9600
SHORT_STAND_S = 0.5  # of robots that missed a ROUND or two
ROUNDS_END_S = 1.9  # robots that have not heard a ROUND for longer may say HELLO
MAP = map_of(10.0, 10.0) + pheromone(1, "trail")
CHANNELS = ("radio-a", "radio-b")
RADIO = dict(medium_access=True, baud=9600, turnaround_ms=2, server_delay_ms=20,
             adapter_latency_ms=0, on=["a", "b"])


class Air:
    """What the servers' modems send arrives at the robots, and the robots' frames at both modems. Who
    sends is noted: (node, when, its bytes)."""

    def __init__(self, modems, path):
        self.modems = modems
        self.sent = []
        self.all_are_there = 0  # where in that
        self.answered = {}  # when it was last, by robot
        self.decoders = {node: Decoder() for node in modems}
        self.turns = {node: [] for node in modems}  # of its last ROUND
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
                        self.sent.append((node, time.monotonic(), data))
                        os.write(self.robots, data)
                        self.note_answers(node, data)
                    else:
                        os.close(files.pop(node))
            if self.robots in ready:
                data = os.read(self.robots, 4096)
                for file in files.values():
                    try:
                        os.write(file, data)
                    except OSError:
                        pass

    def note_answers(self, node, data):
        for message in map(parse, self.decoders[node].feed(data)):
            robots = [message.client_id] * (message.name in ("SENSE_ANSWER", "TRACE_ANSWER"))
            if message.name == "ROUND":
                robots = [robot for robot, (left, _) in zip(self.turns[node], message.fields["answers"])
                          if left != NO_INTENSITIES]
                self.turns[node] = message.fields["turns"]
            self.answered.update(dict.fromkeys(robots, time.monotonic()))

    def close(self):
        self.ends = True
        self.thread.join()

    def check_one_at_a_time(self):
        """Returns how often it was looked at: before, something of another one had been sent."""
        until, checks = {}, 0
        for node, when, data in self.sent:
            for other, end in until.items():
                checks += other != node
                check(other == node or end <= when, f"{node} sends {end - when:.3f} s too early")
            until[node] = max(until.get(node, 0), when) + len(data) * BYTE_S
        return checks

    def changes(self):
        """Who sent, one after the other, for how long nobody did in between, and where in `sent`."""
        sent = list(self.sent)
        return [(before, node, when - end - len(data) * BYTE_S, i + 1)
                for i, ((before, end, data), (node, when, _)) in enumerate(zip(sent, sent[1:]))
                if before != node]

    def check_rounds_go_on(self):
        """Whoever takes over begins with a ROUND that has turns, which nobody asked for. Returns how
        often one did."""
        checks = 0
        for _, node, silence, at in self.changes():
            if silence < ROUNDS_END_S and at >= self.all_are_there:
                decoder = Decoder()
                first = next(bodies[0] for _, _, data in self.sent[at:] if (bodies := decoder.feed(data)))
                message = parse(first)
                check(message.name == "ROUND" and message.fields["turns"] and
                      not message.fields["answers"], f"{node} begins with {message}")
                checks += 1
        return checks


def scenario(robots):
    return (table("run", duration_s=3600)
            + table("radio", channels=len(CHANNELS), baud=9600, turnaround_s=0.002) + MAP
            + table("[robots]", pheromone="trail", count=robots, trail=True, speed_m_per_s=0.1,
                    spread_m=1.0, starts=[[5, 5, 0]]))


def states(machines, node):
    """Of the links of the channels, by name; empty: it does not respond, and may be ending."""
    try:
        status, text = machines.daemons[node].call("GET", "/api/v1/links")
    except OSError:
        return {}
    return {it["name"]: it["state"] for it in json.loads(text)["links"]
            if it["name"] in CHANNELS} if status == 200 else {}


def print_stands(out):
    """For how long robots stood that had driven; those who began together are told together. One that
    has answers meanwhile has lost the trail."""
    answers = {}
    with open(out / "exchanges.csv", encoding="ascii") as file:
        for row in csv.DictReader(file):
            answers.setdefault(row["robot"], []).append(float(row["time_s"]))
    stands = []
    with open(out / "tracks.csv", encoding="ascii") as file:
        drove, since = set(), {}
        for row in csv.DictReader(file):
            robot, now = row["robot"], float(row["time_s"])
            if row["wheel_left_mm_s"] == "0" and row["wheel_right_mm_s"] == "0":
                if robot in drove:
                    since.setdefault(robot, now)
                continue
            drove.add(robot)
            begin = since.pop(robot, now)
            if now - begin >= SHORT_STAND_S and sum(begin < it < now for it in answers[robot]) < 5:
                stands.append((begin, now - begin))
    together = []
    for begin, lasted in sorted(stands):
        if not together or begin > together[-1][0] + 1:
            together.append((begin, []))
        together[-1][1].append(lasted)
    for begin, lasted in together:
        print(f"at {begin:5.1f} s {len(lasted):2} robots stood, for {statistics.median(lasted):.1f} s, "
              f"{max(lasted):.1f} s at most")


class Standby:
    """The servers, the air of each channel, and the swarm. One server owns both channels, and another
    one stands by."""

    def __init__(self, bin_dir, folder, robots):
        self.folder, self.robots = folder, robots
        (folder / "scenario.toml").write_text(scenario(robots))
        config = MAP + "".join(link(name, "pty", path=f"{name}.pty", **RADIO) for name in CHANNELS)
        self.machines = Machines(bin_dir, folder, config=config)
        self.airs, self.swarm = [], None
        self.owner, self.other = "", ""
        try:
            self.airs += [Air({node: self.machines.folders[node] / f"{name}.pty" for node in "ab"},
                              folder / f"{name}.air") for name in CHANNELS]
            await_that(self.settle, "one server sends, and the other one stands by")
            self.swarm = Swarm(bin_dir, folder / "scenario.toml",
                               [str(folder / f"{name}.air") for name in CHANNELS], folder / "out",
                               "--medium-access")
            self.await_answers("every robot gets answers")
            for air in self.airs:
                air.all_are_there = len(air.sent)
        except BaseException:
            self.close()
            raise

    def close(self):
        end_processes(self.swarm)
        for air in self.airs:
            air.close()
        self.machines.close()

    def await_answers(self, what):
        """Five times: then they drive."""
        for _ in range(5):
            begin = time.monotonic()
            await_that(lambda: self.robots == sum(when > begin for air in self.airs
                                                  for when in list(air.answered.values())), what)

    def settle(self):
        """On a busy machine, a server may end and is to be started again, as systemd does, and each
        may have one of the channels: then one hands its own over."""
        for node, daemon in self.machines.daemons.items():
            status = daemon.process.poll()
            if status is not None:
                check(status in (0, 1, -signal.SIGKILL), f"{node} ended with {status}:\n{daemon.log()}")
                print(f"{node} ended with {status}, and starts again: {daemon.log().splitlines()[-1]}")
                self.machines.start(node)
        told = {node: states(self.machines, node) for node in "ab"}
        standby = {node: [name for name in CHANNELS if "standby" in told[node].get(name, "")]
                   for node in "ab"}
        for owner, other in ("ab", "ba"):
            if told[owner] and not standby[owner] and len(standby[other]) == len(CHANNELS):
                self.owner, self.other = owner, other
                return all(f"node {owner} sends" in it for it in told[other].values())
        if [len(it) for it in standby.values()] == [1, 1] and standby["a"] != standby["b"]:
            self.machines.daemons["b"].process.terminate()
            self.machines.daemons["b"].process.wait()
        return False

    @contextlib.contextmanager
    def handed_over(self):
        """At the end the other server sends, on both channels."""
        before = [len(air.sent) for air in self.airs]
        yield
        await_that(lambda: all(any(node == self.other for node, _, _ in air.sent[sent:])
                               for air, sent in zip(self.airs, before)), "the standby sends")

    def kill_machine(self):
        # On a busy machine, the other one may have taken over meanwhile.
        await_that(self.settle, "one server sends, and the other one stands by")
        killed = self.owner
        member = "ab".index(killed)
        with self.handed_over():
            for name in CHANNELS:  # first: its terminal may be another program's as soon as it is gone
                (self.machines.folders[killed] / f"{name}.pty").unlink()
            self.machines.kill(killed)
            self.machines.etcd.kill(member)
        self.await_answers("every robot gets answers again")
        self.machines.etcd.start(member)
        await_that(self.settle, "who comes back stands by")

    def stop_server(self):
        stopped = self.machines.daemons[self.owner]
        with self.handed_over():
            stopped.process.send_signal(signal.SIGSTOP)
        stopped.process.send_signal(signal.SIGCONT)
        self.await_answers("every robot gets answers again")
        # It may have made changes that never happened, and end.
        await_that(self.settle, "it notices, and stands by")
        self.await_answers("every robot still gets answers")

    def halts_are_told(self):
        """Whoever sends a halt says so; whoever stands by says who does."""
        def halted(node):
            status, text = self.machines.daemons[node].call("POST", "/api/v1/halt")
            answer = json.loads(text) if status == 200 else {"links": [], "down": []}
            return answer["links"], [(it["name"], it["role"], it["nodes"], it["owner"])
                                     for it in answer["down"]]
        standby = [(name, "standby", RADIO["on"], self.owner) for name in CHANNELS]
        return (halted(self.owner) == ([*CHANNELS, "udp"], [])
                and halted(self.other) == (["udp"], standby))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("bin_dir", type=pathlib.Path)
    parser.add_argument("--robots", type=int, default=4)
    parser.add_argument("--kills", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        standby = Standby(options.bin_dir.resolve(), pathlib.Path(temporary), options.robots)
        try:
            for _ in range(options.kills):
                standby.kill_machine()
            standby.stop_server()
            standby.swarm.finish(stop=True)
            check_files(standby.folder / "out", options.robots)
            print_stands(standby.folder / "out")
            await_that(lambda: standby.settle() and standby.halts_are_told(), "a halt is told of")
        finally:
            standby.close()
        for name, air in zip(CHANNELS, standby.airs):
            changes = air.changes()
            print(name, *(f"{before} to {after}: {silence:.2f} s;"
                          for before, after, silence, _ in changes))
            check(len(changes) > options.kills, "a hand-over is missing")
            checks = air.check_one_at_a_time()
            check(checks >= len(changes), "no sending was compared with another server's")
            print(f"{checks} sendings after another server's, none too early; of {len(changes)} "
                  f"hand-overs, {air.check_rounds_go_on()} began with a ROUND; "
                  "the others were late, or before the robots")
    print("load", *(f"{it:.1f}" for it in os.getloadavg()))
    print("ok")


if __name__ == "__main__":
    main()
