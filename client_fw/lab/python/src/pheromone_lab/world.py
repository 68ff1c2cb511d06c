"""Worlds, and the groups of robots in them."""

from __future__ import annotations

import os
import pathlib
import warnings
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypeAlias, Union

from . import _core
from .scenario import to_toml, value_to_toml

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    Doubles: TypeAlias = "NDArray[np.float64]"
    Bytes: TypeAlias = "NDArray[np.uint8]"

#: What a behaviour returns: left, right and perhaps deposit, or the arguments of Group.act by name.
Actions: TypeAlias = Union["tuple[ArrayLike, ...]", "Mapping[str, Any]", None]
Behaviour: TypeAlias = Callable[["Group"], Actions]


class Robots:
    """Views of robots that follow each other, an element a robot. They cannot be written to.

    x_m, y_m, heading_rad   where they believe to be (radians counter-clockwise from +x)
    p_left, p_right         a tuple of arrays, one for each pheromone that the group senses: what the
                            antennas sense, in 1/4096 (UNIT) of a pheromone unit, as robots receive it
    on_map                  0: not answered yet, or that its pose is off the map
    contact                 what its last move met: NO_CONTACT, ROBOT_CONTACT or WALL_CONTACT
    site                    where it is: 1 is World.sites[0]; 0: at no site
    load                    what it carries: 1: a load of World.sites[0]; 0: nothing
    left_m_s, right_m_s     the present speeds of its wheels
    failed                  1: it stands, whatever it is told

    and what no robot knows:

    true_x_m, true_y_m, true_heading_rad, way_m (driven since the start)
    """

    x_m: Doubles
    y_m: Doubles
    heading_rad: Doubles
    p_left: tuple[NDArray[np.int16], ...]
    p_right: tuple[NDArray[np.int16], ...]
    on_map: Bytes
    contact: Bytes
    site: Bytes
    load: Bytes
    left_m_s: Doubles
    right_m_s: Doubles
    failed: Bytes
    true_x_m: Doubles
    true_y_m: Doubles
    true_heading_rad: Doubles
    way_m: Doubles

    def __init__(self, core: _core.Simulation, first: int, count: int) -> None:
        self._core = core
        self.first = first
        self.count = count
        vars(self).update(core.arrays(first, count))

    def __len__(self) -> int:
        return self.count

    def uniform(self, use: int) -> Doubles:
        """Chance for each of them, from 0 up to 1: a hash of seed, robot, step and `use`, the same as a
        compiled behaviour draws. So a run can be repeated."""
        return self._core.uniform(self.first, self.count, use)


class Group(Robots):
    """The robots of one [[robots]] of the scenario, by `name`."""

    def __init__(self, core: _core.Simulation, number: int, facts: dict[str, Any]) -> None:
        super().__init__(core, facts["first"], facts["count"])
        self._number = number
        self._types = core.types()
        self.name: str = facts["name"]
        self.driven: bool = facts["driven"]
        self.radius_m: float = facts["radius_m"]
        self.wheelbase_m: float = facts["wheelbase_m"]
        self.max_speed_m_s: float = facts["max_speed_m_s"]
        names = {number: name for name, number in self._types.items()}
        self.senses = tuple(names[it] for it in facts["senses"])
        self.p_left = self.p_left[:len(self.senses)]
        self.p_right = self.p_right[:len(self.senses)]

    def sensed(self, pheromone: str) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
        """(left, right) of a pheromone by name."""
        if pheromone not in self.senses:
            raise _core.LabError(f'group "{self.name}" senses {self.senses}, not "{pheromone}"')
        slot = self.senses.index(pheromone)
        return self.p_left[slot], self.p_right[slot]

    def act(self, left: ArrayLike | None = None, right: ArrayLike | None = None,
            deposit: ArrayLike | None = None, *, pheromone: str | ArrayLike | None = None,
            load: ArrayLike | None = None, sense: ArrayLike | None = None) -> None:
        """What they do in the next World.step: a number for all of them, or an array.

        left, right  speeds of the wheels in m/s, at most max_speed_m_s forwards or backwards
        deposit      so many quanta where the robot believes to be, 0 to 65 535
        pheromone    of this kind: a name, or numbers of types (World.types). As configured if not given
        load         1: pick up a load, at food; -1: drop it, at a nest to deliver it; 0
        sense        bits of what is sensed in the next step: bit 0 is senses[0]

        What is not given: they stand, deposit nothing, keep the load, sense everything. Raises LabError,
        which names group or robot, step and field; then no action is set.
        """
        if isinstance(pheromone, str):
            if pheromone not in self._types:
                raise _core.LabError(f'group "{self.name}": pheromone: found "{pheromone}", expected one of '
                                     + ", ".join(map(repr, self._types)))
            pheromone = self._types[pheromone]
        self._core.set_actions(self._number, left, right, deposit, pheromone, load, sense)

    def __repr__(self) -> str:
        return f"<Group {self.name}: {self.count} robots>"


