"""Ants on roads, for experiments in Python: robots that stand, look along the roads that leave the place where they are,
choose one by what they sense of a trail, and drive to its end. All robots of a group at once, as arrays; a road has a
direction, from 0 up.

    looks = road_ants.Looks(len(ants), directions)
    course = looks.turn(ants, headings, standing, open_roads)   # whoever stands turns from road to road
    ready = looks.done(standing, open_roads)
    road = looks.choose(ants.uniform(0), ready, open_roads)
    left, right = road_ants.wheels(ants, course, standing)

A scenario for them lets robots sense what is ahead (`antennas`), and gives their wheels no limit of acceleration.
"""

import numpy as np
import pheromone_lab as lab

SPEED_M_S, TURN_M_S = 0.3, 0.2
LEAST = 0.2  # k of the choice (k + P)^2 of Deneubourg et al. 1990, in pheromone units
STEP_S = 0.5
ANTENNAS = {"bias_m": 0.3, "forward_m": 0.8}


def trail(half_life_s):
    """Narrow enough to tell roads apart that are 30 degrees from each other; 4000 quanta fill a node."""
    return {"type": 1, "name": "trail", "core_m": 0.1, "sigma_m": 0.2, "evaporation": "exponential",
            "half_life_s": half_life_s, "quantum": 0.001, "maximum": 4.0, "directional": True}


def group(starts):
    """Points that meet walls, but not each other."""
    return {"name": "ants", "radius_m": 0.0, "acceleration_m_per_s2": 0.0, "starts": starts}


def within_half_a_turn(angle):
    return angle - 2 * np.pi * np.rint(angle / (2 * np.pi))


def wheels(ants, course, standing):
    """Speeds (left, right) towards a course; on the spot if standing, or if it is far aside."""
    aside = within_half_a_turn(course - ants.heading_rad)
    turn = np.clip(aside * ants.wheelbase_m / (2 * STEP_S), -TURN_M_S, TURN_M_S)
    ahead = np.where(standing | (np.abs(aside) > 0.5), 0, SPEED_M_S - np.abs(turn))
    return ahead - turn, ahead + turn


def extend(path, last, robots, cells):
    """These robots are in these cells now: each of their paths, rows of `path` up to its index `last`, goes there, without
    the loop that it may have made."""
    loop = (path[robots] == cells[:, None]) & (np.arange(path.shape[1]) <= last[robots, None])
    last[robots] = np.where(loop.any(axis=1), loop.argmax(axis=1), last[robots] + 1)
    path[robots, last[robots]] = cells


class Looks:
    """What robots have seen of the roads of the place where they are, in pheromone units; NaN: not yet."""

    def __init__(self, robots, directions):
        self.seen = np.full((robots, directions), np.nan)

    def turn(self, ants, headings, standing, is_open):
        """Notes what is seen, and returns courses: the nearest road that has not been looked along. `headings` of each
        road; `is_open` of each road, or of each robot and road."""
        stand = np.flatnonzero(standing)
        roads = np.broadcast_to(is_open, self.seen.shape)[stand]
        aside = np.abs(within_half_a_turn(headings - ants.heading_rad[stand, None]))
        seen = self.seen[stand]
        rows, now = np.nonzero(roads & (aside < 0.05) & np.isnan(seen))
        robots = stand[rows]
        seen[rows, now] = (ants.p_left[0][robots] + ants.p_right[0][robots]) / lab.UNIT
        self.seen[robots, now] = seen[rows, now]
        course = np.zeros(len(standing))
        course[stand] = headings[np.where(roads & np.isnan(seen), aside, np.inf).argmin(axis=1)]
        return course

    def done(self, standing, is_open):
        """Which robots have looked along all roads, by number; of a single one there is no need."""
        stand = np.flatnonzero(standing)
        roads = np.broadcast_to(is_open, self.seen.shape)[stand]
        waits = (roads & np.isnan(self.seen[stand])).any(axis=1) & (roads.sum(axis=1) > 1)
        return stand[~waits]

    def choose(self, uniform, ready, is_open):
        """A road for each robot of `ready`, with a probability in proportion to (k + P)^2; then they may look anew.
        `uniform`: of all robots, from 0 to 1."""
        seen = np.nan_to_num(self.seen[ready])
        weights = np.where(np.broadcast_to(is_open, self.seen.shape)[ready], (LEAST + seen) ** 2, 0)
        sums = np.cumsum(weights, axis=1)
        road = (uniform[ready, None] * sums[:, -1:] >= sums).sum(axis=1)
        self.seen[ready] = np.nan
        return road
