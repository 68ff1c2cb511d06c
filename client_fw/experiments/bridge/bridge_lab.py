#!/usr/bin/env python3
"""The double bridge in the lab, at level "field": the swarms of `pheromone-experiments bridge` without frames and the
firmware's conversation. Writes results/bridge-lab.csv, bridge-lab-runs.csv and bridge-lab-share.csv, which figure.py
draws beside those of the command.

    bridge_lab.py [--processes N] [--out FOLDER]

A case is one world: all swarms' bridges side by side, out of each other's reach, so that NumPy decides for all robots at
once. The lab knows no corridors. So the wandering of the wheels and the corridors, which are those of arena.h, are worked
out here in steps of 10 ms; and within each period of 200 ms the lab's wheels bring every robot to the pose that results.
"""

import math
import pathlib
import sys

import numpy as np
import pheromone_lab as lab

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

import road_ants  # noqa: E402  (after the path)
import sweeps  # noqa: E402

ROBOTS = 8  # of a swarm
DURATION_S = 1200
PERIOD_S, TURN_S, RELEASE_S = 0.2, 2.0, 5.0
STEP_S = 0.01  # of corridors and wandering
STEPS = round(PERIOD_S / STEP_S)
SPEED_M_S = 0.3
WANDER_RAD_S, WANDER_MEMORY_S = 0.25, 0.5
TAU_S, QUANTA = 20, 32  # QUANTA fill a node
DECIDED = 0.8  # of the choices in the last quarter

# The bridge, as BridgeShape has it, and its tile of the map.
NEST_X_M, AXIS_Y_M, STEM_M, SPAN_M = 1.0, 3.4, 1.0, 3.0
APPROACH_M, FREE_M, GUIDED_M = 0.4, 0.14, 0.03  # before a fork; half the widths of corridors
ENTRY_M, NARROWED_M, BEND_M = 0.9, 0.6, 0.3  # straight behind a fork; where a branch is narrow; radius of bends
FORK_RAD, MOST_TURN_RAD = math.pi / 4, math.radians(80)
WEDGE_M = FREE_M / math.sin(FORK_RAD)
TILE_M = (7.0, 5.0)
TILES_A_ROW = 14

# How the lab's wheels bring a robot to a pose: moves of MOVE_S each, within a period.
MOVES, WHEELBASE_M, MOST_M_S = 4, 0.33, 10.0
MOVE_S = PERIOD_S / MOVES

# Corridors. Each has two lanes: 2 * corridor leads to the food, the next one to the nest.
NEST_STEM, SHORT, LONG, FOOD_STEM = range(4)
LANES = np.arange(8)
TO_FOOD = LANES % 2 == 0
BEFORE_FORK = np.isin(LANES, (2 * NEST_STEM, 2 * FOOD_STEM + 1))
ON_SHORT, ON_LONG = LANES // 2 == SHORT, LANES // 2 == LONG
ON_BRANCH = ON_SHORT | ON_LONG


def draw(x, y, heading, *strokes):
    """Points of turtle graphics: a stroke is a length, or a turn in BEND_M."""
    points = [(x, y)]
    for forward, turn in strokes:
        if turn == 0:
            x, y = x + forward * math.cos(heading), y + forward * math.sin(heading)
            points.append((x, y))
        else:
            radius = math.copysign(BEND_M, turn)
            for ahead in heading + turn * np.arange(1, 13) / 12:
                points.append((x + radius * (math.sin(ahead) - math.sin(heading)),
                               y - radius * (math.cos(ahead) - math.cos(heading))))
            (x, y), heading = points[-1], heading + turn
    points = np.array(points)
    return points[np.append(True, np.hypot(*np.diff(points, axis=0).T) > 1e-9)]


def length_of(points):
    return np.hypot(*np.diff(points, axis=0).T).sum()


def corridors(ratio):
    """The centre lines, from the nest to the food; the long branch has `ratio` times the length of the short one."""
    fork = NEST_X_M + STEM_M

    def branch(angle, *middle):
        return draw(fork, AXIS_Y_M, angle, (ENTRY_M, 0), *middle, (ENTRY_M, 0))

    def arch(angle):
        slope = draw(0, 0, angle, (ENTRY_M, 0), (0, -angle))[-1, 0]
        return branch(angle, (0, -angle), (SPAN_M - 2 * slope, 0), (0, -angle))

    def trough(leg, across):
        down, up = FORK_RAD - math.pi / 2, math.pi / 2
        return branch(-FORK_RAD, (0, down), (leg, 0), (0, up), (across, 0), (0, up), (leg, 0), (0, down))

    short = arch(FORK_RAD)
    if ratio == 1:
        long = arch(-FORK_RAD)
    else:
        bare = trough(0, 0)
        across = SPAN_M - (bare[-1, 0] - fork)
        long = trough((ratio * length_of(short) - length_of(bare) - across) / 2, across)
    far = fork + SPAN_M
    return [np.array([(NEST_X_M, AXIS_Y_M), (fork, AXIS_Y_M)]), short, long,
            np.array([(far, AXIS_Y_M), (far + STEM_M, AXIS_Y_M)])]


