#!/usr/bin/env python3
"""The map as the exo-synapses of fig. 8, Susnea et al. 2009: an evolution strategy learns the levels of its nodes, so that
robots find a goal behind a wall. How good are such maps beside those that ants laid, and what did they cost? Writes
results/synapses.csv, -experience.csv, -maps.csv and -tracks.csv, which figure.py draws.

    synapses.py [--processes N] [--out FOLDER]

A case is a kind of map; its 30 maps lie beside each other in one world, out of each other's reach.
"""

import pathlib
import sys
import tempfile

import numpy as np
import pheromone_lab as lab

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

import road_ants  # noqa: E402  (after the path)
import sweeps  # noqa: E402

SEEDS = 30  # maps of each kind
NODES, CELL_M, PITCH = 13, 0.5, 16  # nodes of a map's side, and from map to map
SIDE_M = (NODES - 1) * CELL_M
MAPS_A_ROW = 24
WALL_ROW, WALL_NODES, BEYOND_M = 6, 9, 1.0  # the wall: so many nodes from the left, and beyond the map
CORNER_M = np.array([(WALL_NODES - 0.5) * CELL_M, WALL_ROW * CELL_M])
GOAL_M, GOAL_RADIUS_M = np.array([1.5, 5.0]), 0.4
GOAL_NODE = np.rint(GOAL_M / CELL_M).astype(int) @ (1, NODES)
START_M = (1.0, 0.5), (5.0, 1.5)  # corners of the area in which robots start, headed up, 90 degrees more or less
TIME_S = 60.0  # that a robot has
STEPS = round(TIME_S / road_ants.STEP_S)
FIXED = np.array((1.0, -1.0))  # weights of the antennas: fig. 8
FRESH = 100  # starts of a test
HALF_LIFE_S = 60.0  # of the test with evaporation
# The evolution strategy: maps in a generation, starts of each, how far levels and weights are varied at first and at last.
GENERATIONS, CANDIDATES, STARTS, SPREAD = 50, 16, 6, (0.3, 0.12)
SHOWN = (1, 3, 6, 12, 25, 50)  # generations that are tested
# The ants of a map, quanta for each node of a path of SHORTEST nodes, and chance in a wheel; when the map is tested.
ANTS, QUANTA, SHORTEST, WANDER_M_S = 12, 200, 12, 0.15
TESTED_S = (100, 300, 1000, 2000)
ANTS_HALF_LIFE_S = 300.0
TURN, OUT, BACK = range(3)


def free_nodes():
    free = np.ones((NODES, NODES), bool)
    free[WALL_ROW, :WALL_NODES] = False
    return free


