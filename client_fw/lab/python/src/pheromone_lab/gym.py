"""A group of robots as one environment of Gymnasium.

    env = SwarmEnv("ants.toml", "ants")
    observation, info = env.reset(seed=3)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

An observation has a row for each robot (observations.columns names what is in it), an action a row of left
and right speed in m/s and quanta to deposit. The reward is the number of loads that were delivered in the
step. It is truncated at the end of the scenario (duration_s). Each episode has a seed of its own (episodes.py): of
several environments, give each another one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .episodes import Episodes
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
        self._episodes = Episodes(scenario, group, settings, threads, most_quanta)
        rows = (len(self._episodes.group), 1)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (rows[0], self._episodes.columns))
        self.action_space = gymnasium.spaces.Box(np.tile(self._episodes.low, rows), np.tile(self._episodes.high, rows))

    @property
    def world(self) -> World:
        """That of the episode."""
        return self._episodes.world

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        return self._episodes.begin(seed), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        delivered = self._episodes.act(action)
        return self._episodes.observe(), float(delivered.sum()), False, self._episodes.is_over, {}