class Lanes:
    """Directed centre lines of the eight lanes, in straight pieces; `row` of a piece in the arrays is the lane's `first`
    and the number of the piece."""

    def __init__(self, ratio):
        points = [line[::way] for line in corridors(ratio) for way in (1, -1)]
        pieces = [np.diff(line, axis=0) for line in points]
        self.first = np.cumsum([0] + [len(it) for it in pieces])[:-1]
        self.x_m, self.y_m = np.concatenate([line[:-1] for line in points]).T
        along = [np.cumsum(np.append(0, np.hypot(*it.T))) for it in pieces]
        self.along_m = np.concatenate([it[:-1] for it in along])
        self.end_m = np.concatenate([np.append(it[1:-1], np.inf) for it in along])
        self.length_m = np.array([it[-1] for it in along])
        self.heading = np.concatenate([np.arctan2(it[:, 1], it[:, 0]) for it in pieces])
        self.cos, self.sin = np.cos(self.heading), np.sin(self.heading)

    def locate(self, x_m, y_m, row):
        """Rows from `row` on, and how far along and left of the lanes the points are."""
        while True:
            dx, dy, cos, sin = x_m - self.x_m[row], y_m - self.y_m[row], self.cos[row], self.sin[row]
            along_m = self.along_m[row] + dx * cos + dy * sin
            further = along_m > self.end_m[row]
            if not further.any():
                return row, along_m, dy * cos - dx * sin
            row = row + further


class Swarms:
    """Where the robots are in their corridors, each in the coordinates of its tile, and what they have chosen."""

    def __init__(self, robots, ratio=2):
        self.lanes = Lanes(ratio)
        self.lane = np.zeros(robots, int)
        self.row = self.lanes.first[self.lane]
        self.x_m, self.y_m = self.lanes.x_m[self.row], self.lanes.y_m[self.row]
        self.heading = np.zeros(robots)
        self.wander_rad_s = np.zeros(robots)
        self.standing = np.zeros(robots, int)  # steps that are left at an end
        self.steps_on = np.zeros((2, robots), int)  # the short and the long branch
        self.choices = []  # (robots, whether each took the short branch)

    def advance(self, left_m_s, right_m_s, released, uniform):
        """A step: wheels roll and wander, corridors guide. `uniform`: chance of each robot, from 0 to 1."""
        standing = self.standing > 0
        go = released & ~standing
        kept = math.exp(-STEP_S / WANDER_MEMORY_S)
        wandered = kept * self.wander_rad_s + WANDER_RAD_S * math.sqrt(3 * (1 - kept * kept)) * (2 * uniform - 1)
        self.wander_rad_s = np.where(go, wandered, self.wander_rad_s)
        way_m = go * (left_m_s + right_m_s) * (STEP_S / 2)
        turn = go * ((right_m_s - left_m_s) / WHEELBASE_M + self.wander_rad_s) * STEP_S
        self.x_m = self.x_m + way_m * np.cos(self.heading + turn / 2)
        self.y_m = self.y_m + way_m * np.sin(self.heading + turn / 2)
        self.heading = self.heading + turn
        self.hold(go)
        self.standing -= standing
        self.turn_round(np.flatnonzero(standing & (self.standing == 0)))
        self.steps_on += ON_SHORT[self.lane], ON_LONG[self.lane]

    def hold(self, go):
        """Within the walls, as BridgeGuide::Hold; those that `go` may come to the next lane."""
        lanes, lane = self.lanes, self.lane
        self.row, along_m, left_m = lanes.locate(self.x_m, self.y_m, self.row)
        beyond_m = along_m - lanes.length_m[lane]
        before, on_branch, left = BEFORE_FORK[lane], ON_BRANCH[lane], left_m >= 0
        forking = before & (beyond_m > 0)  # there the walls spread with the branches
        room_m = np.where(before & (beyond_m >= -APPROACH_M), FREE_M, GUIDED_M) + forking * beyond_m * math.tan(FORK_RAD)
        narrowing = np.interp(along_m, (WEDGE_M, NARROWED_M), (FREE_M, GUIDED_M))
        room_m = np.where(on_branch, narrowing, room_m)
        ahead = lanes.heading[self.row]
        turn = np.clip(road_ants.within_half_a_turn(self.heading - ahead), -MOST_TURN_RAD, MOST_TURN_RAD)
        excess_m = np.maximum(0, np.abs(left_m) - room_m) * np.where(left, 1, -1)
        self.x_m = self.x_m + excess_m * lanes.sin[self.row]
        self.y_m = self.y_m - excess_m * lanes.cos[self.row]
        spread = forking * FORK_RAD
        turn = np.where(excess_m > 0, np.minimum(turn, spread), np.where(excess_m < 0, np.maximum(turn, -spread), turn))
        self.heading = ahead + turn
        past = go & (beyond_m >= 0)
        if past.any():
            to_food = TO_FOOD[lane]
            self.choose(np.flatnonzero(past & before & (beyond_m >= WEDGE_M)), left)
            crossed = np.flatnonzero(past & on_branch)
            self.enter(crossed, np.where(to_food[crossed], 2 * FOOD_STEM, 2 * NEST_STEM + 1))
            self.standing[past & ~before & ~on_branch] = round(TURN_S / STEP_S)

    def choose(self, robots, left):
        """They have passed the wedge; the short branch is on the left on the way to the food."""
        if len(robots):
            short = left[robots] == TO_FOOD[self.lane[robots]]
            self.choices.append((robots, short))
            self.enter(robots, 2 * np.where(short, SHORT, LONG) + self.lane[robots] % 2)

    def enter(self, robots, lanes):
        self.lane[robots] = lanes
        self.row[robots] = self.lanes.first[lanes]

    def turn_round(self, robots):
        self.enter(robots, self.lane[robots] ^ 1)
        row = self.row[robots]
        self.x_m[robots], self.y_m[robots] = self.lanes.x_m[row], self.lanes.y_m[row]
        self.heading[robots] = self.lanes.heading[row]


