#!/usr/bin/env python3
"""How fast a behaviour in NumPy is beside the built-in one that does the same, and beside a loop of Python.

    bench.py [--robots 100000] [--steps 60] [--threads 1]

The three worlds make their steps in turn, so that what else the machine does is shared. Times are of the
process's CPU with one thread and of the wall with several; medians. Equal hashes: all did the same.
"""

import argparse
import math
import statistics
import time

import numpy as np
import pheromone_lab as lab

SPEED_MM_S = 200


def scenario(robots):
    """One robot a square metre, all of which follow and lay one pheromone, as lab_bench has it."""
    side = round(math.sqrt(robots), 1)
    return {
        "map": {"width_m": side, "height_m": side, "cell_m": 0.1, "wide": True},
        "antennas": {"bias_m": 0.33},
        "pheromone": [{"type": 1, "name": "trail", "core_m": 0.1, "sigma_m": 0.4, "tau_s": 15.0, "quantum": 0.125,
                       "maximum": 1.0, "directional": True}],
        "robots": [{"name": "ants", "behaviour": "follow", "count": robots, "radius_m": 0.1,
                    "parameters": {"law": "differential", "lost_trail": "straight", "quanta": 1,
                                   "speed_m_per_s": SPEED_MM_S / 1000}}]}


def differential(group):
    """The differential law of the core (client_fw/core/steering/steering.h) in NumPy, to the millimetre."""
    left, right = group.p_left[0].astype(np.int32), group.p_right[0].astype(np.int32)
    scale = np.maximum(np.maximum(np.abs(left), np.abs(right)), lab.UNIT)
    difference = left - right
    slower = SPEED_MM_S - (np.abs(difference) * SPEED_MM_S + scale // 2) // scale
    return (np.where(difference > 0, slower, SPEED_MM_S) / 1000,
            np.where(difference <= 0, slower, SPEED_MM_S) / 1000, 1)


def one_by_one(group):
    """The same, robot by robot."""
    left, right = np.empty(len(group)), np.empty(len(group))
    for i, (l, r) in enumerate(zip(group.p_left[0].tolist(), group.p_right[0].tolist())):
        scale = max(abs(l), abs(r), lab.UNIT)
        slower = SPEED_MM_S - (abs(l - r) * SPEED_MM_S + scale // 2) // scale
        left[i], right[i] = (slower / 1000, SPEED_MM_S / 1000) if l > r else (SPEED_MM_S / 1000, slower / 1000)
    return left, right, 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=100_000)
    parser.add_argument("--steps", type=int, default=60, help="that are measured; a hundred before do not count")
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    now = time.process_time if options.threads == 1 else time.perf_counter
    worlds = {"built in": {}, "NumPy": {"drive": {"ants": differential}}, "Python loop": {"drive": {"ants": one_by_one}}}
    worlds = {name: lab.World(scenario(options.robots), threads=options.threads, **how)
              for name, how in worlds.items()}
    seconds = {name: [] for name in worlds}
    for step in range(100 + options.steps):
        for name, world in worlds.items():
            start = now()
            world.step()
            if step >= 100:
                seconds[name].append(now() - start)
    base = statistics.median(seconds["built in"])
    for name, world in worlds.items():
        median = statistics.median(seconds[name])
        print(f"{options.robots} robots, {options.threads} threads, {name:>11}: "
              f"{median / options.robots * 1e9:5.0f} ns a robot and step, "
              f"{options.robots * world.step_s / median:7.0f} in real time, {base / median:4.0%} of the built-in's")
    print("equal hashes:", "yes" if len({world.hash() for world in worlds.values()}) == 1 else "NO")


if __name__ == "__main__":
    main()
