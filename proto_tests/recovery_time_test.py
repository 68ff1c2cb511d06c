#!/usr/bin/env python3
"""Recovery of a journal full of an operator's largest edits takes no longer than making them.

    recovery_time_test.py BIN_DIR [ROUNDS [POINTS]]      default: 20 rounds, strokes of 1000 points

On a map of 10^7 nodes: lines, areas, rings and zigzags, each as large as an edit may be, painted and
erased in turn; what the server refuses is left out. Then the server is killed. The next one has to
find the same state, and in the time that the edits took from request to answer, beyond what it takes
to start with an empty journal.
"""

import json
import math
import pathlib
import shutil
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from asking_robot import check  # noqa: E402
from operated_daemon import OperatedDaemon  # noqa: E402
from test_config import map_of, pheromone, pty, table  # noqa: E402

PATIENCE_S = 3600  # of a server that takes minutes for an edit
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


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[2:]] + [20, 1000][len(sys.argv[2:]):]
    with tempfile.TemporaryDirectory() as temporary:
        run(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(temporary), *numbers)
    print("ok")