def move(number, robots, x_m, y_m, heading):
    """Speeds of the wheels for the moves to a pose: a turn towards its place, the way there, and the turn to its heading,
    which takes two. The lab rounds speeds to 20 mm/s, which is at most half a millimetre of a wheel's way."""
    dx, dy = x_m - robots.true_x_m, y_m - robots.true_y_m
    if number == 1:
        way_m, turn = dx * np.cos(robots.true_heading_rad) + dy * np.sin(robots.true_heading_rad), 0
    else:
        course = np.where((number == 0) & (np.hypot(dx, dy) > 0.001), np.arctan2(dy, dx), heading)
        way_m, turn = 0, road_ants.within_half_a_turn(course - robots.true_heading_rad)
        if number == 0:  # it may drive there backwards
            turn = np.where(np.abs(turn) > math.pi / 2, turn - np.copysign(math.pi, turn), turn)
    return tuple(np.clip((way_m + side * turn * WHEELBASE_M / 2) / MOVE_S, -MOST_M_S, MOST_M_S) for side in (-1, 1))


def scenario(seed, swarms, duration_s, tau_s):
    tiles = np.arange(swarms)
    starts = np.stack([tiles % TILES_A_ROW, tiles // TILES_A_ROW], axis=1) * TILE_M + (NEST_X_M, AXIS_Y_M)
    return {
        "run": {"duration_s": duration_s, "step_s": MOVE_S, "seed": seed},
        "map": {"width_m": TILE_M[0] * TILES_A_ROW, "height_m": TILE_M[1] * -(-swarms // TILES_A_ROW), "cell_m": 0.1,
                "wide": True},
        "antennas": {"bias_m": 0.33},
        "pheromone": [{"type": 1, "name": "trail", "core_m": 0.1, "sigma_m": 0.4, "evaporation": "counter",
                       "tau_s": tau_s, "quantum": 1 / QUANTA, "maximum": 1.0, "directional": True}],
        "robots": [{"name": "robots", "radius_m": 0.0, "acceleration_m_per_s2": 0.0, "max_speed_m_per_s": MOST_M_S,
                    "wheelbase_m": WHEELBASE_M, "starts": [[x, y, 0.0] for x, y in starts for _ in range(ROBOTS)]}]}


def simulate(seed, swarms, duration_s=DURATION_S, quanta=1, ratio=2, tau_s=TAU_S, on_sensed=lambda world, where: None):
    """So many swarms: returns the world, their Swarms, and an array of choices: rows of time in ms, number of the swarm,
    and 1 for the short branch. Each robot deposits `quanta` a period from its release on. `on_sensed` gets world and
    Swarms when the robots have sensed."""
    world = lab.World(scenario(seed, swarms, duration_s, tau_s), drive="robots")
    robots = world.groups["robots"]
    where = Swarms(len(robots), ratio)
    tile = np.array([robots.true_x_m - where.x_m, robots.true_y_m - where.y_m])
    release = np.rint(robots.uniform(STEPS) * RELEASE_S / PERIOD_S)
    chosen = [np.zeros((0, 3), int)]
    for period in range(round(duration_s / PERIOD_S)):
        on_sensed(world, where)
        wheels = lab.differential(robots.p_left[0], robots.p_right[0], speed_m_s=SPEED_M_S)
        released = release <= period
        for step in range(STEPS):
            where.advance(*wheels, released, robots.uniform(step))
            for who, short in where.choices:
                at_ms = round(1000 * (period * PERIOD_S + (step + 1) * STEP_S))
                chosen.append(np.stack([np.full(len(who), at_ms), who // ROBOTS, short], axis=1))
            where.choices.clear()
        for number in range(MOVES):
            left, right = move(number, robots, *(tile + (where.x_m, where.y_m)), where.heading)
            world.step(left, right, deposit=released * quanta if number == 0 else 0, sense=int(number == MOVES - 1))
    return world, where, np.concatenate(chosen)


def outcome_of(share):
    return "short" if share >= DECIDED else "long" if 1 - share >= DECIDED else "undecided"


def runs_of(where, choices, duration_s):
    """A row for each swarm."""
    at_ms, swarm, short = choices.T
    on_short, on_long = where.steps_on.reshape(2, -1, ROBOTS).sum(axis=2)
    rows = []
    for number in range(len(on_short)):
        late = short[(swarm == number) & (at_ms >= 750 * duration_s)]
        share = float(late.mean()) if len(late) else 0.5
        rows.append({"swarm": number + 1, "choices": int((swarm == number).sum()), "final_share": share,
                     "outcome": outcome_of(share),
                     "presence": float(on_short[number] / max(1, on_short[number] + on_long[number]))})
    return rows


def minutes_of(choices, duration_s):
    """A row for each minute: the share of the short branch, over the swarms that chose."""
    rows = []
    for minute in range(duration_s // 60):
        of = choices[choices[:, 0] // 60_000 == minute]
        every, short = np.bincount(of[:, 1]), np.bincount(of[:, 1], of[:, 2])
        shares = short[every > 0] / every[every > 0]
        rows.append({"minute": minute, "share": float(shares.mean()), "deviation": float(shares.std(ddof=1))})
    return rows


def summary(runs, state_hash):
    ended = [row["outcome"] for row in runs]
    short, long = ended.count("short"), ended.count("long")
    shares = np.array([row["final_share"] for row in runs])
    means = {key: float(np.mean([row[key] for row in runs])) for key in ("presence", "choices")}
    least, most = sweeps.wilson(short, len(runs))
    # Of those that decided; nothing if none did.
    decided = (short / (short + long), *sweeps.wilson(short, short + long)) if short + long else (None,) * 3
    return {"robots": ROBOTS, "level": "field", "runs": len(runs), "short": short, "long": long,
            "undecided": len(runs) - short - long, "p_short": short / len(runs), "p_short_least": least,
            "p_short_most": most, "of_decided": decided[0], "of_decided_least": decided[1], "of_decided_most": decided[2],
            "final_share": float(shares.mean()), "final_share_deviation": float(shares.std(ddof=1)), **means,
            "state_hash": f"{state_hash:016x}"}


def run(name, seed, swarms, quanta, ratio):
    world, where, choices = simulate(seed, swarms, quanta=quanta, ratio=ratio)
    runs = runs_of(where, choices, DURATION_S)
    return [[{"experiment": name, **row} for row in rows]
            for rows in ([summary(runs, world.hash())], runs, minutes_of(choices, DURATION_S))]


CASES = [("base", 1, 200, 1, 2), ("no pheromone", 2, 200, 0, 2), ("equal branches", 3, 200, 1, 1),
         ("base, 800 more", 4, 800, 1, 2)]

if __name__ == "__main__":
    sweeps.main(__doc__, CASES, run, ("bridge-lab.csv", "bridge-lab-runs.csv", "bridge-lab-share.csv"))
