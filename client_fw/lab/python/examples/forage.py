#!/usr/bin/env python3
"""Ants carry food to their nest and leave a trail on the way home: forage.py [QUANTA SEED]"""
import sys
import numpy as np
import pheromone_lab as lab

QUANTA, SEED = map(int, sys.argv[1:] or (1, 1))
world = lab.World({
    "run": {"duration_s": 600, "seed": SEED},
    "map": {"width_m": 20.0, "height_m": 20.0, "cell_m": 0.1},
    "antennas": {"bias_m": 0.33},
    "pheromone": [{"type": 1, "name": "trail", "core_m": 0.1, "sigma_m": 0.4, "evaporation": "exponential",
                   "half_life_s": 60.0, "quantum": 0.125, "maximum": 1.0, "directional": True}],
    "site": [{"name": "nest", "kind": "nest", "at_m": [10.0, 10.0], "radius_m": 1.0},
             {"name": "food", "kind": "food", "at_m": [16.0, 14.0], "radius_m": 1.0}],
    "robots": [{"name": "ants", "count": 100, "radius_m": 0.1}]}, drive="ants")
ants = world.groups["ants"]
course = ants.heading_rad.copy()
firm = np.zeros(len(ants))  # for so many steps they keep their course
while world.time_s < world.duration_s:
    nest, food = ants.site == 1, ants.site == 2
    load = np.where(nest & (ants.load > 0), -1, food & (ants.load == 0))
    loaded = (ants.load + load) > 0
    trail = ~loaded & (np.maximum(ants.p_left[0], ants.p_right[0]) > 0)
    home = np.arctan2(10 - ants.y_m, 10 - ants.x_m)
    inwards = trail & ~nest & (np.cos(ants.heading_rad - home) > 0.3)
    wander = course + 0.35 * (ants.uniform(0) - 0.5)
    back = ants.heading_rad + np.pi * (0.5 + ants.uniform(1))
    turns = (firm == 0) & ((ants.contact > 0) | inwards | (load != 0))
    course = np.select([firm > 0, load != 0, ants.contact > 0, inwards, loaded, trail],
                       [course, np.where(loaded, home, home + np.pi), back, home + np.pi, home,
                        ants.heading_rad], wander)
    firm = np.where(turns, 10, np.maximum(firm - 1, 0))
    aside = np.clip(np.remainder(course - ants.heading_rad + np.pi, 2 * np.pi) - np.pi, -1, 1)
    along = lab.differential(ants.p_left[0], ants.p_right[0], speed_m_s=0.2)
    follows = trail & (firm == 0)
    world.step(*(np.where(follows, side, 0.2 + turn * aside) for side, turn in zip(along, (-0.2, 0.2))),
               deposit=QUANTA * loaded, load=load)
print(f"{world.measures()['deliveries_per_robot_hour']:.2f} loads a robot and hour")
