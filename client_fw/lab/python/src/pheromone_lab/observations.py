"""What the robots of a group see as one array, and what they do from one array: for environments
(episodes.py)."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _core
from .world import Group, World

Floats: TypeAlias = NDArray[np.float32]


def columns(group: Group) -> list[str]:
    """The names of the columns of `observe`."""
    pheromones = [f"{side} {name}" for name in group.senses for side in ("left", "right")]
    return [*pheromones, "x_m", "y_m", "heading_rad", "left_m_s", "right_m_s", "contact", "at_food", "at_nest",
            "load"]


def _at_sites(world: World, group: Group) -> tuple[Any, Any]:
    """For each robot whether it is at food, and whether at a nest."""
    food = np.concatenate(([False], world.sites["is_food"] == 1))
    nest = np.concatenate(([False], world.sites["is_food"] == 0))
    return food[group.site], nest[group.site]


def observe(world: World, group: Group) -> Floats:
    """A row for each robot; pheromones in units, the heading within half a turn."""
    at_food, at_nest = _at_sites(world, group)
    pheromones = [side[slot] / _core.UNIT for slot in range(len(group.senses))
                  for side in (group.p_left, group.p_right)]
    heading = np.remainder(group.heading_rad + np.pi, 2 * np.pi) - np.pi
    rows = np.stack([*pheromones, group.x_m, group.y_m, heading, group.left_m_s, group.right_m_s,
                     group.contact, at_food, at_nest, group.load > 0], axis=1)
    seen: Floats = rows.astype(np.float32)
    return seen


def act(world: World, group: Group, actions: Any, most_quanta: int) -> NDArray[np.float64]:
    """Makes a step of (left, right, deposit) for each robot, limited to what is possible, and returns 1 for
    each robot that delivered a load. Robots pick up at food and drop at a nest by themselves."""
    wanted = np.asarray(actions, dtype=np.float64)
    if wanted.shape != (len(group), 3):
        raise _core.LabError(f'group "{group.name}": actions: found shape {wanted.shape}, expected '
                             f"{(len(group), 3)}: left and right in m/s, and quanta")
    if not np.isfinite(wanted).all():
        robot = int(np.argwhere(~np.isfinite(wanted))[0][0])
        raise _core.LabError(f'robot {robot + 1} of group "{group.name}", step {world.steps}: actions: found '
                             f"{wanted[robot].tolist()}, expected finite numbers")
    at_food, at_nest = _at_sites(world, group)
    delivers = at_nest & (group.load > 0) & (group.failed == 0)
    speeds = np.clip(wanted[:, :2], -group.max_speed_m_s, group.max_speed_m_s)
    group.act(speeds[:, 0], speeds[:, 1], np.rint(np.clip(wanted[:, 2], 0, most_quanta)).astype(int),
              load=np.where(delivers, -1, at_food & (group.load == 0)))
    world.step()
    delivered: NDArray[np.float64] = delivers.astype(np.float64)
    return delivered


def limits(group: Group, most_quanta: int) -> tuple[Floats, Floats]:
    """The least and the largest action of a robot."""
    speed = group.max_speed_m_s
    return np.array([-speed, -speed, 0], np.float32), np.array([speed, speed, most_quanta], np.float32)
