#!/usr/bin/env python3
"""The two-trail bench against the real daemon, in real time: robots that carry a Pioneer's firmware
over simulated radio, the nets in the daemon, which is killed and started again on the way.

By default four robots of this machine's core drive until one of them has chosen a trail; then the
daemon is killed once. Nothing is asserted about how fast that is. With TRIPS the last of the four
robots runs the image for the ATmega1284P, they make so many round trips, and the daemon is killed
twice. Afterwards

  * no robot has touched another one, and none has raised an exception, nor has the daemon;
  * every deposit that robots know of has reached the daemon, in number and sum, and no other one;
  * the journal, from its first event on, is replayed through the composed net by a program that
    knows nothing but the rule of firing.

Usage: trails_live_test.py BIN_DIR [TRIPS [KEPT_FOLDER]]
"""

import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from operated_daemon import PATIENCE_S, OperatedDaemon, check

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
ROBOTS = 4
STATUS = re.compile(r"([\d.]+) s +(\d+) of (\d+) robots got answers +(\d+) round trips +(\d+) "
                    r"deposits of (\d+) units +on A (\d+), on B (\d+) +(\d+) refusals")


class Status:
    """A line of pheromone-experiments trails --daemon."""

    def __init__(self, found):
        self.seconds = float(found[1])
        (self.answered, self.robots, self.trips, self.deposits, self.units, self.on_a, self.on_b,
         self.refusals) = (int(found[i]) for i in range(2, 10))


class Swarm:
    def __init__(self, bin_dir, folder, ports, *arguments):
        self.process = subprocess.Popen(
            [os.path.join(bin_dir, "pheromone-experiments"), "trails", "--bench", "test.toml",
             "--daemon", ",".join(ports), "--out", "out", *arguments],
            cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.lines = []

    def read_until(self, holds, what, deadline_s=PATIENCE_S):
        end = time.monotonic() + deadline_s
        for line in self.process.stdout:
            self.lines.append(line)
            found = STATUS.search(line)
            if found and holds(Status(found)):
                return Status(found)
            check(time.monotonic() < end, f"gave up waiting until {what}:\n{self.text()}")
        raise AssertionError(f"the program ended before {what}:\n{self.text()}")

    def finish(self, stop, deadline_s=PATIENCE_S):
        if stop:
            self.process.send_signal(signal.SIGINT)
        rest, _ = self.process.communicate(timeout=deadline_s)
        self.lines.append(rest)
        check(self.process.returncode == 0,
              f"the program ended with {self.process.returncode}:\n{self.text()}")
        return [Status(found) for found in map(STATUS.search, "".join(self.lines).splitlines())
                if found]

    def text(self):
        return "".join(self.lines[-30:])


def everybody(status):
    return status.answered == status.robots


def nobody(status):
    return status.answered == 0


def someone_chose(status):
    return status.on_a + status.on_b + status.deposits > 0


def write_bench(bin_dir, folder, avr):
    """The shipped bench, with a journal, and with where the AVR robot is switched on."""
    shutil.copytree(os.path.join(ROOT, "deploy/examples/nets"), os.path.join(folder, "nets"))
    bench = os.path.join(folder, "test.toml")
    shutil.copy(os.path.join(ROOT, "deploy/examples/bench.toml"), bench)
    frames = subprocess.run(
        [os.path.join(bin_dir, "pheromone-experiments"), "trails", "--bench", bench, "--frames", "--avr",
         str(avr)], check=True, capture_output=True, text=True).stdout
    check(frames.count("[[frame]]") == avr, f"frames: {frames}")
    with open(bench, "a", encoding="utf-8") as file:
        file.write('\n[journal]\nfolder = "state"\n' + frames)


def ctl(bin_dir, folder, *arguments):
    run = subprocess.run([os.path.join(bin_dir, "pheromonectl"), *arguments], cwd=folder,
                         capture_output=True, text=True, check=False)
    check(run.returncode == 0, f"pheromonectl {arguments}: {run.stderr}")
    return run.stdout


def replay(bin_dir, folder):
    """The number of firings in the journal of a stopped daemon."""
    ctl(bin_dir, folder, "net", "export", "nets/pheromone.toml", "--set", f"robots={ROBOTS}",
        "--format", "pnml", "--output", "net.pnml")
    ctl(bin_dir, folder, "net", "replay", "state", "--output", "firings.jsonl")
    judged = subprocess.run(
        [sys.executable, os.path.join(ROOT, "proto_tests/petri/replay_firings.py"), "net.pnml",
         "firings.jsonl"], cwd=folder, capture_output=True, text=True, check=False)
    check(judged.returncode == 0, f"replay: {judged.stdout}{judged.stderr}")
    print(judged.stdout, end="")


def run(bin_dir, folder, trips):
    ports = [os.path.join(folder, f"radio-{i + 1}.pty") for i in range(ROBOTS)]
    avr = 1 if trips else 0
    write_bench(bin_dir, folder, avr)
    daemon = OperatedDaemon(bin_dir, folder)
    swarm = Swarm(bin_dir, folder, ports, "--avr", str(avr),
                  *(("--trips", str(trips)) if trips else ("--seconds", "100000")))
    kills = [trips * (i + 1) // 3 for i in range(2)] if trips else [0]
    try:
        swarm.read_until(everybody, "every robot gets answers")
        for kill in kills:
            if kill:
                swarm.read_until(lambda status, kill=kill: status.trips >= kill,
                                 f"{kill} round trips were made", 3600)
            else:
                swarm.read_until(someone_chose, "somebody has chosen a trail", 3600)
            for port in ports:  # the number of a pty that is gone may be another test's at once
                os.unlink(port)
            daemon.process.kill()
            daemon.process.wait()
            swarm.read_until(nobody, "nobody is there to answer")
            daemon = OperatedDaemon(bin_dir, folder)
            swarm.read_until(everybody, "every robot gets answers again")
        statuses = swarm.finish(stop=not trips, deadline_s=4 * 3600)
        shown = json.loads(ctl(bin_dir, folder, "net", "show", "bench", "--json"))
        daemon.stop()
    finally:
        for owner in (swarm, daemon):
            if owner.process.poll() is None:
                owner.process.kill()
                owner.process.wait()
    print("".join(swarm.lines[-8:]))
    print(json.dumps({key: shown[key] for key in
                      ("firings", "records", "repeats", "exceptions", "deposits", "deposited",
                       "taken")}))
    check(shown["exceptions"] == 0, f"exceptions: {shown}")
    if trips:
        last = "".join(swarm.lines)
        known = re.search(r"deposits: (\d+) of (\d+) units", last)
        check((int(known[1]), int(known[2])) == (shown["deposits"], shown["deposited"]),
              f"robots know of {known[0]}, the daemon has {shown}")
        made = re.search(r"robots, \d+ s: (\d+) round trips", last)
        check(int(made[1]) >= trips and statuses[-1].refusals == 0, last[-2000:])
    replay(bin_dir, folder)


if __name__ == "__main__":
    binaries = pathlib.Path(sys.argv[1]).resolve()
    wanted = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    if len(sys.argv) > 3:
        os.makedirs(sys.argv[3])
        run(binaries, pathlib.Path(sys.argv[3]).resolve(), wanted)
    else:
        with tempfile.TemporaryDirectory() as temporary:
            run(binaries, pathlib.Path(temporary), wanted)
    print("ok")
