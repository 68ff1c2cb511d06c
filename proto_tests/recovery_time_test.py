#!/usr/bin/env python3
"""Recovery of a journal full of an operator's largest edits takes no longer than making them.

    recovery_time_test.py BIN_DIR [ROUNDS [POINTS]]      default: 20 rounds, strokes of 1000 points
    recovery_time_test.py BIN_DIR worst SECONDS          the worst operators, for so long

On a map of 10^7 nodes: lines, areas, rings and zigzags, each as large as an edit may be, painted and
erased in turn; what the server refuses is left out. Then the server is killed. The next one has to
find the same state, and in the time that the edits took from request to answer, beyond what it takes
to start with an empty journal.

The worst operators: three at once, without a pause, the largest brush strokes, areas, erasures, undo,
redo and other laws, on a map of 10^7 nodes and on the default one. After lives of random length,
about a minute, the server is killed once the last edit is complete. Each time the state has to be the same; in a run of ten minutes or more,
snapshots have to be made although there is little log, and each recovery has to take 10 s at most.
"""

import concurrent.futures
import json
import math
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from checks import check
from operated_daemon import OperatedDaemon, await_that
from test_config import map_of, pheromone, pty, table

PATIENCE_S = 3600  # of a server that takes minutes for an edit
STILL_S = 1.0  # that long nothing has changed
SLACK_S = 1.0  # of a machine that does other things too
SIDE_M = 63.24
BOX_M = 40.0  # its nodes are as many as an edit may span; it may touch a quarter of them

CONFIG = (map_of(SIDE_M, SIDE_M, cell_m=0.02, bias_m=0.04, wide=True)
          + pheromone(1, "paint", core_m=0.05, sigma_m=0.05) + pty("radio")
          + table("journal", folder="state", snapshot_mib=1024))


def ring(points):
    angles = [2 * math.pi * i / (points - 1) for i in range(points)]
    return [[round(BOX_M / 2 * (1 + math.cos(a)), 3), round(BOX_M / 2 * (1 + math.sin(a)), 3)]
            for a in angles]


def zigzag(points, side_m, width_m, margin_m):
    """To and fro across the diagonal from (margin, margin)."""
    offset = width_m / 2 / math.sqrt(2)
    along = [margin_m + offset + (side_m - 2 * offset) * i / (points - 1) for i in range(points)]
    return [[round(a + (-offset if i % 2 else offset), 3), round(a - (-offset if i % 2 else offset), 3)]
            for i, a in enumerate(along)]


def shapes(points):
    return {
        "line across the map": {"points_m": [[0, 0], [SIDE_M, SIDE_M]], "radius_m": 2.2},
        "line": {"points_m": [[3.3, 3.3], [BOX_M - 3.3, BOX_M - 3.3]], "radius_m": 3.3},
        "area": {"area_m": [0, 0, 20.46, 20.46]},
        "area of the whole map": {"area_m": [0, 0, SIDE_M, SIDE_M]},
        "the whole map": {"all": True},
        "ring": {"points_m": ring(points), "radius_m": 0.05},
        "zigzag": {"points_m": zigzag(points, BOX_M, 8, 0), "radius_m": 0.02},
        "wide zigzag": {"points_m": zigzag(points, 12, 12, 4), "radius_m": 4},
    }


def edit(daemon, action, shape):
    """Seconds until it was done; None if it was refused."""
    begin = time.monotonic()
    status, text = daemon.call("POST", f"/api/v1/{action}", {"pheromone": "paint", **shape})
    if status == 200:
        return time.monotonic() - begin
    check(status == 409, f"{action}: {status} {text}")
    print(f"refused: {text.strip()}", flush=True)
    return None


def make_edits(daemon, rounds, points):
    """Seconds, all together."""
    total_s = 0.0
    for name, shape in shapes(points).items():
        first_s = edit(daemon, "paint", shape)
        if first_s is None:
            continue
        times_s = [first_s] + [edit(daemon, "paint" if i % 2 else "erase", shape)
                               for i in range(rounds)]
        print(f"{name}: {sum(times_s) / len(times_s) * 1000:.0f} ms each", flush=True)
        total_s += sum(times_s)
    return total_s


def state_hash(daemon):
    status, text = daemon.call("GET", "/api/v1/status?hash=1")
    check(status == 200, f"status: {status} {text}")
    return json.loads(text)["state_hash"]


def start(bin_dir, folder):
    begin = time.monotonic()
    daemon = OperatedDaemon(bin_dir, folder, PATIENCE_S)
    return daemon, time.monotonic() - begin


def run(bin_dir, folder, rounds, points):
    (folder / "test.toml").write_text(CONFIG, encoding="ascii")
    daemon, _ = start(bin_dir, folder)
    daemon.kill()
    shutil.rmtree(folder / "state")
    daemon, empty_s = start(bin_dir, folder)
    try:
        made_s = make_edits(daemon, rounds, points)
        made = state_hash(daemon)
        daemon.kill()
        daemon, started_s = start(bin_dir, folder)
        recovered = state_hash(daemon)
    finally:
        daemon.kill()
    print(f"making the edits took {made_s:.2f} s, recovering them {started_s - empty_s:.2f} s beyond "
          f"the {empty_s:.2f} s of an empty start", flush=True)
    check(recovered == made, f"state {recovered} was recovered, not {made}")
    check(started_s - empty_s <= made_s + SLACK_S, "recovery took longer than making")


