#!/usr/bin/env python3
"""Ants towards a goal in a maze whose gate closes and opens again: how long are their paths beside A*'s, and how soon
do they find the new best one? Writes results/maze.csv and results/maze-time.csv, which figure.py draws.

    maze.py [--processes N] [--out FOLDER]

A case is one world: 30 mazes for each kind of deposits beside each other, so that NumPy decides for all ants at once.
"""

import itertools
import pathlib
import sys

import numpy as np
import pheromone_lab as lab

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

import road_ants  # noqa: E402  (after the path)
import sweeps  # noqa: E402

# Cells of 1 m. The nest is in the lower left corner, the goal in the upper right one; # is the gate.
MAZE = """
+--+--+--+--+--+--+
|  |  #           |
+  +  +--+  +--+  +
|        |  |     |
+  +  +  +  +--+--+
|        |        |
+--+  +  +--+--+  +
|     |        |  |
+  +  +  +  +  +  +
|     |  |  |  |  |
+  +  +  +  +  +  +
|        |        |
+--+--+--+--+--+--+
""".strip().splitlines()
SIDE = 6
TILE_M = SIDE + 1.0
TILES_A_ROW = 10
MAZES = 30  # of each kind of deposits
ROBOTS = 12  # of a maze
CLOSES_S, OPENS_S, DURATION_S = 1800, 3600, 5400
WINDOW_S, LATE_S = 300, 600  # of a row of maze-time.csv; the last part of a phase, for maze.csv
STEPS = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])  # of a cell, by direction
HEADINGS = np.arctan2(STEPS[:, 1], STEPS[:, 0])
NEST, GOAL = 0, SIDE * SIDE - 1
SHORTEST, DETOUR = 10, 18  # cells from the nest to the goal, with the gate open and closed
# Deposits: quanta a step after a path of SHORTEST, and the exponent of its length by which they are divided.
NONE, CONSTANT, SCALED = (0, 0), (40, 0), (40, 2)
LOOK, OUT, BACK = range(3)


def wall_at(column, row, direction):
    """What the drawing has on that side of a cell."""
    line, character = 2 * (SIDE - 1 - row) + 1, 3 * column + 1
    return {(1, 0): MAZE[line][character + 2], (-1, 0): MAZE[line][character - 1],
            (0, 1): MAZE[line - 1][character], (0, -1): MAZE[line + 1][character]}[tuple(STEPS[direction])]


