"""Swarms of up to 100 000 robots on a map of pheromones, stepped from Python.

    import pheromone_lab

    world = pheromone_lab.World("ants.toml", drive=["ants"])
    ants = world.groups["ants"]
    while world.time_s < 600:
        left, right = pheromone_lab.differential(ants.p_left[0], ants.p_right[0], speed_m_s=0.2)
        world.step(left, right, deposit=1)
    print(world.measures()["deliveries"])

What robots sense and where they are is in NumPy arrays that are views of the world's own: they are of
the present step, cannot be written to, and live as long as anybody has one.
"""

from ._core import NO_CONTACT, ROBOT_CONTACT, UNIT, WALL_CONTACT, LabError, differential
from .scenario import to_toml
from .world import Group, Robots, World

LabError.__module__ = __name__  # where people find it
__all__ = ["NO_CONTACT", "ROBOT_CONTACT", "UNIT", "WALL_CONTACT", "Group", "LabError", "Robots", "World",
           "differential", "to_toml"]
