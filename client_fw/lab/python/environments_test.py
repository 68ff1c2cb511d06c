#!/usr/bin/env python3
"""Groups of robots as environments of Gymnasium and PettingZoo, of which Debian 12 has neither.

    environments_test.py BUILD_DIR [UNITTEST ARGUMENT...]
"""

import importlib.util
import math
import pathlib
import sys
import types
import unittest
from unittest import mock

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "testing"))

import built  # noqa: E402  (after the path)
import scenarios  # noqa: E402
from scenarios import apart, small  # noqa: E402

lab = built.load(sys.argv.pop(1))


class EnvironmentsTest(unittest.TestCase):
    SCENARIO = scenarios.LIVELY

    def made(self):
        from pheromone_lab import observations
        world = lab.World(self.SCENARIO, drive="ants")
        return observations, world, world.groups["ants"]

    def test_a_robot_is_a_row(self):
        observations, world, ants = self.made()
        seen = observations.observe(world, ants)
        names = observations.columns(ants)
        self.assertEqual((seen.shape, seen.dtype), ((60, len(names)), np.float32))
        np.testing.assert_allclose(seen[:, names.index("x_m")], ants.x_m, rtol=1e-6)
        self.assertTrue((np.abs(seen[:, names.index("heading_rad")]) <= np.float32(math.pi)).all())
        delivered = observations.act(world, ants, np.tile([9.0, 9.0, 9.0], (60, 1)), 2)  # as fast as can be
        self.assertEqual((delivered.sum(), world.steps), (0, 1))
        self.assertEqual(np.nanmax(world.levels("trail")), 0.25)

    def test_wrong_actions_are_refused_by_robot(self):
        observations, world, ants = self.made()
        with self.assertRaisesRegex(lab.LabError, r"found shape \(60, 2\), expected \(60, 3\)"):
            observations.act(world, ants, np.zeros((60, 2)), 8)
        actions = np.zeros((60, 3))
        actions[4][1] = math.nan
        with self.assertRaisesRegex(lab.LabError, r'robot 5 of group "ants", step 0: actions: found \[0.0, nan, 0.0\]'):
            observations.act(world, ants, actions, 8)

    def test_what_is_missing_is_told(self):
        for module, name in (("pheromone_lab.gym", "gymnasium"), ("pheromone_lab.zoo", "pettingzoo")):
            with mock.patch.dict(sys.modules, {"gymnasium": None, "pettingzoo": None}), \
                    self.assertRaisesRegex(ImportError, f"pip install {name}"):
                sys.modules.pop(module, None)
                importlib.import_module(module)

    # Those who have the libraries get their own checks.
    @unittest.skipUnless(importlib.util.find_spec("gymnasium"), "Debian 12 has no Gymnasium")
    def test_gymnasium_accepts_it(self):
        from gymnasium.utils.env_checker import check_env
        from pheromone_lab.gym import SwarmEnv
        check_env(SwarmEnv(self.SCENARIO, "ants"), skip_render_check=True)

    @unittest.skipUnless(importlib.util.find_spec("pettingzoo"), "Debian 12 has no PettingZoo")
    def test_pettingzoo_accepts_it(self):
        from pettingzoo.test import parallel_api_test
        from pheromone_lab.zoo import SwarmParallelEnv
        parallel_api_test(SwarmParallelEnv(self.SCENARIO, "ants"), num_cycles=400)

    def with_stand_ins(self, module):
        """The module, with as much of the two libraries as it uses."""
        class Box:
            def __init__(self, low, high, shape=None):
                self.shape = np.shape(low) if shape is None else shape
                self.low, self.high = np.broadcast_to(low, self.shape), np.broadcast_to(high, self.shape)

        class Env:
            np_random = np.random.default_rng(1)

            def reset(self, *, seed=None, options=None):
                pass
        stand_ins = {"gymnasium": types.SimpleNamespace(Env=Env, spaces=types.SimpleNamespace(Box=Box)),
                     "pettingzoo": types.SimpleNamespace(ParallelEnv=object)}
        with mock.patch.dict(sys.modules, stand_ins):
            sys.modules.pop(module, None)
            return importlib.import_module(module)

    def fits(self, space, value):
        self.assertEqual((space.shape, np.float32), (value.shape, value.dtype))
        self.assertTrue(((space.low <= value) & (value <= space.high)).all())

    def test_an_episode_of_one_environment(self):
        env = self.with_stand_ins("pheromone_lab.gym").SwarmEnv(self.SCENARIO, "ants", settings={"run.duration_s": 1.0})
        self.assertEqual(env.action_space.shape, (60, 3))
        first, _ = env.reset(seed=3)
        again, _ = env.reset(seed=3)
        other, _ = env.reset(seed=4)
        self.fits(env.observation_space, first)
        np.testing.assert_array_equal(first, again)
        self.assertTrue((first != other).any())
        self.assertTrue((env.reset()[0] != env.reset()[0]).any(), "each episode begins alike")
        for step in range(5):
            seen, reward, terminated, truncated, _ = env.step(env.action_space.high)
            self.fits(env.observation_space, seen)
            self.assertEqual((reward, terminated, truncated), (0, False, step == 4))

    def test_episodes_without_a_seed_follow_from_the_scenarios(self):
        gym, zoo = self.with_stand_ins("pheromone_lab.gym"), self.with_stand_ins("pheromone_lab.zoo")
        for made in (gym.SwarmEnv, zoo.SwarmParallelEnv):
            def begins(seed, made=made):
                env = made({**self.SCENARIO, "run": {"duration_s": 1, "seed": seed}}, "ants")
                return [env.reset() and env.world.hash() for _ in range(2)]
            self.assertEqual(begins(5), begins(5))
            self.assertEqual(len({*begins(5), *begins(6)}), 4)
            with self.assertRaisesRegex(lab.LabError, r'settings: found "run.seed" = 3, .*reset\(seed=\)'):
                made(self.SCENARIO, "ants", settings={"run.seed": 3})

    def test_an_episode_of_many_agents(self):
        env = self.with_stand_ins("pheromone_lab.zoo").SwarmParallelEnv(self.SCENARIO, "ants",
                                                                        settings={"run.duration_s": 1.0})
        seen, infos = env.reset(seed=3)
        self.assertEqual((len(seen), list(seen), list(infos)), (60, env.possible_agents, env.agents))
        self.fits(env.observation_space("ants_59"), seen["ants_59"])
        self.assertIs(env.action_space("ants_0"), env.action_space("ants_0"))
        for step in range(5):
            told = env.step({agent: env.action_space(agent).low for agent in env.agents})
            self.assertEqual([list(it) for it in told], [env.possible_agents] * 5)
            self.assertEqual((set(told[2].values()), set(told[3].values())), ({False}, {step == 4}))
        self.assertEqual(env.agents, [])

    def test_who_delivers_is_rewarded(self):
        env = self.with_stand_ins("pheromone_lab.gym").SwarmEnv(small(apart(2, y=2.0), site=[
            {"name": "food", "kind": "food", "at_m": [1.0, 2.0], "radius_m": 0.4},
            {"name": "nest", "kind": "nest", "at_m": [1.0, 2.4], "radius_m": 0.3}]), "ants")
        env.reset()
        stay = np.zeros((2, 3), np.float32)
        env.step(stay)
        self.assertEqual(env.world.groups["ants"].load.tolist(), [1, 0])
        env.world.move_site("food", 8.0, 8.0)
        env.world.move_site("nest", 1.0, 2.0)
        env.step(stay)
        self.assertEqual(env.step(stay)[1], 1)
        self.assertEqual((env.step(stay)[1], env.world.measures()["deliveries"]), (0, 1))


if __name__ == "__main__":
    unittest.main()