def openings(gate_open):
    """Whether there is a way, by cell and direction."""
    ways = " #" if gate_open else " "
    return np.array([[wall_at(cell % SIDE, cell // SIDE, direction) in ways for direction in range(4)]
                     for cell in range(SIDE * SIDE)])


def sides(mark):
    """The two ends of each wall piece with this mark, in cells from the lower left corner."""
    for cell, direction in itertools.product(range(SIDE * SIDE), range(4)):
        column, row = cell % SIDE, cell // SIDE
        if wall_at(column, row, direction) in mark:
            middle = np.array([column + 0.5, row + 0.5]) + STEPS[direction] / 2
            along = STEPS[direction][::-1] / 2
            yield middle - along, middle + along


def scenario(half_life_s, tiles):
    walls = [[(tile + end).tolist() for end in ends] for tile in tiles for ends in sides("-|")]
    gates = [[(tile + end).tolist() for end in next(sides("#"))] for tile in tiles]
    names = [f"gate-{number}" for number in range(len(gates))]
    rows = -(-len(tiles) // TILES_A_ROW)
    return {
        "run": {"duration_s": DURATION_S, "step_s": road_ants.STEP_S},
        "map": {"width_m": TILE_M * TILES_A_ROW, "height_m": TILE_M * rows, "cell_m": 0.1, "wide": True},
        # Short of the next cell: what is behind a wall is not sensed.
        "antennas": {"bias_m": 0.2, "forward_m": 0.4},
        "pheromone": [road_ants.trail(half_life_s)],
        "obstacles": {"walls": [{"points_m": ends, "thickness_m": 0.02} for ends in walls]},
        "wall": [{"name": name, "points_m": ends, "thickness_m": 0.02, "open": True} for name, ends in zip(names, gates)],
        "event": [{"at_s": at_s, "wall": name, "open": opens} for at_s, opens in ((CLOSES_S, False), (OPENS_S, True))
                  for name in names],
        "robots": [road_ants.group([[x + 0.5, y + 0.5, 0.0] for x, y in tiles for _ in range(ROBOTS)])]}


class Ants:
    """What all robots remember, as arrays, and what they decide."""

    def __init__(self, deposits, tiles):
        """`deposits`: of as many mazes each."""
        self.most_quanta, self.exponent = np.repeat(deposits, len(tiles) // len(deposits) * ROBOTS, axis=0).T
        self.tiles = np.repeat(tiles, ROBOTS, axis=0)
        robots = len(self.tiles)
        self.looks = road_ants.Looks(robots, 4)
        self.state = np.full(robots, LOOK)
        self.lost = np.zeros(robots, bool)  # looks for the nest
        self.came = np.full(robots, -1)  # the direction in which it came
        self.path = np.zeros((robots, SIDE * SIDE + 1), int)  # its cells, without loops
        self.last = np.zeros(robots, int)  # of its path: where it is, or where it comes from
        self.goes = np.zeros(robots, int)  # to this cell
        self.quanta = np.zeros(robots, int)
        self.found = []  # (step, robots, cells of the path)

    def here(self, robots):
        return self.path[robots, self.last[robots]]

    def choose(self, ants, ways):
        """Those that stand: everywhere but back, if there is another way."""
        robots = np.arange(len(ants))
        is_open = ways[self.here(robots)]
        back = (self.came[:, None] + 2) % 4 == np.arange(4)
        ahead = is_open & ~(back & (self.came >= 0)[:, None])
        is_open = np.where(ahead.any(axis=1)[:, None], ahead, is_open)
        course = self.looks.turn(ants, HEADINGS, self.state == LOOK, is_open)
        ready = self.looks.done(self.state == LOOK, is_open)
        if len(ready):
            self.came[ready] = self.looks.choose(ants.uniform(0), ready, is_open)
            self.goes[ready] = self.here(ready) + STEPS[self.came[ready]] @ (1, SIDE)
            self.state[ready] = OUT
        return course

    def arrive_out(self, robots, step):
        """In a cell."""
        cell = self.goes[robots]
        road_ants.extend(self.path, self.last, robots, cell)
        self.state[robots] = LOOK
        home = robots[self.lost[robots] & (cell == NEST)]
        self.start(home)
        found = robots[~self.lost[robots] & (cell == GOAL)]
        if len(found):
            self.found.append((step, found, self.last[found]))
            self.quanta[found] = np.rint(self.most_quanta[found] * (SHORTEST / self.last[found]) ** self.exponent[found])
            self.state[found] = BACK
            self.goes[found] = self.path[found, self.last[found] - 1]

    def arrive_back(self, robots):
        self.last[robots] -= 1
        home = self.last[robots] == 0
        self.start(robots[home])
        self.goes[robots[~home]] = self.path[robots[~home], self.last[robots[~home]] - 1]

    def start(self, robots):
        """From the cell where they are, which is the nest unless they are lost."""
        self.path[robots, 0] = self.here(robots)
        self.last[robots], self.came[robots], self.state[robots] = 0, -1, LOOK
        self.lost[robots] = self.path[robots, 0] != NEST

    def drive(self, ants, step):
        goal = self.tiles + np.stack([self.goes % SIDE, self.goes // SIDE], axis=1) + 0.5
        there = (np.hypot(goal[:, 0] - ants.x_m, goal[:, 1] - ants.y_m) < 0.1) & (self.state != LOOK)
        wall = (ants.contact == lab.WALL_CONTACT) & ~there
        self.arrive_out(np.flatnonzero(there & (self.state == OUT)), step)
        self.arrive_back(np.flatnonzero(there & (self.state == BACK)))
        # The gate closed in front of it: back to the cell it came from, and look anew, without its load if it had one.
        self.goes[wall] = self.here(np.flatnonzero(wall))
        back = np.flatnonzero(wall & (self.state == BACK))
        self.start(back)
        self.state[back] = OUT  # it looks in the middle of that cell
        goal = self.tiles + np.stack([self.goes % SIDE, self.goes // SIDE], axis=1) + 0.5
        return np.arctan2(goal[:, 1] - ants.y_m, goal[:, 0] - ants.x_m)

    def decide(self, ants, step, ways):
        looking = self.choose(ants, ways)
        course = self.drive(ants, step)
        standing = self.state == LOOK
        left, right = road_ants.wheels(ants, np.where(standing, looking, course), standing)
        laying = (self.state == BACK) & (left + right > 0)
        return {"left": left, "right": right, "deposit": np.where(laying, self.quanta, 0), "sense": standing}


def recovery_s(times, cells, best):
    """The first time at which eight of ten paths in a row are at most a fifth longer than the best; or None."""
    good = np.convolve(cells <= 1.2 * best, np.ones(10), "valid") >= 8 if len(cells) >= 10 else np.zeros(0, bool)
    return float(times[good.argmax() + 9]) if good.any() else None


PHASES = ((0, CLOSES_S, SHORTEST), (CLOSES_S, OPENS_S, DETOUR), (OPENS_S, DURATION_S, SHORTEST))


def measures(facts, a_star_m, times, mazes, cells):
    rows, windows = [], []
    for phase, (from_s, until_s, best) in enumerate(PHASES):
        for number in range(MAZES):
            of = (mazes == number) & (times >= from_s) & (times < until_s)
            late = cells[of & (times >= until_s - LATE_S)]
            rows.append({**facts, "maze": number + 1, "phase": phase + 1, "a_star_m": a_star_m[phase],
                         "best_m": float(best), "paths": int(of.sum()), "late_paths": len(late),
                         "late_path_m": float(late.mean()) if len(late) else None,
                         "recovery_s": recovery_s(times[of] - from_s, cells[of], best)})
        for begin_s in range(from_s, until_s, WINDOW_S):
            of = (times >= begin_s) & (times < begin_s + WINDOW_S)
            means = [float(cells[of & (mazes == number)].mean()) for number in np.unique(mazes[of])]
            mean, half = sweeps.interval(means) if len(means) > 1 else (None, None)
            windows.append({**facts, "minute": (begin_s + WINDOW_S / 2) / 60, "a_star_m": a_star_m[phase],
                            "best_m": float(best), "mazes": len(means), "path_m": mean, "half_interval_m": half})
    return rows, windows


def run(half_life_s, deposits):
    tiles = np.array([(TILE_M * (tile % TILES_A_ROW) + 0.5, TILE_M * (tile // TILES_A_ROW) + 0.5)
                      for tile in range(MAZES * len(deposits))])
    world = lab.World(scenario(half_life_s, tiles), drive="ants")
    ants = Ants(deposits, tiles)
    a_star_m = []
    ends = [tuple(tiles[0] + 0.5 + (cell % SIDE, cell // SIDE)) for cell in (NEST, GOAL)]
    while world.time_s < DURATION_S:
        if world.time_s in (0, CLOSES_S, OPENS_S):
            a_star_m.append(float(np.hypot(*np.diff(world.route(*ends), axis=0).T).sum()))
            ways = openings(not CLOSES_S <= world.time_s < OPENS_S)
        world.step(**ants.decide(world.groups["ants"], world.steps, ways))
    times = np.concatenate([np.full(len(who), step * road_ants.STEP_S) for step, who, _ in ants.found])
    tile = np.concatenate([who // ROBOTS for _, who, _ in ants.found])
    cells = np.concatenate([path for _, _, path in ants.found])
    rows, windows = [], []
    for number, (quanta, exponent) in enumerate(deposits):
        of = tile // MAZES == number
        facts = {"half_life_s": half_life_s, "quanta": quanta, "exponent": exponent}
        for found, more in zip((rows, windows), measures(facts, a_star_m, times[of], tile[of] % MAZES, cells[of])):
            found += more
    return rows, windows


if __name__ == "__main__":
    sweeps.main(__doc__, [(60, [NONE, CONSTANT, SCALED]), (200, [CONSTANT, SCALED])], run,
                ("maze.csv", "maze-time.csv"))
