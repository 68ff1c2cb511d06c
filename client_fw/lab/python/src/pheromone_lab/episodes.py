"""Episodes of a group that is driven from outside, a world for each: what environments (gym.py, zoo.py) share.

Each has a seed of its own: that of reset(seed=), or the next of a series that follows from the last one given, and
before from the scenario's run.seed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core, observations
from .world import Group, World


class Episodes:
    """Arguments as those of World, for the group that is driven; `most_quanta` limits a deposit."""

    def __init__(self, scenario: Any, group: str, settings: dict[str, Any] | None, threads: int,
                 most_quanta: int) -> None:
        self._scenario, self._name, self._settings, self._threads = scenario, group, settings or {}, threads
        self._most_quanta = most_quanta
        if "run.seed" in self._settings:
            raise _core.LabError(f'settings: found "run.seed" = {self._settings["run.seed"]!r}, but each episode has a '
                                 "seed of its own: give it to reset(seed=)")
        self.world = self._made({})
        self._random = np.random.default_rng(self.world.seed)
        self.columns = len(observations.columns(self.group))
        self.low, self.high = observations.limits(self.group, most_quanta)

    def _made(self, seeded: dict[str, Any]) -> World:
        return World(self._scenario, drive=self._name, settings={**self._settings, **seeded}, threads=self._threads)

    @property
    def group(self) -> Group:
        return self.world.groups[self._name]

    @property
    def is_over(self) -> bool:
        return bool(self.world.time_s >= self.world.duration_s)

    def begin(self, seed: int | None) -> observations.Floats:
        """A new world, and what is observed in it."""
        if seed is None:
            seed = int(self._random.integers(1 << 31))
        else:
            self._random = np.random.default_rng(seed)
        self.world = self._made({"run.seed": seed})
        return self.observe()

    def observe(self) -> observations.Floats:
        return observations.observe(self.world, self.group)

    def act(self, actions: Any) -> NDArray[np.float64]:
        return observations.act(self.world, self.group, actions, self._most_quanta)