def origins(maps):
    number = np.arange(maps)
    return (np.stack([number % MAPS_A_ROW, number // MAPS_A_ROW], axis=1) * PITCH + 2) * CELL_M


def starts(random, maps, robots):
    """Poses in the map: x, y in m, heading in degrees."""
    (left, bottom), (right, top) = START_M
    return random.uniform((left, bottom, 0), (right, top, 180), (maps, robots, 3))


def world_of(levels, poses, half_life_s=None):
    """The maps (a row of nodes each, the lowest first), and robots at their starts. What is printed is deposited."""
    maps = len(levels)
    at = origins(maps)
    rows = -(-maps // MAPS_A_ROW)
    raster = np.zeros((rows * PITCH, MAPS_A_ROW * PITCH))
    for (column, row), one in zip(np.rint(at / CELL_M).astype(int), levels):
        raster[row:row + NODES, column:column + NODES] = one
    trail = {"type": 1, "name": "trail", "core_m": 0.1, "sigma_m": 0.9, "quantum": 0.001, "maximum": 1.0,
             "evaporation": "exponential" if half_life_s else "permanent", "directional": True,
             **({"half_life_s": half_life_s} if half_life_s else {})}
    walls = [{"points_m": [[x - BEYOND_M, y + CORNER_M[1]], [x + CORNER_M[0] - CELL_M / 2, y + CORNER_M[1]]], "thickness_m": 0.01}
             for x, y in at]
    poses = np.concatenate([poses[..., :2] + at[:, None], poses[..., 2:]], axis=2).reshape(-1, 3)
    scenario = {
        "run": {"duration_s": 1e6, "step_s": road_ants.STEP_S},
        "map": {"width_m": MAPS_A_ROW * PITCH * CELL_M, "height_m": rows * PITCH * CELL_M, "cell_m": CELL_M, "wide": True},
        "antennas": {"bias_m": 0.6, "forward_m": 0.4},
        "pheromone": [trail],
        "obstacles": {"walls": walls},
        "robots": [road_ants.group(np.round(poses, 3))]}
    if not raster.any():
        return lab.World(scenario, drive="ants")
    with tempfile.TemporaryDirectory() as folder:
        file = str(pathlib.Path(folder) / "levels.npy")
        np.save(file, raster[::-1])
        scenario["print"] = [{"pheromone": "trail", "file": file, "maximum": round(float(raster.max()), 6)}]
        return lab.World(scenario, drive="ants")


def levels_of(world, maps):
    raster = np.nan_to_num(world.levels("trail")[::-1])
    return np.array([raster[row:row + NODES, column:column + NODES]
                     for column, row in np.rint(origins(maps) / CELL_M).astype(int)])


def left_to_go_m(at):
    """The shortest way to the goal around the wall's end; the wall is taken as a line."""
    below = at[..., 1] < CORNER_M[1]
    share = (CORNER_M[1] - at[..., 1]) / (GOAL_M[1] - np.minimum(at[..., 1], CORNER_M[1]))
    crosses = at[..., 0] + share * (GOAL_M[0] - at[..., 0]) < CORNER_M[0]
    around = np.hypot(*np.moveaxis(at - CORNER_M, -1, 0)) + np.hypot(*(GOAL_M - CORNER_M))
    return np.where(below & crosses, around, np.hypot(*np.moveaxis(GOAL_M - at, -1, 0)))


def steer(ants, weights):
    """The core's law, with the antennas weighted: the network of fig. 8, whose weights are +1 and -1."""
    p_left, p_right = (np.clip(np.rint(p * weight), -32767, 32767).astype(np.int16)
                       for p, weight in ((ants.p_left[0], weights[:, 0]), (ants.p_right[0], -weights[:, 1])))
    return lab.differential(p_left, p_right, road_ants.SPEED_M_S)


def roll_out(levels, poses, weights=FIXED, half_life_s=None):
    """How long each robot took, by map, in s: infinity, if it did not come; and its track. With a half-life robots set off
    after it has passed, and levels go on evaporating."""
    maps, robots = poses.shape[:2]
    world = world_of(levels, poses, half_life_s)
    ants = world.groups["ants"]
    for _ in range(round(half_life_s / road_ants.STEP_S) if half_life_s else 0):
        world.step(0, 0, sense=0)
    weights = np.repeat(np.broadcast_to(weights, (maps, 2)), robots, axis=0)
    at = np.repeat(origins(maps), robots, axis=0)
    time_s = np.full(len(at), np.inf)
    track = []
    for step in range(STEPS + 1):
        track.append(np.stack([ants.x_m, ants.y_m], axis=1) - at)
        there = (np.hypot(*(track[-1] - GOAL_M).T) < GOAL_RADIUS_M) & np.isinf(time_s)
        time_s[there] = step * road_ants.STEP_S
        drives = np.isinf(time_s) & ((track[-1] >= -CELL_M) & (track[-1] <= SIDE_M + CELL_M)).all(axis=1)
        left, right = steer(ants, weights)
        world.step(left * drives, right * drives, sense=drives.astype(np.uint8))
    return time_s.reshape(maps, robots), np.array(track).reshape(STEPS + 1, maps, robots, 2)


def costs(time_s, tracks):
    """Of each map: the mean time to the goal in s; robots that did not come are thought to drive on straight to it."""
    late = TIME_S + left_to_go_m(tracks[-1]) / road_ants.SPEED_M_S
    return np.where(np.isinf(time_s), late, time_s).mean(axis=1)


def learn(varied_weights):
    """A (mu/mu_w, lambda) evolution strategy (Hansen and Ostermeier 2001) without adaptation, with mirrored samples
    (Brockhoff et al. 2010), for all seeds at once. Yields robot-hours, levels and weights."""
    random = np.random.default_rng(1)
    levels = np.full((SEEDS, NODES, NODES), 0.5) * free_nodes()
    weights = np.tile(FIXED, (SEEDS, 1))
    portions = np.maximum(0, np.log(CANDIDATES / 2 + 0.5) - np.log(np.arange(1, CANDIDATES + 1)))
    hours = 0.0
    for generation in range(GENERATIONS):
        spread = SPREAD[0] * (SPREAD[1] / SPREAD[0]) ** (generation / GENERATIONS)
        steps = spread * random.normal(size=(SEEDS, CANDIDATES // 2, NODES * NODES + 2))
        steps = np.concatenate([steps, -steps], axis=1)
        of_levels = steps[..., 2:].reshape(SEEDS, CANDIDATES, NODES, NODES)
        of_weights = steps[..., :2] * varied_weights
        poses = np.repeat(starts(random, SEEDS, STARTS), CANDIDATES, axis=0)  # the same for all maps of a seed
        time_s, tracks = roll_out((np.clip(levels[:, None] + of_levels, 0, 1) * free_nodes()).reshape(-1, NODES, NODES),
                                  poses, (weights[:, None] + of_weights).reshape(-1, 2))
        hours += np.minimum(time_s, TIME_S).sum() / SEEDS / 3600
        rank = costs(time_s, tracks).reshape(SEEDS, CANDIDATES).argsort(axis=1, kind="stable").argsort(axis=1)
        chosen = (portions / portions.sum())[rank]
        levels = np.clip(levels + np.einsum("sm,smij->sij", chosen, of_levels), 0, 1) * free_nodes()
        weights = weights + np.einsum("sm,smi->si", chosen, of_weights)
        if generation + 1 in SHOWN:
            yield hours, levels, weights


class Ants:
    """What all ants remember, and what they decide: out by the network and some chance, home by their path."""

    def __init__(self, exponent, at):
        self.exponent, self.at = exponent, at
        self.state = np.full(len(at), OUT)
        self.path = np.zeros((len(at), NODES * NODES), int)  # its nodes, without loops
        self.last = np.full(len(at), -1)  # of its path: where it is
        self.face_rad = np.zeros(len(at))  # when it sets off
        self.quanta = np.zeros(len(at), int)

    def decide(self, ants):
        at = np.stack([ants.x_m, ants.y_m], axis=1) - self.at
        here = np.clip(np.rint(at / CELL_M).astype(int), 0, NODES - 1) @ (1, NODES)
        out = np.flatnonzero(self.state == OUT)
        moved = out[(self.last[out] < 0) | (self.path[out, self.last[out]] != here[out])]
        road_ants.extend(self.path, self.last, moved, here[moved])
        there = out[np.hypot(*(at[out] - GOAL_M).T) < GOAL_RADIUS_M]
        road_ants.extend(self.path, self.last, there, np.full(len(there), GOAL_NODE))
        self.quanta[there] = np.rint(QUANTA * (SHORTEST / np.maximum(self.last[there], 1)) ** self.exponent)
        self.state[there] = BACK
        passed = (self.state == BACK) & (np.hypot(*self.to_node(at).T) < 0.2)
        self.last[passed] -= 1
        # At home, or at a wall whose corner it would cut, which becomes its home: it looks anew, as robots start.
        home = (self.state == BACK) & ((self.last < 0) | (ants.contact == lab.WALL_CONTACT))
        self.state[home] = TURN
        self.face_rad[home] = np.pi * ants.uniform(0)[home]
        aside = road_ants.within_half_a_turn(self.face_rad - ants.heading_rad)
        ready = (self.state == TURN) & (np.abs(aside) < 0.1)
        self.state[ready], self.last[ready] = OUT, -1
        left, right = self.wheels(ants, at)
        return {"left": left, "right": right, "deposit": np.where(passed, self.quanta, 0),
                "sense": (self.state != BACK).astype(np.uint8)}

    def to_node(self, at):
        node = self.path[np.arange(len(at)), np.maximum(self.last, 0)]
        return np.stack([node % NODES, node // NODES], axis=1) * CELL_M - at

    def wheels(self, ants, at):
        strays = (self.state == OUT) & ((at < 0) | (at > SIDE_M)).any(axis=1)
        to = np.where(strays[:, None], SIDE_M / 2 - at, self.to_node(at))
        course = np.where(self.state == TURN, self.face_rad, np.arctan2(to[:, 1], to[:, 0]))
        on_course = road_ants.wheels(ants, course, self.state == TURN)
        wander = WANDER_M_S * (2 * ants.uniform(1) - 1)
        at_wall = ants.contact == lab.WALL_CONTACT
        by_map = [np.where(at_wall, turn, speed + sign * wander)
                  for turn, speed, sign in zip((-0.2, 0.2), steer(ants, FIXED[None]), (-1, 1))]
        return [np.where((self.state == OUT) & ~strays, one, other) for one, other in zip(by_map, on_course)]


def lay(exponent):
    """Yields robot-hours and the levels that ants have laid."""
    poses = starts(np.random.default_rng(2), SEEDS, ANTS)
    world = world_of(np.zeros((SEEDS, NODES, NODES)), poses, ANTS_HALF_LIFE_S)
    ants = Ants(exponent, np.repeat(origins(SEEDS), ANTS, axis=0))
    while world.time_s < TESTED_S[-1]:
        world.step(**ants.decide(world.groups["ants"]))
        if world.time_s in TESTED_S:
            yield ANTS * world.time_s / 3600, levels_of(world, SEEDS), np.tile(FIXED, (SEEDS, 1))


def drawn(kind):
    """Yields a map that nobody has learnt or laid."""
    x, y = np.meshgrid(*2 * [np.arange(NODES) * CELL_M])
    slope = 1 - left_to_go_m(np.stack([x, y], axis=-1)) / left_to_go_m(np.array((0, 0)))
    corners = np.array([(3, 1), CORNER_M + (0.75, -0.5), CORNER_M + (0.75, 0.5), GOAL_M])
    places = np.concatenate([np.linspace(*ends, 50) for ends in zip(corners, corners[1:])])
    near = np.hypot(x[..., None] - places[:, 0], y[..., None] - places[:, 1]).min(axis=-1) < 0.3
    levels = {"nothing": 0 * slope, "the path": 1.0 * near, "a slope": np.maximum(slope, 0),
              "chance": np.random.default_rng(3).uniform(size=(SEEDS, NODES, NODES))}[kind]
    yield 0.0, np.broadcast_to(levels * free_nodes(), (SEEDS, NODES, NODES)), np.tile(FIXED, (SEEDS, 1))


KINDS = {"levels learnt": lambda: learn(0.0), "levels and weights learnt": lambda: learn(1.0),
         "laid by ants": lambda: lay(0), "laid by ants, 1/length²": lambda: lay(2),
         "drawn: the path": lambda: drawn("the path"), "drawn: a slope": lambda: drawn("a slope"),
         "chance": lambda: drawn("chance"), "nothing": lambda: drawn("nothing")}


def run(kind):
    poses = starts(np.random.default_rng(4), SEEDS, FRESH)
    experience = []
    for hours, levels, weights in KINDS[kind]():
        time_s, tracks = roll_out(levels, poses, weights)
        mean, half = sweeps.interval(list(np.isfinite(time_s).mean(axis=1)))
        experience.append({"kind": kind, "robot_hours": hours, "share": mean, "half_interval": half})
    rows = []
    for half_life_s, times in ((0, time_s), (HALF_LIFE_S, roll_out(levels, poses, weights, HALF_LIFE_S)[0])):
        rows += [{"kind": kind, "map": number + 1, "half_life_s": half_life_s, "share": float(np.isfinite(of).mean()),
                  "time_s": float(of[np.isfinite(of)].mean()) if np.isfinite(of).any() else None,
                  "left_weight": float(weight[0]), "right_weight": float(weight[1])}
                 for number, (of, weight) in enumerate(zip(times, weights))]
    nodes = [{"kind": kind, "x_m": column * CELL_M, "y_m": row * CELL_M, "level": float(levels[0, row, column])}
             for row, column in np.argwhere(free_nodes())]
    lines = [{"kind": kind, "robot": robot + 1, "x_m": float(x), "y_m": float(y)}
             for robot in range(8) for x, y in tracks[:, 0, robot][:1 + int(min(time_s[0, robot], TIME_S) / road_ants.STEP_S):3]]
    return rows, experience, nodes, lines


if __name__ == "__main__":
    sweeps.main(__doc__, [(kind,) for kind in KINDS], run,
                ("synapses.csv", "synapses-experience.csv", "synapses-maps.csv", "synapses-tracks.csv"))
