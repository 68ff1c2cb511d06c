#!/usr/bin/env python3
"""A bridge of two to five branches: do ants whose deposits are scaled by the trip's cost leave a long branch for a
short one that opens later? Writes results/arms.csv and results/arms-time.csv, which figure.py draws.

    arms.py [--processes N] [--out FOLDER]

A case is one world: 30 bridges for each kind of deposits beside each other, out of each other's reach. The behaviour is a
plug-in, arms.c, which cc compiles.
"""

import itertools
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import pheromone_lab as lab

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import sweeps  # noqa: E402  (after the path)

BRIDGES = 30  # of each kind of deposits
ROBOTS = 10  # of a bridge
SPAN_M, STUB_M, FAN_RAD = 6.0, 1.5, math.radians(30)  # nest to food; how branches leave them
SHORTEST_M = 6.6
TILE_M, CELL_M = (8.0, 12.0), 0.1
NEST_M = np.array([(TILE_M[0] - SPAN_M) / 2, TILE_M[1] / 2])  # in a tile
TILES_A_ROW = 12
STEP_S = 0.5
WINDOW_S = 150  # of a row of arms-time.csv
PHASE_S, LAST_S = 900, 300  # of a row of arms.csv: the last part of each phase
# When the short branch is closed and opened.
EVENTS = {"late": [(0, False), (900, True)], "again": [(900, False), (1800, True)]}
DURATION_S = {"late": 1800, "again": 2700}
# Deposits: quanta a step after a trip of SHORTEST_M, and the exponent of a trip's cost by which they are divided. The
# second is a control: constant, and as few as the fourth leaves on the longest branch.
DEPOSITS = [(40, 0), (10, 0), (40, 1), (40, 2)]
COUNTER = 0.0001  # of the pheromones that count choices: a quantum


def branches(count):
    """The corners of each branch in its tile, from the nest to the food, the shortest first: equally spaced lengths, of
    which the longest is twice the shortest. They leave the nest 30 degrees apart."""
    angles = sorted(((i - (count - 1) / 2) * FAN_RAD for i in range(count)), key=lambda it: (abs(it), -it))
    for number, angle in enumerate(angles):
        length = SHORTEST_M * (1 + number / (count - 1))
        x, y = STUB_M * math.cos(angle), STUB_M * math.sin(angle)
        aside = y + math.copysign(math.sqrt((length / 2 - STUB_M) ** 2 - (SPAN_M / 2 - x) ** 2), angle)
        yield NEST_M + [(0, 0), (x, y), (SPAN_M / 2, aside), (SPAN_M - x, y), (SPAN_M, 0)]


def origins():
    """Of the tiles: all bridges of the first kind of deposits, then of the next."""
    tiles = np.arange(BRIDGES * len(DEPOSITS))
    return np.stack([tiles % TILES_A_ROW, tiles // TILES_A_ROW], axis=1) * TILE_M


def scenario(count, case, plugin):
    corners = np.array(list(branches(count)))
    # Across the middle of the short branch.
    walls = [{"name": f"wall-{number}", "points_m": np.round(tile + corners[0][2] + [(0, -0.3), (0, 0.3)], 2),
              "open": (0, False) not in EVENTS[case]} for number, tile in enumerate(origins())]
    parameters = [count, ROBOTS, BRIDGES, TILES_A_ROW, *TILE_M, len(DEPOSITS), *np.ravel(DEPOSITS), *np.ravel(corners)]
    trail = {"type": 1, "name": "trail", "core_m": 0.1, "sigma_m": 0.2, "evaporation": "exponential", "half_life_s": 60,
             "quantum": 0.001, "maximum": 4.0, "directional": True}
    counters = [{**trail, "type": 2 + branch, "name": f"choice-{branch}", "evaporation": "permanent",
                 "quantum": COUNTER, "maximum": 6.0} for branch in range(count)]
    for counter in counters:
        del counter["half_life_s"]
    return {
        "run": {"duration_s": DURATION_S[case], "step_s": STEP_S},
        "map": {"width_m": TILE_M[0] * TILES_A_ROW, "height_m": TILE_M[1] * -(-len(walls) // TILES_A_ROW),
                "cell_m": CELL_M, "wide": True},
        # Narrow enough to tell branches apart that are 30 degrees from each other.
        "antennas": {"bias_m": 0.3, "forward_m": 0.8},
        "pheromone": [trail, *counters],
        "wall": walls,
        "event": [{"at_s": at_s, "wall": wall["name"], "open": opens} for at_s, opens in EVENTS[case] if at_s > 0
                  for wall in walls],
        # Points, which meet walls but not each other.
        "robots": [{"name": "ants", "plugin": plugin, "radius_m": 0.0, "acceleration_m_per_s2": 0.0, "senses": ["trail"],
                    "parameters": {f"parameter_{number:02}": float(value) for number, value in enumerate(parameters)},
                    "starts": [[*(tile + NEST_M).tolist(), 0.0] for tile in origins() for _ in range(ROBOTS)]}]}


def counts(world, count):
    """Choices until now, by tile and branch."""
    across, up = (round(side / CELL_M) for side in TILE_M)
    rows = BRIDGES * len(DEPOSITS) // TILES_A_ROW
    found = []
    for branch in range(count):
        nodes = np.nan_to_num(world.levels(f"choice-{branch}")[::-1][:rows * up, :TILES_A_ROW * across])
        found.append(np.rint(nodes.reshape(rows, up, TILES_A_ROW, across).sum(axis=(1, 3)) / COUNTER).ravel())
    return np.stack(found, axis=1)


def simulate(count, case):
    """Choices in each window, by window, kind of deposits, bridge and branch."""
    with tempfile.TemporaryDirectory() as folder:
        plugin = str(pathlib.Path(folder) / "arms.so")
        subprocess.run(["cc", "-std=c99", "-O2", "-shared", "-fPIC", "-I", HERE.parents[2], "-o", plugin, HERE / "arms.c",
                        "-lm"], check=True)
        world = lab.World(scenario(count, case, plugin))
    sums = [np.zeros((len(origins()), count))]
    for _ in range(DURATION_S[case] // WINDOW_S):
        world.run(round(WINDOW_S / STEP_S))
        sums.append(counts(world, count))
    return np.diff(sums, axis=0).reshape(-1, len(DEPOSITS), BRIDGES, count)


def run(count, case):
    choices = simulate(count, case)
    rows, times = [], []
    for kind, (quanta, exponent) in enumerate(DEPOSITS):
        facts = {"case": case, "branches": count, "quanta": quanta, "exponent": exponent}
        for until in range(PHASE_S, DURATION_S[case] + 1, PHASE_S):
            late = choices[(until - LAST_S) // WINDOW_S:until // WINDOW_S, kind].sum(axis=0)
            for bridge, of in enumerate(late):
                rows.append({**facts, "bridge": bridge + 1, "until_min": until // 60, "choices": int(of.sum()),
                             "short_share": float(of[0] / of.sum()), "most_chosen": int(of.argmax()) + 1,
                             "most_share": float(of.max() / of.sum())})
        for window, of in enumerate(choices[:, kind]):
            mean, half = sweeps.interval(list(of[:, 0] / np.maximum(1, of.sum(axis=1))))
            times.append({**facts, "minute": (window + 0.5) * WINDOW_S / 60, "short_share": mean,
                          "half_interval": half})
    return rows, times


if __name__ == "__main__":
    sweeps.main(__doc__, list(itertools.product((2, 3, 4, 5), EVENTS)), run, ("arms.csv", "arms-time.csv"))
