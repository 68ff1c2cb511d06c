#!/usr/bin/env python3
"""What a map of 512 x 512 cells costs pheromone-ros2, with one reader on Fast DDS.

    map_bench.py BIN_DIR TESTS_DIR [SECONDS]        default: 20 seconds each

Half of the map is painted. First it stays so: the bridge asks the server, and compares, the baseline.
Then something is deposited twenty times a second, so that each raster differs from the last and is
published. A row for each: maps a second, the bridge's processor time for each second in percent of one
core, and the ratio. 5 maps a second for at most 3 % are wanted.
"""

import pathlib
import random
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1] / "client_fw" / "ros2" / "testing")]

from free_numbers import free_domain  # noqa: E402
from operated_daemon import OperatedDaemon, await_that, check, write_config  # noqa: E402
from peer import Peer  # noqa: E402
from ros2_live_test import Bridge  # noqa: E402
from test_config import map_of, pheromone  # noqa: E402

SIDE_M = 51.1  # 512 nodes
MAP = "rt/pheromone/paint"


def measure(bin_dir, tests_dir, changes, seconds):
    """Maps a second that the reader got, and the part of a core that the bridge took."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        write_config(folder, map_of(SIDE_M, SIDE_M, wide=True) + pheromone(1, "paint"))
        daemon = OperatedDaemon(bin_dir, folder)
        domain = free_domain()
        peer = Peer(tests_dir, domain)
        bridge = None
        try:
            for y_m in range(2, 25, 4):
                status, text = daemon.call("POST", "/api/v1/paint", {
                    "pheromone": "paint", "points_m": [[0, y_m], [SIDE_M, y_m]], "radius_m": 2.1})
                check(status == 200, text)
            peer.read(MAP, "nav_msgs/msg/OccupancyGrid", latched=True)
            bridge = Bridge(bin_dir, folder, domain, "--socket", folder / "pheromoned.sock")
            await_that(lambda: bridge.log() and peer.last(MAP), "the map comes")
            info = peer.last(MAP)["info"]
            check((info["width"], info["height"]) == (512, 512), info)
            places = random.Random(1)
            begin_s, begin_cpu_s, before = time.monotonic(), bridge.cpu_s(), peer.count(MAP)
            while (passed_s := time.monotonic() - begin_s) < seconds:
                if changes:
                    status, text = daemon.call("POST", "/api/v1/deposit", {
                        "pheromone": "paint", "x_m": places.uniform(1, 50), "y_m": places.uniform(30, 50)})
                    check(status == 200, text)
                time.sleep(0.05)
            maps, core_s = peer.count(MAP) - before, bridge.cpu_s() - begin_cpu_s
            check(bridge.log(), "pheromone-ros2 has said nothing")
            check((maps > 0) == changes, f"found {maps} maps of one that changes: {changes}")
            return maps / passed_s, core_s / passed_s
        finally:
            if bridge is not None:
                bridge.process.kill()
                bridge.process.wait()
            peer.close()
            daemon.kill()


def main():
    bin_dir, tests_dir = (pathlib.Path(it).resolve() for it in sys.argv[1:3])
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 20
    print("map        maps/s  % of a core  ratio")
    baseline = None
    for name, changes in (("stays", False), ("changes", True)):
        maps, core = measure(bin_dir, tests_dir, changes, seconds)
        baseline = baseline or core
        print(f"{name:9}  {maps:6.2f}  {100 * core:11.2f}  {core / baseline:5.2f}", flush=True)


if __name__ == "__main__":
    main()