class WorstOperators:
    """On one map, until all time is used up."""

    LIFE_S = 60.0
    LIMIT_S = 10.0
    FROM_S = 600.0  # a run of this length is about time too

    def __init__(self, bin_dir, folder, side_m, cell_m, radius_m):
        self.bin_dir, self.folder = bin_dir, folder
        self.side_m, self.cell_m, self.radius_m = side_m, cell_m, radius_m
        self.write_config(7200)

    def write_config(self, tau_s):
        (self.folder / "test.toml").write_text(
            map_of(self.side_m, self.side_m, cell_m=self.cell_m, bias_m=2 * self.cell_m, wide=True)
            + pheromone(1, "paint", core_m=0.05, sigma_m=0.05, tau_s=tau_s) + pty("radio")
            + table("journal", folder="state"), encoding="ascii")

    def change(self, daemon, rng):
        kind = rng.choice(["brush"] * 12 + ["area", "whole", "all", "reverse", "reverse", "law"])
        x, y = rng.uniform(0, self.side_m), rng.uniform(0, self.side_m)
        shape = {"brush": {"points_m": [[x, y], [min(self.side_m, x + self.radius_m), y]],
                           "radius_m": self.radius_m},
                 "area": {"area_m": [0, 0, x, y]},
                 "whole": {"area_m": [0, 0, self.side_m, self.side_m]},
                 "all": {"all": True}}.get(kind)
        if kind == "law":
            self.write_config(7200 + rng.randrange(100))
            daemon.process.send_signal(signal.SIGHUP)
        elif kind == "reverse":
            daemon.call("POST", "/api/v1/" + rng.choice(["undo", "redo"]), {})
        else:
            action = "erase" if kind == "all" else rng.choice(["paint", "paint", "erase"])
            daemon.call("POST", f"/api/v1/{action}", {"pheromone": "paint", **shape})

    def snapshots(self):
        return {path.name for path in (self.folder / "state").glob("*.snapshot")}

    def live(self, daemon, seed, seconds):
        """The last event and the state's hash, once nothing changes it any more: what is swept
        away after an edit is events, too."""
        end = time.monotonic() + seconds

        def operate(rng):
            while time.monotonic() < end:
                self.change(daemon, rng)
        with concurrent.futures.ThreadPoolExecutor(3) as pool:
            operators = [pool.submit(operate, random.Random(f"{seed}.{i}")) for i in range(3)]
        for operator in operators:
            operator.result()
        # Two may have written the file at once, and a signal is not answered.
        await_that(lambda: daemon.call("POST", "/api/v1/reload", {})[0] == 200, "the file is read")
        # What was not waited for goes on for a while; the last change of all is this one.
        await_that(lambda: daemon.call("POST", "/api/v1/paint", {
            "pheromone": "paint", "points_m": [[0, 0]], "radius_m": 0.1})[0] == 200, "an edit is made")
        seen = {}

        def is_still():
            status = json.loads(daemon.call("GET", "/api/v1/status?hash=1")[1])
            now = (status["sequence"], status["state_hash"])
            if seen.get("last") != now or status["durable_sequence"] != now[0]:
                seen.update(last=now, since=time.monotonic())
            return time.monotonic() - seen["since"] > STILL_S
        await_that(is_still, "the state stays", PATIENCE_S)
        return seen["last"]

    def recovered(self):
        """As live, by the journal alone."""
        shown = subprocess.run([self.bin_dir / "pheromonectl", "journal", "check", self.folder / "state"],
                               text=True, capture_output=True, check=True).stdout
        sequence, state = re.search(r"^state: sequence (\d+), .* hash (\w+),", shown, re.M).groups()
        return int(sequence), state

    def run(self, seconds):
        rng = random.Random(1)
        longest_s, kills, compared, seen = 0.0, 0, 0, set()
        daemon, _ = start(self.bin_dir, self.folder)
        try:
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                life_s = rng.uniform(0.2, 1.8) * min(self.LIFE_S, seconds / 2)
                made = self.live(daemon, kills, life_s)
                seen |= self.snapshots()
                daemon.kill()
                found = self.recovered()
                # One more event may have come after the last look.
                check(found == made or found[0] > made[0], f"state {found}, not {made}")
                compared += found == made
                daemon, took_s = start(self.bin_dir, self.folder)
                longest_s, kills = max(longest_s, took_s), kills + 1
        finally:
            daemon.kill()
        print(f"{self.side_m} m: {kills} kills, {compared} states compared, {len(seen)} snapshots, the "
              f"longest recovery took {longest_s:.2f} s", flush=True)
        check(2 * compared >= kills, "most states had changed after the last look")
        if seconds >= self.FROM_S:
            check(seen, "no snapshot was made")
            check(longest_s <= self.LIMIT_S, "a recovery took too long")


def run_worst(bin_dir, folder, seconds):
    for name, side_m, cell_m, radius_m in (("large", SIDE_M, 0.02, 4), ("default", 10.0, 0.1, 4)):
        (folder / name).mkdir()
        WorstOperators(bin_dir, folder / name, side_m, cell_m, radius_m).run(seconds)


if __name__ == "__main__":
    if sys.argv[2:3] == ["worst"]:
        with tempfile.TemporaryDirectory() as temporary:
            run_worst(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(temporary),
                      float(sys.argv[3]))
        print("ok")
        sys.exit()
    numbers = [int(word) for word in sys.argv[2:]] + [20, 1000][len(sys.argv[2:]):]
    with tempfile.TemporaryDirectory() as temporary:
        run(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(temporary), *numbers)
    print("ok")
