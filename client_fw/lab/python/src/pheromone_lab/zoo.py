"""A group of robots as agents of PettingZoo, all of which act at once.

    env = SwarmParallelEnv("ants.toml", "ants")
    observations, infos = env.reset(seed=3)
    observations, rewards, terminated, truncated, infos = env.step(
        {agent: env.action_space(agent).sample() for agent in env.agents})

Agents are ants_0, ants_1 and so on. Observations and actions are a robot's row of those of gym.SwarmEnv;
a robot's reward is 1 when it delivers a load. A dict for each robot takes some microseconds a robot and
step: for more than some thousand robots take gym.SwarmEnv, or World. Each episode has a seed of its own
(episodes.py): of several environments, give each another one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .episodes import Episodes
from .world import World

try:
    import gymnasium
    import pettingzoo
except ImportError as error:
    raise ImportError("pheromone_lab.zoo needs PettingZoo, which Debian 12 does not have: "
                      "pip install pettingzoo") from error


class SwarmParallelEnv(pettingzoo.ParallelEnv):  # type: ignore[misc]
    """Arguments as those of World, for the group that is driven; `most_quanta` limits a deposit."""

    def __init__(self, scenario: Any, group: str, *, settings: dict[str, Any] | None = None, threads: int = 1,
                 most_quanta: int = 8) -> None:
        self.metadata = {"name": "pheromone_lab"}
        self._episodes = Episodes(scenario, group, settings, threads, most_quanta)
        self.possible_agents = [f"{group}_{robot}" for robot in range(len(self._episodes.group))]
        self.agents: list[str] = []
        box = gymnasium.spaces.Box
        self._spaces = {agent: (box(-np.inf, np.inf, (self._episodes.columns,)),
                                box(self._episodes.low, self._episodes.high))
                        for agent in self.possible_agents}

    @property
    def world(self) -> World:
        """That of the episode."""
        return self._episodes.world

    def observation_space(self, agent: str) -> Any:
        return self._spaces[agent][0]

    def action_space(self, agent: str) -> Any:
        return self._spaces[agent][1]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        observed = self._episodes.begin(seed)
        self.agents = list(self.possible_agents)
        return dict(zip(self.agents, observed)), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, Any]) -> tuple[Any, Any, Any, Any, Any]:
        delivered = self._episodes.act([actions[agent] for agent in self.possible_agents])
        agents, is_over = self.agents, self._episodes.is_over
        if is_over:
            self.agents = []
        return (dict(zip(agents, self._episodes.observe())), dict(zip(agents, delivered.tolist())),
                dict.fromkeys(agents, False), dict.fromkeys(agents, is_over), {agent: {} for agent in agents})
