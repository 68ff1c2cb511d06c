"""A group of robots as agents of PettingZoo, all of which act at once.

    env = SwarmParallelEnv("ants.toml", "ants")
    observations, infos = env.reset(seed=3)
    observations, rewards, terminated, truncated, infos = env.step(
        {agent: env.action_space(agent).sample() for agent in env.agents})

Agents are ants_0, ants_1 and so on. Observations and actions are a robot's row of those of gym.SwarmEnv;
a robot's reward is 1 when it delivers a load. A dict for each robot takes some microseconds a robot and
step: for more than some thousand robots take gym.SwarmEnv, or World.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from . import observations
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
        self._scenario, self._settings, self._threads = scenario, settings or {}, threads
        self._name = group
        self._most_quanta = most_quanta
        self.metadata = {"name": "pheromone_lab"}
        self._random = np.random.default_rng()
        self.world = self._made(None)
        robots = self.world.groups[group]
        self.possible_agents = [f"{group}_{robot}" for robot in range(len(robots))]
        self.agents: list[str] = []
        low, high = observations.limits(robots, most_quanta)
        seen = len(observations.columns(robots))
        self._spaces = {agent: (gymnasium.spaces.Box(-np.inf, np.inf, (seen,)), gymnasium.spaces.Box(low, high))
                        for agent in self.possible_agents}

    def observation_space(self, agent: str) -> Any:
        return self._spaces[agent][0]

    def action_space(self, agent: str) -> Any:
        return self._spaces[agent][1]

    def _observed(self) -> dict[str, Any]:
        rows = observations.observe(self.world, self.world.groups[self._name])
        return dict(zip(self.possible_agents, rows))

    def _made(self, seed: int | None) -> World:
        seeded = {} if seed is None else {"run.seed": seed}
        return World(self._scenario, drive=self._name, settings={**self._settings, **seeded}, threads=self._threads)

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        if seed is not None:
            self._random = np.random.default_rng(seed)
        self.world = self._made(int(self._random.integers(1 << 31)) if seed is None else seed)
        self.agents = list(self.possible_agents)
        return self._observed(), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, Any]) -> tuple[Any, Any, Any, Any, Any]:
        group = self.world.groups[self._name]
        delivered = observations.act(self.world, group, [actions[agent] for agent in self.possible_agents],
                                     self._most_quanta)
        ended = self.world.time_s >= self.world.duration_s
        agents = self.agents
        if ended:
            self.agents = []
        return (self._observed(), dict(zip(agents, delivered.tolist())), dict.fromkeys(agents, False),
                dict.fromkeys(agents, ended), {agent: {} for agent in agents})
