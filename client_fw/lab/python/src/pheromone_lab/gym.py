"""A group of robots as one environment of Gymnasium.

    env = SwarmEnv("ants.toml", "ants")
    observation, info = env.reset(seed=3)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

An observation has a row for each robot (observations.columns names what is in it), an action a row of left
and right speed in m/s and quanta to deposit. The reward is the number of loads that were delivered in the
step. It is truncated at the end of the scenario (duration_s).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from . import observations
from .world import World

try:
    import gymnasium
except ImportError as error:
    raise ImportError("pheromone_lab.gym needs Gymnasium, which Debian 12 does not have: "
                      "pip install gymnasium") from error


class SwarmEnv(gymnasium.Env):  # type: ignore[misc]
    """Arguments as those of World, for the group that is driven; `most_quanta` limits a deposit."""

    def __init__(self, scenario: Any, group: str, *, settings: dict[str, Any] | None = None, threads: int = 1,
                 most_quanta: int = 8) -> None:
        self._scenario, self._settings, self._threads = scenario, settings or {}, threads
        self._name = group
        self._most_quanta = most_quanta
        self.world = self._made(None)
        robots = self.world.groups[group]
        rows = len(robots)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (rows, len(observations.columns(robots))))
        low, high = observations.limits(robots, most_quanta)
        self.action_space = gymnasium.spaces.Box(np.tile(low, (rows, 1)), np.tile(high, (rows, 1)))

    def _made(self, seed: int | None) -> World:
        seeded = {} if seed is None else {"run.seed": seed}
        return World(self._scenario, drive=self._name, settings={**self._settings, **seeded}, threads=self._threads)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.world = self._made(int(self.np_random.integers(1 << 31)) if seed is None else seed)
        return observations.observe(self.world, self.world.groups[self._name]), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        group = self.world.groups[self._name]
        delivered = observations.act(self.world, group, action, self._most_quanta)
        return (observations.observe(self.world, group), float(delivered.sum()), False,
                self.world.time_s >= self.world.duration_s, {})
