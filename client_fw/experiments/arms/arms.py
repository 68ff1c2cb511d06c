#!/usr/bin/env python3
"""A bridge of two to five branches: do ants whose deposits are scaled by the trip's cost leave a long branch for a
short one that opens later? Writes results/arms.csv and results/arms-time.csv, which figure.py draws.

    arms.py [--processes N] [--out FOLDER]

A case is one world: 30 bridges for each kind of deposits beside each other, out of each other's reach, so that NumPy decides
for all ants at once.
"""

import itertools
import math
import pathlib
import sys

import numpy as np
import pheromone_lab as lab

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

import road_ants  # noqa: E402  (after the path)
import sweeps  # noqa: E402

BRIDGES = 30  # of each kind of deposits
ROBOTS = 10  # of a bridge
SPAN_M, STUB_M, FAN_RAD = 6.0, 1.5, math.radians(30)  # nest to food; how branches leave them
SHORTEST_M = 6.6
TILE_M = (8.0, 12.0)
NEST_M = np.array([(TILE_M[0] - SPAN_M) / 2, TILE_M[1] / 2])  # in a tile
TILES_A_ROW = 12
WINDOW_S = 150  # of a row of arms-time.csv
PHASE_S, LAST_S = 900, 300  # of a row of arms.csv: the last part of each phase
# When the short branch is closed and opened.
EVENTS = {"late": [(0, False), (900, True)], "again": [(900, False), (1800, True)]}
DURATION_S = {"late": 1800, "again": 2700}
# Deposits: quanta a step after a trip of SHORTEST_M, and the exponent of a trip's cost by which they are divided. The
# second is a control: constant, and as few as the fourth leaves on the longest branch.
DEPOSITS = [(40, 0), (10, 0), (40, 1), (40, 2)]
NEST, FOOD = 0, 4  # corners of a branch
LOOK, OUT, BACK, CUT_OFF = range(4)


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


def scenario(corners, case):
    # Across the middle of the short branch.
    walls = [{"name": f"wall-{number}", "points_m": np.round(tile + corners[0][2] + [(0, -0.3), (0, 0.3)], 2),
              "open": (0, False) not in EVENTS[case]} for number, tile in enumerate(origins())]
    return {
        "run": {"duration_s": DURATION_S[case], "step_s": road_ants.STEP_S},
        "map": {"width_m": TILE_M[0] * TILES_A_ROW, "height_m": TILE_M[1] * -(-len(walls) // TILES_A_ROW),
                "cell_m": 0.1, "wide": True},
        "antennas": road_ants.ANTENNAS,
        "pheromone": [road_ants.trail(60)],
        "wall": walls,
        "event": [{"at_s": at_s, "wall": wall["name"], "open": opens} for at_s, opens in EVENTS[case] if at_s > 0
                  for wall in walls],
        "robots": [road_ants.group([[*(tile + NEST_M).tolist(), 0.0] for tile in origins() for _ in range(ROBOTS)])]}


class Ants:
    """What all robots remember, as arrays, and what they decide."""

    def __init__(self, corners):
        """`corners`: of each branch, in a tile."""
        self.corners = corners
        self.headings = np.arctan2(*(corners[:, 1] - corners[:, 0]).T[::-1])
        self.most_quanta, self.exponent = np.repeat(DEPOSITS, BRIDGES * ROBOTS, axis=0).T
        self.tiles = np.repeat(origins(), ROBOTS, axis=0)
        robots = len(self.tiles)
        self.looks = road_ants.Looks(robots, len(corners))
        self.state = np.full(robots, LOOK)
        self.branch = np.zeros(robots, int)
        self.corner = np.full(robots, NEST)  # goes to this one of its branch
        self.trip_m = np.zeros(robots)
        self.quanta = np.zeros(robots, int)

    def choose(self, ants):
        """Those that stand at the nest. Returns their courses, and who has chosen."""
        course = self.looks.turn(ants, self.headings, self.state == LOOK, True)
        ready = self.looks.done(self.state == LOOK, True)
        self.branch[ready] = self.looks.choose(ants.uniform(0), ready, True)
        self.state[ready], self.corner[ready], self.trip_m[ready] = OUT, NEST + 1, 0
        return course, ready

    def ahead(self, ants):
        """From each robot to the corner to which it goes."""
        to = self.tiles + self.corners[self.branch, self.corner]
        return to[:, 0] - ants.x_m, to[:, 1] - ants.y_m

    def turn_back(self, robots, quanta):
        self.state[robots], self.quanta[robots] = BACK, quanta
        self.corner[robots] -= 1

    def drive(self, ants):
        """From corner to corner; back from the food with a load, from a wall without one. One that a wall cuts off from
        the nest goes back to the food and home by any branch, without a trail: it does not know what that costs."""
        there = np.hypot(*self.ahead(ants)) < 0.1
        wall = (ants.contact == lab.WALL_CONTACT) & ~there
        out, back, cut_off = (self.state == state for state in (OUT, BACK, CUT_OFF))
        fed, home = there & (self.corner == FOOD), there & back & (self.corner == NEST)
        self.trip_m += np.where(out, (ants.left_m_s + ants.right_m_s) / 2 * road_ants.STEP_S, 0)
        self.corner[there & (out | cut_off) & ~fed] += 1
        self.corner[there & back & ~home] -= 1
        self.state[home] = LOOK
        found = np.flatnonzero(fed & out)
        self.turn_back(found, np.rint(self.most_quanta[found] * (SHORTEST_M / self.trip_m[found]) ** self.exponent[found]))
        self.turn_back(wall & out, 0)
        self.state[wall & back] = CUT_OFF
        self.corner[wall & back] += 1
        lost = fed & cut_off
        self.branch[lost] = (len(self.corners) * ants.uniform(1)[lost]).astype(int)
        self.turn_back(lost, 0)
        x, y = self.ahead(ants)
        return np.arctan2(y, x)

    def decide(self, ants):
        """What they do, and who chose a branch."""
        looking, chosen = self.choose(ants)
        standing = self.state == LOOK
        left, right = road_ants.wheels(ants, np.where(standing, looking, self.drive(ants)), standing)
        laying = (self.state == BACK) & (left + right > 0)
        return {"left": left, "right": right, "deposit": np.where(laying, self.quanta, 0),
                "sense": self.state == LOOK}, chosen


def simulate(count, case):
    """Choices in each window, by window, kind of deposits, bridge and branch."""
    corners = np.array(list(branches(count)))
    world = lab.World(scenario(corners, case), drive="ants")
    ants = Ants(corners)
    choices = np.zeros((DURATION_S[case] // WINDOW_S, len(origins()), count))
    while world.time_s < DURATION_S[case]:
        actions, chosen = ants.decide(world.groups["ants"])
        np.add.at(choices[int(world.time_s // WINDOW_S)], (chosen // ROBOTS, ants.branch[chosen]), 1)
        world.step(**actions)
    return choices.reshape(-1, len(DEPOSITS), BRIDGES, count)


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