class World:
    """A world that is stepped from Python.

    scenario  the path of a file as pheromone-swarm lab has them, or the same as a dict (scenario.to_toml)
    drive     the groups that Python decides for: names, or names with a function each, which is called
              with the Group before each step and returns (left, right), (left, right, deposit), or the
              arguments of Group.act as a dict. The others behave as the scenario says
    settings  values in place of the scenario's, by key, as --set of pheromone-swarm lab run:
              {"run.seed": 3, "robots[1].count": 200}
    threads   of no influence on what happens

    Between two steps everything is of the present time: what robots sense, where they are, the map. One
    thread at a time. Raises LabError.
    """

    def __init__(self, scenario: str | os.PathLike[str] | Mapping[str, Any], *,
                 drive: str | Iterable[str] | Mapping[str, Behaviour] = (),
                 settings: Mapping[str, Any] | None = None, threads: int = 1) -> None:
        if isinstance(scenario, Mapping):
            text, name, folder = to_toml({"run": {}, **scenario}), "scenario", os.getcwd()
        else:
            path = pathlib.Path(scenario)
            text, name, folder = path.read_text(encoding="utf-8"), str(path), str(path.parent or ".")
        names = [drive] if isinstance(drive, str) else list(drive)
        self._behaviours = dict(drive) if isinstance(drive, Mapping) else {}
        set_to = [(key, value_to_toml(value)) for key, value in (settings or {}).items()]
        self._core = core = _core.Simulation(text, name, folder, set_to, names, threads)
        for warning in core.warnings():
            warnings.warn(warning, stacklevel=2)
        groups = [Group(core, number, facts) for number, facts in enumerate(core.groups())]
        self.groups: dict[str, Group] = {it.name: it for it in groups}
        self.robots = Robots(core, 0, sum(it.count for it in groups))
        self.sites: NDArray[Any] = core.sites()
        self.site_names: list[str] = core.site_names()
        self.types: dict[str, int] = core.types()
        #: (left, right, bottom, top) of `levels`, for matplotlib's imshow(levels, extent=...).
        self.extent: tuple[float, float, float, float] = core.extent()
        self.step_s: float = core.step_ms / 1000
        self.duration_s: float = core.duration_ms / 1000
        #: The scenario's run.seed.
        self.seed: int = core.seed
        self._driven = [it for it in groups if it.driven]

    @property
    def steps(self) -> int:
        """That have been made."""
        return self._core.steps

    @property
    def time_s(self) -> float:
        return self._core.steps * self._core.step_ms / 1000

    def step(self, left: ArrayLike | None = None, right: ArrayLike | None = None,
             deposit: ArrayLike | None = None, **more: Any) -> None:
        """One step: robots act and move, then they sense. The arguments are those of Group.act, for the
        group that Python drives; if there are several, call act of each of them before."""
        more.update((key, value) for key, value in (("left", left), ("right", right), ("deposit", deposit))
                    if value is not None)
        if more:
            waiting = [it for it in self._driven if it.name not in self._behaviours]
            if len(waiting) != 1:
                raise _core.LabError(f"step: found actions, but {len(waiting)} groups wait for them: "
                                     "expected one, in drive and without a function. Group.act is for one group")
            waiting[0].act(**more)
        for name, behaviour in self._behaviours.items():
            self._decide(self.groups[name], behaviour)
        self._core.step()

    def run(self, steps: int | None = None) -> None:
        """So many steps; without a number, to the end of the scenario (duration_s)."""
        end = self.steps + steps if steps is not None else -(-self._core.duration_ms // self._core.step_ms)
        while self.steps < end:
            self.step()

    def _decide(self, group: Group, behaviour: Behaviour) -> None:
        where = f'behaviour of group "{group.name}", step {self.steps}'
        try:
            actions = behaviour(group)
        except Exception as error:
            raise _core.LabError(f"{where}: {type(error).__name__}: {error}") from error
        if isinstance(actions, tuple) and len(actions) in (2, 3):
            group.act(*actions)
        elif isinstance(actions, Mapping):
            try:
                group.act(**actions)
            except TypeError as error:
                raise _core.LabError(f"{where}: {error}") from error
        elif actions is not None:
            raise _core.LabError(f"{where}: found {actions!r:.60}, expected (left, right), (left, right, deposit), "
                                 "a dict of Group.act's arguments, or None")

    def levels(self, pheromone: str) -> Doubles:
        """The map of a pheromone in its units, a copy: the top row first; NaN where an obstacle is."""
        if pheromone not in self.types:
            raise _core.LabError(f'levels: found "{pheromone}", expected one of '
                                 + ", ".join(map(repr, self.types)))
        return self._core.levels(self.types[pheromone])

    def measures(self) -> dict[str, float]:
        """What was measured since the start, by the names that pheromone-swarm lab has."""
        return self._core.measures()

    def result(self) -> dict[str, Any] | None:
        """The measures, and the hash of the world, when duration_s had passed, as pheromone-swarm lab run
        tells them; None before."""
        return self._core.result()

    def hash(self) -> int:
        """Of robots, map and sites: equal worlds have the same."""
        return self._core.hash()

    def _site(self, site: int | str) -> int:
        if isinstance(site, int):
            return site
        if site not in self.site_names:
            raise _core.LabError(f'site: found "{site}", expected one of {self.site_names}')
        return self.site_names.index(site)

    def move_site(self, site: int | str, x_m: float, y_m: float) -> None:
        """From the next step on. A site by its name or its number in `sites`."""
        self._core.move_site(self._site(site), x_m, y_m)

    def set_amount(self, site: int | str, amount: float) -> None:
        """The loads that are left at food."""
        self._core.set_amount(self._site(site), amount)

    def fail(self, robot: int) -> None:
        """From now on it stands where it is. Its number is that in `robots`."""
        self._core.fail(robot)

    def route(self, start: tuple[float, float], goal: tuple[float, float], clearance_m: float = 0.0) -> Doubles:
        """The shortest way around the present obstacles, a row (x_m, y_m) for each corner, start and goal
        included: the A* of path_efficiency, which keeps the largest robot's radius clear and counts from rim to
        rim. It keeps clearance_m from obstacles where it can. Raises LabError if there is no way."""
        return self._core.route(start, goal, clearance_m)
